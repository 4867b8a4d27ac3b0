//! The built-in dual pixel of a phone against what was measured of that phone.

use quadpixel::em::PixelStack;
use quadpixel::em::wave::{WaveModel, WaveSettings};

/// Sine of the pupil's rim that was fitted beside the pixel (docs/real-camera/phone.md).
const RIM: f64 = 1.0 / (2.0 * 1.938);
const RAYS: usize = 240;

/// P of left and right.
fn absorbed(model: &WaveModel, u: f64, v: f64) -> [f64; 2] {
    let p = model.solve(u, v).unwrap().mean.absorbed;
    [p[0], p[1]]
}

/// Kernels at 48 fields (S. Xin et al., ICCV 2021). In the middle of the picture the halves are shifted by 0.244 of the
/// disk, the kernels overlap by 0.572, and the left half's shares near both edges are 0.88 and 0.12. Bounds are the
/// fit's goals.
#[test]
fn halves_are_parted_as_a_phone_parts_them() {
    let stack = PixelStack::builtin("1.4um-dual").unwrap();
    let model = WaveModel::new(&stack, 550.0, &WaveSettings::standard()).unwrap();
    let (mut sums, mut moments, mut values) = ([0.0; 2], [0.0; 2], Vec::new());
    for k in 0..RAYS {
        let r = RIM * ((k as f64 + 0.5) / RAYS as f64).sqrt();
        let (v, u) = (2.399_963 * k as f64).sin_cos();
        let p = absorbed(&model, r * u, r * v);
        for side in 0..2 {
            sums[side] += p[side];
            moments[side] += p[side] * r * u;
        }
        values.push(p);
    }
    let shift = (moments[0] / sums[0] - moments[1] / sums[1]).abs() / (2.0 * RIM);
    assert!((shift / 0.244 - 1.0).abs() < 0.04, "{shift}");
    let overlap: f64 = (values.iter())
        .map(|p| (p[0] / sums[0]).min(p[1] / sums[1]))
        .sum();
    assert!((overlap - 0.572).abs() < 0.02, "{overlap}");
    let mut shares = [-0.9, 0.9].map(|edge| {
        let [left, right] = absorbed(&model, edge * RIM, 0.0);
        left / (left + right)
    });
    // Which half of the pupil the left photodiode sees is the frames' matter.
    shares.sort_by(f64::total_cmp);
    assert!((shares[0] - 0.12).abs() < 0.04, "{shares:?}");
    assert!((shares[1] - 0.88).abs() < 0.04, "{shares:?}");
}
