//! Every stated and verified figure of every lens in the library, against this crate's tracer; and the lens from a
//! Zemax file.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod bad_input;
mod focus;
mod misalignment;
mod rims;

use quadpixel::lens::Field;
use quadpixel::lens::verification::{Comparison, Origin, WHY_STATED_FIGURES_DIFFER, compare};
use quadpixel::lens::{Lens, Prescription, builtin_names};
use quadpixel::units::D_LINE_NM;

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
fn excused_figures_do_differ_and_the_independent_tracer_agrees_with_ours() {
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
    // 25.67 mm is what the file prints; it holds only with the indices written in its GLAS lines, not with those of the
    // glasses it names.
    let file = include_bytes!("data/rf50mm.zmx");
    let lens = Lens::new(&Prescription::from_zmx(file, "rf50mm.zmx").unwrap()).unwrap();
    let p = lens.paraxial(587.5618).unwrap();
    assert!((p.bfl_mm - 25.67).abs() < 5e-3, "BFL {}", p.bfl_mm);
    assert!((p.efl_mm / 50.0 - 1.0).abs() < 0.01, "EFL {}", p.efl_mm);
    assert!((2.0 * p.entrance_pupil_semi_mm - 26.75).abs() < 1e-9);
    assert!((p.f_number - 1.85).abs() < 5e-3, "F/{}", p.f_number);
    assert_eq!(lens.prescription().wavelengths_nm.len(), 3);
}

#[test]
fn bundled_50_mm_lens_is_the_one_of_the_zemax_file() {
    let file = include_bytes!("data/rf50mm.zmx");
    let read = Lens::new(&Prescription::from_zmx(file, "rf50mm.zmx").unwrap()).unwrap();
    let bundled = Prescription::builtin("lib_50mm_US20210263286_ex1").unwrap();
    let bundled = Lens::new(&bundled).unwrap();
    // The file's reader takes the catalogue's glass where its n_d is the line's (five digits): 5e-6 of an index, 5e-6 ×
    // 50 mm × a few surfaces of length. The line itself is what the bundled lens has.
    let same = |what: &str, x: f64, y: f64| assert!((x - y).abs() < 2e-3, "{what}: {x} and {y}");
    // Marked F-numbers and the stops noted for them beside the file. Marks are rounded to a third of a stop, 12 %.
    for (mark, stop_semi_mm) in [(1.8, 8.0), (2.8, 5.69), (4.0, 3.65), (5.6, 2.85)] {
        let at = |lens: &Lens| {
            let lens = lens.with_stop_semi_mm(stop_semi_mm).unwrap();
            lens.focused_from_sensor(1000.0, D_LINE_NM).unwrap()
        };
        let (a, b) = (at(&read), at(&bundled));
        same("sensor, mm", a.sensor_z_mm(), b.sensor_z_mm());
        let [a, b] = [a, b].map(|l| l.paraxial(D_LINE_NM).unwrap());
        same("EFL, mm", a.efl_mm, b.efl_mm);
        same("F-number", a.f_number, b.f_number);
        assert!(
            (b.f_number / mark - 1.0).abs() < 0.12,
            "F/{mark}: {}",
            b.f_number
        );
    }
    for field_deg in [7.0, 14.0, 21.0] {
        let at = |lens: &Lens| {
            let lens = lens.with_stop_semi_mm(3.65).unwrap();
            lens.field_figures(Field::up(field_deg)).unwrap()
        };
        let (a, b) = (at(&read), at(&bundled));
        same(
            "chief height, mm",
            a.chief_height_mm.unwrap(),
            b.chief_height_mm.unwrap(),
        );
        same(
            "distortion, %",
            a.distortion_pct.unwrap(),
            b.distortion_pct.unwrap(),
        );
    }
}
