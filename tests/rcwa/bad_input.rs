//! What is refused, and how it is said.

use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::{RcwaModel, RcwaSettings};

use super::small;

#[test]
fn bad_settings_pixels_and_directions_are_refused_with_the_reason() {
    let (stack, settings) = small();
    let said = |stack: &PixelStack, nm: f64, settings: RcwaSettings| {
        let model = RcwaModel::new(stack, nm, &settings);
        model.err().map(|e| e.to_string()).unwrap_or_default()
    };
    let with = |change: &dyn Fn(&mut RcwaSettings)| {
        let mut s = settings;
        change(&mut s);
        said(&stack, 550.0, s)
    };
    assert!(with(&|s| s.slice_nm = 0.0).contains("rcwa: slice_nm is 0; allowed: 2 to 100"));
    assert!(with(&|s| s.lens_cutoff = f64::NAN).contains("lens_cutoff is NaN"));
    assert!(with(&|s| s.wall_cutoff = 99.0).contains("wall_cutoff is 99"));
    assert!(with(&|s| s.silicon_margin = -1.0).contains("silicon_margin is -1"));
    assert!(said(&stack, 900.0, settings).contains("wavelength_nm is 900"));
    let mut broken = stack.clone();
    broken.pitch_um = -1.0;
    assert!(said(&broken, 550.0, settings).contains("pitch_um is -1"));
    let mut huge = stack.clone();
    (huge.pitch_um, huge.lens.radius_um) = (12.0, 9.0);
    (huge.lens.height_um, huge.subpixels) = (9.0, quadpixel::sensor::Subpixels::SINGLE);
    assert!(said(&huge, 550.0, settings).contains("functions of a class in silicon"));

    let model = RcwaModel::new(&stack, 550.0, &settings).unwrap();
    for (u, v) in [(1.0, 0.0), (0.8, 0.8), (f64::NAN, 0.0)] {
        let e = model.solve(u, v).unwrap_err().to_string();
        assert!(e.contains("sine of the angle of incidence"), "{e}");
    }
}

#[test]
fn presets_are_in_range_and_their_orders_grow() {
    let presets = [
        RcwaSettings::draft(),
        RcwaSettings::standard(),
        RcwaSettings::reference(),
    ];
    for p in &presets {
        p.check().unwrap();
    }
    for pair in presets.windows(2) {
        assert!(pair[1].silicon_margin > pair[0].silicon_margin);
        assert!(pair[1].lens_cutoff > pair[0].lens_cutoff);
        assert!(pair[1].slice_nm < pair[0].slice_nm);
    }
}
