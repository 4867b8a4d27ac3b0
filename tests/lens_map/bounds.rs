//! The bound, held by rays that the maps have not seen.

use quadpixel::lens::{
    ElementRef, MapBound, MapFailure, Misalignment, builtin_names, table1_defects,
};

use crate::support::{Case, errors, far_errors, lens};

/// Misjudged rays that are let pass: of the flux.
const MISJUDGED: f64 = 2e-4;

fn meets_its_bound(case: &Case) {
    let errors = errors(case);
    for (rms_px, worst_px) in errors.rms_px.iter().zip(&errors.worst_px) {
        assert!(*rms_px <= case.bound.rms_px, "{errors:?}");
        assert!(*worst_px <= case.bound.worst_px, "{errors:?}");
    }
    assert!(errors.misjudged <= MISJUDGED, "{errors:?}");
    assert!(errors.exact < 0.02, "{errors:?}");
}

#[test]
fn a_phone_s_lens_in_the_middle_and_at_half_the_field() {
    for centre in [[0.0, 0.0], [1.1, -0.7]] {
        meets_its_bound(&Case::phone("wide_US20120327520A1_emb3", centre));
    }
}

#[test]
fn at_the_edge_of_the_image_circle() {
    meets_its_bound(&Case::phone("wide_US20120327520A1_emb3", [1.7, 1.5]));
    meets_its_bound(&Case::phone("wide_US11940605B2_emb1", [-2.0, 0.6]));
}

/// Rays that diffraction displaces by more than the map's reach.
#[test]
fn rays_from_far_beside_their_place_err_by_a_hundredth_of_the_way() {
    for (name, centre) in [
        ("wide_US20120327520A1_emb3", [0.3, -0.2]),
        ("wide_US20120327520A1_emb3", [1.7, 1.5]),
        ("wide_US11940605B2_emb1", [1.0, 0.6]),
    ] {
        let case = Case::phone(name, centre);
        // The band at the pupil's edge that is traced exactly widens with the way: most rays go a part of it only.
        for (part, most_exact) in [(0.25, 0.1), (1.0, 1.0)] {
            let (far_px, errors) = far_errors(&case, part);
            println!("{name}: {part} of {far_px} px, {errors:?}");
            assert!(far_px >= 16.0, "{name}: {far_px}");
            for (rms, worst) in errors.rms_px.iter().zip(&errors.worst_px) {
                assert!(*rms <= 0.01 && *worst <= 0.1, "{name}: {errors:?}");
            }
            assert!(errors.misjudged <= MISJUDGED, "{name}: {errors:?}");
            assert!(errors.exact < most_exact, "{name}: {errors:?}");
        }
    }
}

#[test]
fn chief_rays_of_a_fish_eye() {
    meets_its_bound(&Case::large("lib_fisheye_10mm", [6.5, 5.0], 0.6));
    meets_its_bound(&Case::large("lib_fisheye_Miyamoto1964", [0.0, -9.0], 0.6));
}

#[test]
fn a_bundle_that_is_cut_from_both_sides_and_slivers_of_one() {
    meets_its_bound(&Case::large("lib_dgauss_50mm", [12.0, 8.0], 1.0));
    meets_its_bound(&Case::large("lib_dgauss_50mm", [18.0, 13.0], 0.6));
    meets_its_bound(&Case::large(
        "lib_50mm_US20210263286_ex1",
        [16.0, -10.0],
        0.8,
    ));
}

#[test]
fn a_focus_at_60_mm_and_one_at_infinity() {
    for focus_mm in [60.0, f64::INFINITY] {
        let near = Case::phone("wide_US20120327520A1_emb3", [0.9, 0.6]);
        meets_its_bound(&Case { focus_mm, ..near });
    }
}

#[test]
fn misaligned_elements_and_a_turned_mirror() {
    let folded = Case::phone("tele_US10571665B2_220b", [0.8, 0.9]);
    let perturbed = folded.lens.perturbed(&table1_defects()).unwrap();
    meets_its_bound(&Case {
        lens: perturbed,
        ..folded
    });
    let turned = Misalignment {
        dx_um: 9.0,
        dy_um: 5.0,
        tip_deg: 0.2,
        tilt_deg: 0.2,
        ..Misalignment::none(ElementRef::Element(3))
    };
    let straight = Case::phone("wide_US20120327520A1_emb3", [-0.7, 0.8]);
    let perturbed = straight.lens.perturbed(&[turned]).unwrap();
    meets_its_bound(&Case {
        lens: perturbed,
        ..straight
    });
}

/// Every lens of the library on its axis, where each has a map, at its bound.
#[test]
fn every_lens_on_its_axis() {
    for name in builtin_names() {
        println!("{name}");
        let efl_mm = lens(name).paraxial(550.0).unwrap().efl_mm;
        let case = match efl_mm < 20.0 && !name.starts_with("lib") {
            true => Case::phone(name, [0.0, 0.0]),
            false => Case {
                focus_mm: 40.0 * efl_mm,
                ..Case::large(name, [0.0, 0.0], 0.5)
            },
        };
        meets_its_bound(&case);
    }
}

#[test]
fn a_bound_that_cannot_be_met_is_refused_and_a_dark_window_too() {
    let phone = Case::phone("wide_US20120327520A1_emb3", [1.0, 0.0]);
    let bound = MapBound {
        rms_px: 1e-9,
        worst_px: 1e-8,
    };
    let failure = Case { bound, ..phone }.map().err();
    assert_eq!(failure, Some(MapFailure::Degree));
    let outside = Case::phone("wide_US20120327520A1_emb3", [9.0, 0.0]);
    assert_eq!(outside.map().err(), Some(MapFailure::Dark));
    // It says so in words.
    assert!(MapFailure::Dark.to_string().contains("dark"));
}
