//! What holds for light in any pixel: energy, mirrors, reciprocity, and convergence.

use quadpixel::em::Material;
use quadpixel::em::light::direction_cosines;
use quadpixel::em::rcwa::RcwaSettings;

use super::{all, distance, small, solve, tungsten, walls};

#[test]
fn nothing_is_lost_without_absorption() {
    let (mut stack, settings) = small();
    stack.silicon = Material::Constant { n: 4.077, k: 0.0 };
    stack.filter_layer_mut().unwrap().material = Material::Constant { n: 1.6, k: 0.0 };
    for [u, v] in [[0.0, 0.0], [0.4, 0.0], [0.3, -0.2]] {
        let answer = solve(&stack, &settings, u, v);
        for p in [answer.s(), answer.p()] {
            // The slices keep energy but for rounding: their A and B are i times Hermitian operators.
            assert!((p.reflected + p.transmitted - 1.0).abs() < 1e-8, "{p:?}");
            assert!(p.elsewhere.abs() < 1e-8 && p.sum_by_flux().abs() < 1e-8);
            assert!(p.absorbed.iter().all(|p| *p == 0.0));
        }
    }
}

#[test]
fn absorption_by_volume_is_what_the_flux_loses() {
    let (mut stack, settings) = small();
    for walled in [false, true] {
        if walled {
            stack.metal = Some(walls("oxide", tungsten()));
        }
        for [u, v] in [[0.0, 0.0], [0.0, 0.4], [0.3, -0.2]] {
            let answer = solve(&stack, &settings, u, v);
            for p in [answer.s(), answer.p()] {
                assert!((p.balance() - 1.0).abs() < 1e-6, "{p:?}");
                let volume: f64 = p.absorbed.iter().sum();
                assert!((volume - p.sum_by_flux()).abs() < 1e-6, "{p:?}");
                assert!(p.elsewhere > 0.0 && p.transmitted > 0.0);
            }
        }
    }
}

#[test]
fn mirror_images_of_the_wave_have_mirrored_answers() {
    let (stack, settings) = small();
    let [u, v] = direction_cosines(30.0, 25.0);
    let one = solve(&stack, &settings, u, v);
    let s = stack.subpixels;
    for ([u, v], image) in [
        ([-u, v], [1, 0, 3, 2]),
        ([u, -v], [2, 3, 0, 1]),
        ([v, u], [0, 2, 1, 3]),
    ] {
        let other = solve(&stack, &settings, u, v);
        for (a, b) in [(one.s(), other.s()), (one.p(), other.p())] {
            for (i, j) in image.into_iter().enumerate() {
                let off = (a.absorbed[i] - b.absorbed[j]).abs();
                assert!(off < 1e-9, "{} {off:.1e}", s.name(i));
            }
            assert!((a.reflected - b.reflected).abs() < 1e-9);
        }
    }
}

#[test]
fn halves_by_mirrors_are_the_whole() {
    // A hair off the plane of the mirror no mirror is used; the answer cannot change by more than the hair.
    let (stack, settings) = small();
    for ([u, v], [du, dv]) in [([0.3, 0.0], [0.0, 1e-9]), ([0.0, -0.2], [1e-9, 0.0])] {
        let halved = solve(&stack, &settings, u, v);
        let whole = solve(&stack, &settings, u + du, v + dv);
        assert!(2 * whole.functions.unwrap() > 3 * halved.functions.unwrap());
        let off = distance(&all(&halved), &all(&whole));
        assert!(off < 1e-6, "{off:.1e}");
    }
}

#[test]
fn normal_incidence_knows_no_polarization_and_no_side() {
    let (stack, settings) = small();
    let answer = solve(&stack, &settings, 0.0, 0.0);
    let off = distance(&all(&answer)[..8], &all(&answer)[8..]);
    assert!(off < 1e-9, "{off:.1e}");
    let p = &answer.s().absorbed;
    assert!(p.iter().all(|x| (x - p[0]).abs() < 1e-9), "{p:?}");
}

/// Lorentz: where order 0 is the only one in air, a pixel without any symmetry reflects as much from −k∥ as from k∥.
#[test]
fn reflection_is_reciprocal_under_a_shifted_lens() {
    let (mut stack, settings) = small();
    stack.pitch_um = 0.4;
    stack.lens.shift_um = [0.07, 0.03];
    stack.trench_um = 0.05;
    let (one, back) = (
        solve(&stack, &settings, 0.2, 0.1),
        solve(&stack, &settings, -0.2, -0.1),
    );
    for (a, b) in [(one.s(), back.s()), (one.p(), back.p())] {
        assert!((a.reflected - b.reflected).abs() < 1e-6, "{a:?} {b:?}");
        let apart = distance(&a.absorbed, &b.absorbed);
        assert!(apart > 1e-3, "the shift does nothing: {apart:.1e}");
    }
}

#[test]
fn thinner_slices_converge_with_order_five_halves() {
    let (stack, settings) = small();
    let at = |slice_nm| {
        let settings = RcwaSettings {
            slice_nm,
            ..settings
        };
        all(&solve(&stack, &settings, 0.3, 0.0))
    };
    // The method is of order 4, but the corners between lenses begin as z^(3/2): 5/2 (see `lens.rs`), a factor of 5.7;
    // 4 is order 2.
    let exact = at(4.0);
    let errors = [80.0, 40.0, 20.0].map(|nm| distance(&at(nm), &exact));
    println!("{errors:?}");
    assert!(errors[1] < errors[0] / 4.0 && errors[2] < errors[1] / 4.0);
}

#[test]
fn more_orders_in_silicon_converge() {
    let (stack, settings) = small();
    let at = |silicon_margin| {
        let settings = RcwaSettings {
            silicon_margin,
            ..settings
        };
        all(&solve(&stack, &settings, 0.3, 0.0))
    };
    let exact = at(16.0);
    let errors = [1.0, 3.0, 7.0].map(|margin| distance(&at(margin), &exact));
    println!("{errors:?}");
    assert!(errors[1] < 0.5 * errors[0] && errors[2] < 0.5 * errors[1]);
}

/// Plain silicon couples no orders, so that none but those above it are followed; thin trenches go the long way,
/// through modes.
#[test]
fn silicon_without_trenches_is_the_limit_of_thin_ones() {
    let (mut stack, settings) = small();
    stack.subpixels = quadpixel::sensor::Subpixels::DUAL_X;
    let mut at = |trench_um| {
        stack.trench_um = trench_um;
        solve(&stack, &settings, 0.3, 0.0)
    };
    let plain = at(0.0);
    // Three walls of 1e-4 um along and across a cell of 0.9 um take 4e-4 of its area.
    let thin = at(1e-4);
    let off = distance(&all(&plain), &all(&thin));
    assert!(off < 1e-3, "{off:.1e}");
    assert!(2 * plain.functions.unwrap() < thin.functions.unwrap());
    assert!(plain.residual < 1e-9);
}
