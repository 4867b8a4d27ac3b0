//! The pixel's response where lookups end: straight on, at the table's last direction and beyond, and for chief rays
//! that no shift was found for.

use quadpixel::response::{ChiefRayShifts, GeometricResponse, Response, ResponseLookup};
use quadpixel::sensor::Subpixels;

use super::shots::wave_pixel;

fn read(lookup: &ResponseLookup, u: f32, v: f32) -> Vec<f32> {
    let mut p = vec![-1.0; lookup.subpixels().count()];
    lookup.weights(u, v, &mut p);
    p
}

/// Straight on, the four sub-pixels of a table share alike to 1e-5, continuously (1e-7 beside it differs by under
/// 1e-5). At and beyond its last direction the edge is read: 0 ≤ P, Σ P ≤ 1, up to infinite cosines.
#[test]
fn a_table_straight_on_at_its_end_and_beyond() {
    let lookup = wave_pixel().at(550.0);
    let middle = read(&lookup, 0.0, 0.0);
    for near in [[0.0f32, 1e-7], [-1e-7, 1e-7], [f32::MIN_POSITIVE, -0.0]] {
        for (a, b) in read(&lookup, near[0], near[1]).iter().zip(&middle) {
            assert!(
                (a - b).abs() < 1e-5 && (a - middle[0]).abs() < 1e-5,
                "{near:?}"
            );
        }
    }
    let edge = read(&lookup, 0.6, 0.0);
    for far in [0.6f32, 0.600_001, 1.0, 7.0, f32::MAX, f32::INFINITY] {
        assert_eq!(read(&lookup, far, 0.0), edge, "{far}");
        for (u, v) in [(far, far), (-far, 0.1), (0.1, -far)] {
            let p = read(&lookup, u, v);
            let sum: f32 = p.iter().sum();
            assert!(
                p.iter().all(|&p| p >= 0.0) && sum <= 1.0 + 1e-5,
                "{u} {v}: {p:?}"
            );
        }
    }
}

/// Straight on, and along every border between boxes, the ideal pixel gives all light to one sub-pixel and loses none.
#[test]
fn the_ideal_pixel_neither_loses_nor_doubles_light_at_its_borders() {
    for subpixels in Subpixels::SIMULATED {
        let ideal = GeometricResponse::new(subpixels, 2.0, 3.0).unwrap();
        let lookup = Response::Geometric(ideal).at(550.0);
        for (u, v) in [(0.0, 0.0), (-0.0, 0.0), (0.0, 0.1), (0.1, -0.0), (0.1, 0.1)] {
            let p = read(&lookup, u, v);
            assert_eq!(p.iter().sum::<f32>(), 1.0, "{subpixels} {u} {v}: {p:?}");
        }
        for (u, v) in [(1.0, 0.0), (0.0, -1.0), (0.8, 0.8), (f32::INFINITY, 0.0)] {
            let p = read(&lookup, u, v);
            assert!(p.iter().all(|p| *p == 0.0 || *p == 1.0), "{u} {v}: {p:?}");
        }
    }
}

/// A chief ray beyond the last θ gets that one's shift, and says so; shifts and looked-up directions stay finite up to
/// grazing.
#[test]
fn chief_rays_beyond_the_last_node() {
    let found = ChiefRayShifts {
        cone_f_number: 2.0,
        theta_deg: vec![10.0, 20.0],
        phi_deg: vec![0.0, 45.0],
        shift_um: vec![[-0.3, 0.0], [-0.31, 0.0], [-0.6, 0.0], [-0.62, 0.0]],
    };
    found.check(Subpixels::QUAD).unwrap();
    let last = 20f64.to_radians().sin();
    for phi in [0.0, 0.3, 1.0, -2.0, 3.1] {
        let at = |sine: f64| found.at(sine * f64::cos(phi), sine * f64::sin(phi));
        let end = at(last * (1.0 - 1e-9));
        assert!(!end.clamped);
        for beyond in [last * 1.001, 0.9, 1.0] {
            let far = at(beyond);
            let off = (far.shift_um[0] - end.shift_um[0]).hypot(far.shift_um[1] - end.shift_um[1]);
            assert!(far.clamped && off < 1e-6, "{phi} {beyond}: {far:?}");
        }
    }
    let tiny = found.at(1e-300, 0.0);
    assert!(tiny.shift_um.iter().all(|s| s.abs() < 1e-250), "{tiny:?}");
    let ideal = GeometricResponse::new(Subpixels::QUAD, 2.0, 3.0).unwrap();
    for frame in [ideal.frame(), wave_pixel().at(550.0).frame()] {
        for sine in [0.0, 0.5, 0.999_999, 1.0] {
            let shift = frame.shift_for_chief_ray(sine, 0.0);
            let (u, v) = frame.centred_uv(sine as f32, 0.0, shift);
            assert!(shift.iter().all(|s| s.is_finite()) && u.is_finite() && v.is_finite());
            // The chief ray is read in the middle, but for the rounding of u² in f32, which the slope u/√(n² − u²)
            // multiplies.
            let left = frame.index * frame.index - sine * sine;
            let bound = (2e-7 / left.max(1e-6).powf(1.5)).min(1.0) as f32 + 1e-6;
            assert!(u.abs() < bound && v.abs() < bound, "{sine}: {u} {v}");
        }
    }
}
