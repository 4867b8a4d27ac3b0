//! What is refused, by field, value and what is allowed.

use quadpixel::em::fdtd::{FdtdSettings, solve};
use quadpixel::em::{Material, PixelStack};

use super::{coarse, small};

fn refused(stack: &PixelStack, nm: f64, bloch: [f64; 2], settings: &FdtdSettings) -> String {
    solve(stack, &[nm], bloch, settings, &|_| ())
        .unwrap_err()
        .to_string()
}

#[test]
fn pixels_that_cannot_be_are_refused() {
    type Change = fn(&mut PixelStack);
    let cases: [(Change, &str); 3] = [
        (|p| p.layers[1].thickness_um = -0.1, "thickness_um is -0.1"),
        (|p| p.lens.radius_um = 0.5, "lens.radius_um is 0.5"),
        (
            |p| p.silicon = Material::Table("Sj".into()),
            "silicon is Sj",
        ),
    ];
    for (change, said) in cases {
        let mut stack = small(0.8);
        change(&mut stack);
        let e = refused(&stack, 550.0, [0.0, 0.0], &coarse());
        assert!(e.contains(said), "{e}");
    }
}

#[test]
fn wavelengths_outside_the_tables_and_waves_that_do_not_travel_are_refused() {
    let e = refused(&small(0.8), 900.0, [0.0, 0.0], &coarse());
    assert!(e.contains("wavelength_nm is 900"), "{e}");
    let e = refused(&small(0.8), 550.0, [12.0, 0.0], &coarse());
    assert!(e.contains("sine of the angle of incidence"), "{e}");
    assert!(solve(&small(0.8), &[], [0.0; 2], &coarse(), &|_| ()).is_err());
    let e = refused(&small(0.8), 550.0, [f64::NAN, 0.0], &coarse());
    assert!(e.contains("sine of the angle of incidence"), "{e}");
}

#[test]
fn a_mesh_larger_than_the_machine_is_refused_before_it_starts() {
    let stack = PixelStack::paper(6.0, 4.2427, 4.2427, 1.0);
    let settings = FdtdSettings {
        lateral_nm: 2.0,
        cells_per_wavelength: 60.0,
        ..FdtdSettings::reference()
    };
    let bytes = settings.memory_bytes(&stack, &[550.0], [1.0, 0.0]).unwrap();
    assert!(bytes > 1 << 40);
    let e = refused(&stack, 550.0, [1.0, 0.0], &settings);
    assert!(e.contains("GiB needed") && e.contains("GiB free"), "{e}");
}

#[test]
fn every_preset_is_in_range() {
    for settings in [
        FdtdSettings::draft(),
        FdtdSettings::standard(),
        FdtdSettings::reference(),
    ] {
        settings.check().unwrap();
    }
    let bad = FdtdSettings {
        lateral_nm: -1.0,
        ..FdtdSettings::draft()
    };
    assert!(
        bad.check()
            .unwrap_err()
            .to_string()
            .contains("lateral_nm is -1")
    );
}
