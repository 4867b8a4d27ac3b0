//! Every stated and verified figure of every lens in the library, against this crate's tracer; and the lens from a Zemax file.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod bad_input;
mod focus;
mod misalignment;

use quadpixel::lens::aim::Field;
use quadpixel::lens::verification::{Comparison, Origin, WHY_STATED_FIGURES_DIFFER, compare};
use quadpixel::lens::{Lens, Prescription, builtin_names};

fn figures(name: &str) -> Vec<Comparison> {
    compare(&Prescription::builtin(name).unwrap()).unwrap()
}

#[test]
fn every_figure_of_every_lens_agrees_with_its_file() {
    let mut compared = 0;
    let mut wrong = Vec::new();
    for name in builtin_names() {
        let all = figures(name);
        compared += all.len();
        let differs = |c: &Comparison| !c.agrees() && c.why_it_differs(name).is_none();
        wrong.extend(all.into_iter().filter(differs).map(|c| (name, c)));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(
        compared > 800,
        "only {compared} figures were found to compare"
    );
}

#[test]
fn stated_figures_excused_do_differ_and_the_independent_tracer_sides_with_this_one() {
    for (name, figure, _) in WHY_STATED_FIGURES_DIFFER {
        let all = figures(name);
        let of = |origin| {
            all.iter()
                .find(|c| c.origin == origin && c.figure == *figure)
        };
        assert!(
            !of(Origin::Stated).unwrap().agrees(),
            "{name}: {figure} needs no excuse"
        );
        if let Some(verified) = of(Origin::Verified) {
            assert!(verified.agrees(), "{name}: {figure}");
        }
    }
}

#[test]
fn deeplens_image_height_is_reached_at_the_angle_given_as_the_reason() {
    let lens = Lens::new(&Prescription::builtin("wide_deeplens_cellphone80deg").unwrap()).unwrap();
    let height = |deg| {
        lens.field_figures(Field::up(deg))
            .unwrap()
            .chief_height_mm
            .unwrap()
    };
    assert!((height(41.7) - 3.83).abs() < 5e-3);
    assert!((height(41.39) - 3.81).abs() < 5e-3);
}
#[test]
fn zemax_file_of_a_50_mm_lens_focuses_where_its_own_image_distance_says() {
    // 25.67 mm is what the file prints; it holds only with the indices written in its GLAS lines, not with those of the glasses it names.
    let file = include_bytes!("data/rf50mm.zmx");
    let lens = Lens::new(&Prescription::from_zmx(file, "rf50mm.zmx").unwrap()).unwrap();
    let p = lens.paraxial(587.5618).unwrap();
    assert!((p.bfl_mm - 25.67).abs() < 5e-3, "BFL {}", p.bfl_mm);
    assert!((p.efl_mm / 50.0 - 1.0).abs() < 0.01, "EFL {}", p.efl_mm);
    assert!((2.0 * p.entrance_pupil_semi_mm - 26.75).abs() < 1e-9);
    assert!((p.f_number - 1.85).abs() < 5e-3, "F/{}", p.f_number);
    assert_eq!(lens.prescription().wavelengths_nm.len(), 3);
}
