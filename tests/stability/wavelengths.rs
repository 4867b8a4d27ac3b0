//! Wavelengths at the ends of what glass data hold.

use quadpixel::lens::{Travel, builtin_names};
use quadpixel::lens::{WAVELENGTH_RANGE_NM, catalogue_glass, catalogue_names};

use crate::{builtin, free};

/// At both ends every index is finite and within 1 to 5, the focal length within 15 % of that in the middle, and the
/// ray at half the pupil arrives; a nanometre beyond, and NaN, are refused by name.
#[test]
fn the_ends_of_the_glass_data() {
    let (low, high) = WAVELENGTH_RANGE_NM;
    for name in builtin_names() {
        let lens = builtin(name);
        let middle = lens.paraxial(550.0).unwrap();
        for nm in [low, high] {
            let system = lens.at(nm).unwrap();
            for s in &system.surfaces {
                assert!(
                    (1.0..5.0).contains(&s.index_after),
                    "{name}: {}",
                    s.index_after
                );
            }
            let efl = lens.paraxial(nm).unwrap().efl_mm;
            assert!(
                (efl / middle.efl_mm - 1.0).abs() < 0.15,
                "{name} {nm}: {efl}"
            );
            let ray = quadpixel::rays::Ray {
                origin_mm: glam::DVec3::new(0.5 * middle.entrance_pupil_semi_mm, 0.0, -1.0),
                direction: glam::DVec3::Z,
            };
            let end = free(&system, ray, Travel::Forward).unwrap();
            assert!(end.origin_mm.is_finite(), "{name} {nm}");
        }
        for nm in [low - 1.0, high + 1.0, f64::NAN, f64::INFINITY, 0.0, -550.0] {
            let error = lens.at(nm).unwrap_err().to_string();
            assert!(error.contains("wavelength_nm"), "{error}");
        }
    }
}

/// Every catalogue glass has normal dispersion from end to end: the index falls with the wavelength, by less than 0.3.
#[test]
fn catalogue_glasses_have_normal_dispersion_from_end_to_end() {
    let (low, high) = WAVELENGTH_RANGE_NM;
    for name in catalogue_names() {
        let glass = catalogue_glass(name).unwrap();
        let steps = 751;
        let at = |i: usize| glass.index(low + (high - low) * i as f64 / (steps - 1) as f64);
        for i in 1..steps {
            assert!(at(i) < at(i - 1), "{name} at step {i}");
        }
        assert!(at(0) - at(steps - 1) < 0.3, "{name}");
    }
}
