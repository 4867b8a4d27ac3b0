//! Waves that carry the lens's own phases, against the blur of the rays times that of the aperture.

use glam::DVec2;
use quadpixel::lens::{FocusBy, Lens, Prescription};

use crate::pupil::Pupil;

const WAVELENGTH_NM: f64 = 550.0;
/// Directions along each side of the pupil.
const SIDE: usize = 192;
/// Frequencies over that at which the aperture's transfer ends.
const FREQUENCIES: [usize; 4] = [16, 8, 4, 2];

struct Case {
    lens: &'static str,
    f_number: Option<f64>,
    focus_mm: f64,
    /// Off the axis, mm on the sensor.
    heights_mm: [f64; 2],
}

const CASES: [Case; 4] = [
    Case {
        lens: "wide_US20120327520A1_emb3",
        f_number: None,
        focus_mm: 750.0,
        heights_mm: [0.0, 2.0],
    },
    Case {
        lens: "lib_double_gauss_100mm_glass",
        f_number: None,
        focus_mm: 3000.0,
        heights_mm: [0.0, 12.0],
    },
    Case {
        lens: "lib_double_gauss_100mm_glass",
        f_number: Some(16.0),
        focus_mm: 3000.0,
        heights_mm: [0.0, 12.0],
    },
    Case {
        lens: "tele_US10571665B2_220b",
        f_number: None,
        focus_mm: 3000.0,
        heights_mm: [0.0, 1.5],
    },
];

/// |waves| and |rays × aperture| at each frequency.
fn transfers(case: &Case, height_mm: f64, depths_of_focus: f64) -> ([f64; 4], [f64; 4], [f64; 4]) {
    let mut lens = Lens::new(&Prescription::builtin(case.lens).unwrap()).unwrap();
    if let Some(f) = case.f_number {
        lens = lens.with_f_number(f).unwrap();
    }
    let lens = lens
        .focused_at(case.focus_mm, FocusBy::Sensor, WAVELENGTH_NM)
        .unwrap();
    // A depth of focus: the sensor displaced by 2 λ F², a quarter of a wave at the edge of the pupil.
    let f = lens.paraxial(WAVELENGTH_NM).unwrap().f_number;
    let shift_mm = depths_of_focus * 2.0 * WAVELENGTH_NM * 1e-6 * f * f;
    let lens = match shift_mm == 0.0 {
        true => lens,
        false => lens.with_focus_error(shift_mm, WAVELENGTH_NM).unwrap(),
    };
    let system = lens.at(WAVELENGTH_NM).unwrap();
    let pupil = Pupil::new(
        &system,
        DVec2::new(0.6, 0.8) * height_mm,
        case.focus_mm,
        SIDE,
    );
    let all = FREQUENCIES.map(|part| pupil.transfer((SIDE / part, 0), WAVELENGTH_NM * 1e-6));
    let length = |k: usize| all.map(|t| t[k].length());
    (length(0), length(1), length(2))
}

/// The reference itself: stopped down and in focus the lens is nearly perfect, and defocus by a depth of focus costs
/// what a quarter of a wave does.
#[test]
fn waves_through_lenses_lose_contrast_as_they_must() {
    println!(
        "lens, F, height mm, depths of focus: waves | aperture | rays alone, at 1/16, 1/8, 1/4, 1/2 of the cutoff"
    );
    for case in &CASES {
        for height in case.heights_mm {
            for depths in [0.0, -1.0, 1.0, -4.0, 4.0] {
                let (waves, product, aperture) = transfers(case, height, depths);
                let show = |t: [f64; 4]| t.map(|x| format!("{x:.3}")).join(" ");
                let rays = std::array::from_fn(|i| product[i] / aperture[i]);
                println!(
                    "{}, {:?}, {height}, {depths}: {} | {} | {}",
                    case.lens,
                    case.f_number,
                    show(waves),
                    show(aperture),
                    show(rays)
                );
                // No aberration adds contrast.
                for (with, without) in waves.iter().zip(aperture) {
                    assert!(*with < without + 2e-3, "{} {height} {depths}", case.lens);
                }
                let stopped_down = case.f_number.is_some() && height == 0.0;
                let wanted = match (stopped_down, depths) {
                    (true, 0.0) => Some(aperture),
                    // Numerically, W = w²/4 wave over a disk, at 1/16, 1/8, 1/4, 1/2 of the cutoff.
                    (true, d) if d.abs() == 1.0 => Some([0.905, 0.793, 0.576, 0.287]),
                    _ => None,
                };
                for (with, wanted) in waves.iter().zip(wanted.unwrap_or(waves)) {
                    assert!((with - wanted).abs() < 0.05, "{depths}: {waves:?}");
                }
            }
        }
    }
}
