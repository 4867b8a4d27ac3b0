//! Fields in the photodiodes: their squares are the absorption, and mirrors turn them as they must.

use quadpixel::em::rcwa::RcwaModel;

use super::small;

#[test]
fn squares_of_the_fields_are_what_the_photodiodes_absorb() {
    let (stack, settings) = small();
    let model = RcwaModel::new(&stack, 550.0, &settings).unwrap();
    for [u, v] in [[0.0, 0.0], [0.3, 0.0], [-0.2, 0.1]] {
        let light = model.solve(u, v).unwrap();
        let fields = model.photodiode_fields(u, v).unwrap();
        let [x, y] = [0, 1].map(|polarization| fields.product(&fields, polarization));
        for (i, absorbed) in light.mean.absorbed.iter().enumerate() {
            // The mean over two polarizations is that over any other two.
            let by_fields = 0.5 * (x[i].re + y[i].re);
            assert!(
                (by_fields - absorbed).abs() < 2e-6,
                "{u} {v}: {by_fields} {absorbed}"
            );
        }
    }
}

#[test]
fn light_from_the_other_side_is_the_mirror_image() {
    let (stack, settings) = small();
    let model = RcwaModel::new(&stack, 550.0, &settings).unwrap();
    let [other, zero, here] = [-0.25, 0.0, 0.25].map(|u| model.photodiode_fields(u, 0.0).unwrap());
    let mirrored = here.mirrored_x();
    for polarization in [0, 1] {
        // Products with a third wave hold the phase and its sign.
        let (a, b) = (
            zero.product(&other, polarization),
            zero.product(&mirrored, polarization),
        );
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).norm() < 1e-5, "{a} {b}");
        }
    }
}
