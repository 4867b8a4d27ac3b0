#![allow(clippy::unwrap_used)] // because tests fail by panicking

use super::*;

const PITCH_UM: f64 = 2.0;

fn frame() -> MovingFrame {
    MovingFrame::new(1.5, 3.0).unwrap()
}

/// A pixel whose light lands exactly where the moving frame says, on soft-edged sub-pixels.
fn ideal(subpixels: Subpixels, cone_f_number: f64) -> ChiefRayShifts {
    let shares = |[u, v]: [f64; 2], shifts: &[[f64; 2]]| {
        let one = |s: &[f64; 2]| {
            let chief = frame().shift_for_chief_ray(u, v);
            let (x, y) = (s[0] - chief[0], s[1] - chief[1]);
            let side = |x: f64| 1.0 / (1.0 + (-6.0 * x).exp());
            let part = |i: usize| {
                let (cx, cy) = subpixels.centre(i);
                side(x * cx.signum()).powi((cx != 0.0).into())
                    * side(y * cy.signum()).powi((cy != 0.0).into())
            };
            (0..subpixels.count()).map(part).collect()
        };
        Ok(shifts.iter().map(one).collect())
    };
    let balance = Balance {
        subpixels,
        frame: frame(),
        pitch_um: PITCH_UM,
        cone_f_number,
        shares: &shares,
    };
    ChiefRayShifts::balanced(&balance, &[10.0, 20.0, 30.0], 3, &|_, _| ()).unwrap()
}

#[test]
fn a_narrow_cone_is_shared_where_its_chief_ray_lands_between_the_sub_pixels() {
    for subpixels in [Subpixels::QUAD, Subpixels::DUAL_X, Subpixels::DUAL_Y] {
        let map = ideal(subpixels, 32.0);
        // At a node, between nodes (the cubic through 10° steps of a function that is nearly linear in sin θ), and in
        // every octant.
        for (theta, bound) in [(20.0, 1e-3), (14.0, 4e-3), (27.0, 4e-3)] {
            for phi in [0.0, 10.0, 45.0, 100.0, 190.0, 291.0, -22.5] {
                let [u, v] = direction_cosines(theta, phi);
                let found = map.at(u, v);
                let wanted = frame().shift_for_chief_ray(u, v);
                let off = (found.shift_um[0] - wanted[0]).hypot(found.shift_um[1] - wanted[1]);
                assert!(off < bound * PITCH_UM, "{subpixels} {theta} {phi}: {off}");
                assert!(!found.clamped);
            }
        }
    }
}

#[test]
fn the_azimuth_has_no_wrap_and_the_field_no_kink_at_a_mirror_axis() {
    let map = ideal(Subpixels::QUAD, 2.0);
    let at = |theta: f64, phi: f64| {
        let [u, v] = direction_cosines(theta, phi);
        map.at(u, v).shift_um
    };
    let step = 1e-3;
    for phi in [0.0, 45.0, 90.0, 180.0, 225.0, 360.0] {
        let [a, b, c] = [-step, 0.0, step].map(|d| at(17.0, phi + d));
        for k in 0..2 {
            // A second difference of a smooth field is of the order of step² (in rad: 3e-10).
            assert!((a[k] - 2.0 * b[k] + c[k]).abs() < 1e-8, "{phi}");
        }
    }
    let (once, round) = (at(23.0, 33.0), at(23.0, 393.0));
    assert!((0..2).all(|k| (once[k] - round[k]).abs() < 1e-12));
}

#[test]
fn a_chief_ray_beyond_the_last_one_takes_its_shift_and_says_so() {
    let map = ideal(Subpixels::QUAD, 4.0);
    let [u, v] = direction_cosines(30.0, 12.0);
    let last = map.at(u, v);
    assert!(!last.clamped);
    let [u, v] = direction_cosines(48.0, 12.0);
    let beyond = map.at(u, v);
    assert!(beyond.clamped);
    assert!((0..2).all(|k| (beyond.shift_um[k] - last.shift_um[k]).abs() < 1e-12));
}

#[test]
fn a_telecentric_ray_needs_none_and_a_reversed_one_the_opposite() {
    let map = ideal(Subpixels::QUAD, 2.0);
    assert_eq!(map.at(0.0, 0.0).shift_um, [0.0, 0.0]);
    let (there, back) = (map.at(0.21, -0.13).shift_um, map.at(-0.21, 0.13).shift_um);
    assert!((0..2).all(|k| (there[k] + back[k]).abs() < 1e-12));
    assert!(there[0] < 0.0 && there[1] > 0.0);
}
