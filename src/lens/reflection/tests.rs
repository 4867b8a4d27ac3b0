//! Against closed forms: Fresnel's angles, a plate's orders, a thin lens's ghost.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use glam::DVec3;

use super::*;
use crate::lens::prescription::{PrescribedSurface, Prescription, Stated, Verification};
use crate::lens::{Glass, OpticalSystem};
use crate::rays::Ray;
use crate::units::D_LINE_NM;

const N: f64 = 1.6;

/// Two surfaces of curvatures `c` and glass between them, `t_mm` thick, in front of a sensor `behind_mm` away.
fn element(c: [f64; 2], t_mm: f64, behind_mm: f64) -> OpticalSystem {
    let surface = |curvature, thickness_mm, glass, is_stop| PrescribedSurface {
        curvature,
        thickness_mm,
        glass,
        conic: 0.0,
        aspheric: Default::default(),
        semi_aperture_mm: 5.0,
        reflectance: None,
        is_stop,
        label: String::new(),
    };
    let prescription = Prescription {
        file: "element".into(),
        name: String::new(),
        source: String::new(),
        notes: String::new(),
        surfaces: vec![
            surface(c[0], t_mm, Some(Glass::Constant { n: N }), true),
            surface(c[1], behind_mm, None, false),
        ],
        wavelengths_nm: vec![D_LINE_NM],
        fold: None,
        stated: Stated::default(),
        verification: Verification::default(),
        warnings: Vec::new(),
    };
    OpticalSystem {
        surfaces: (0..2)
            .map(|i| prescription.surface_at(i, i as f64 * t_mm, D_LINE_NM))
            .collect(),
        stop: 0,
        sensor_z_mm: t_mm + behind_mm,
        wavelength_nm: D_LINE_NM,
    }
}

fn reflections(coating: Option<f64>, sensor: f64) -> Reflections {
    Reflections {
        surfaces: vec![coating; 2],
        sensor,
    }
}

fn parallel(x_mm: f64) -> Ray {
    Ray {
        origin_mm: DVec3::new(x_mm, 0.0, -10.0),
        direction: DVec3::Z,
    }
}

#[test]
fn fresnel_is_square_on_at_brewsters_angle_and_total_beyond_the_critical_one() {
    assert!((fresnel(1.0, 1.0, N) - (0.6f64 / 2.6).powi(2)).abs() < 1e-15);
    // At Brewster's angle p is let through: half of s is left, with r_s = cos 2θ.
    let brewster = N.atan();
    let expected = 0.5 * (2.0 * brewster).cos().powi(2);
    assert!((fresnel(brewster.cos(), 1.0, N) - expected).abs() < 1e-15);
    let critical = (1.0 / N).asin();
    assert!(fresnel((critical - 1e-3).cos(), N, 1.0) < 1.0);
    assert_eq!(fresnel((critical + 1e-3).cos(), N, 1.0), 1.0);
    // The same from both sides.
    let inside = (0.5f64.sin() / N).asin();
    let (there, back) = (fresnel(0.5f64.cos(), 1.0, N), fresnel(inside.cos(), N, 1.0));
    assert!((there - back).abs() < 1e-15);
}

#[test]
fn a_plates_orders_are_a_geometric_series_and_no_more_than_all_light() {
    let plate = element([0.0; 2], 2.0, 10.0);
    for (coating, r) in [(None, (0.6f64 / 2.6).powi(2)), (Some(0.2), 0.2)] {
        let reflections = reflections(coating, 0.0);
        let pairs = reflections.pairs(&plate);
        assert_eq!(pairs, [GhostPair { front: 0, back: 1 }]);
        let direct = reflections.trace_direct(&plate, parallel(1.0)).unwrap();
        let ghost = reflections
            .trace_pair(&plate, pairs[0], parallel(1.0))
            .unwrap();
        assert!((direct.share - (1.0 - r).powi(2)).abs() < 1e-14);
        assert!((ghost.share - (1.0 - r).powi(2) * r * r).abs() < 1e-14);
        assert!((direct.share - reflections.transmission_on_axis(&plate)).abs() < 1e-14);
        assert!((ghost.ray.origin_mm.x - 1.0).abs() < 1e-12);
        // Transmitted in all orders: (1 − R)/(1 + R). Left out: what is reflected four times and more.
        let all = (1.0 - r) / (1.0 + r);
        let missing = all - direct.share - ghost.share;
        let rest = (1.0 - r).powi(2) * r.powi(4) / (1.0 - r * r);
        assert!((missing - rest).abs() < 1e-14, "{missing} {rest}");
        // With what goes back, all the light: R + (1 − R)² R/(1 − R²).
        let reflected = r + (1.0 - r).powi(2) * r / (1.0 - r * r);
        assert!((all + reflected - 1.0).abs() < 1e-14);
    }
}

#[test]
fn a_slanted_ray_is_displaced_by_a_plate_and_its_ghost_thrice() {
    let (t, plate) = (2.0, element([0.0; 2], 2.0, 10.0));
    let angle = 0.4f64;
    let inside = (angle.sin() / N).asin();
    let ray = Ray {
        origin_mm: DVec3::new(-1.0, 0.0, 0.0),
        direction: DVec3::new(angle.sin(), 0.0, angle.cos()),
    };
    let reflections = reflections(None, 0.0);
    let pair = GhostPair { front: 0, back: 1 };
    let direct = reflections.trace_direct(&plate, ray).unwrap();
    let ghost = reflections.trace_pair(&plate, pair, ray).unwrap();
    let at = |passes: f64| -1.0 + passes * t * inside.tan() + 10.0 * angle.tan();
    assert!((direct.ray.origin_mm.x - at(1.0)).abs() < 1e-12);
    assert!((ghost.ray.origin_mm.x - at(3.0)).abs() < 1e-12);
    assert!((ghost.ray.direction - ray.direction).length() < 1e-14);
}

/// Two reflections in a thin lens: 1/f_g = (3n − 1)/(n − 1) · 1/f.
#[test]
fn a_thin_lens_has_its_ghost_focus_where_paraxial_optics_says() {
    let (c, sensor_mm) = ([0.004, -0.002], 20.0);
    let thin = element(c, 1e-6, sensor_mm);
    let power = (N - 1.0) * (c[0] - c[1]);
    let ghost_power = (3.0 * N - 1.0) / (N - 1.0) * power;
    let ghost = (reflections(None, 0.0))
        .trace_pair(&thin, GhostPair { front: 0, back: 1 }, parallel(0.01))
        .unwrap();
    // Size of the ghost of a bundle of half-width y on the sensor: y (1 − s/f_g).
    let expected = 0.01 * (1.0 - sensor_mm * ghost_power);
    let at = ghost.ray.origin_mm.x;
    assert!((at / expected - 1.0).abs() < 1e-5, "{at} {expected}");
}

/// Sensor and lens: light from the sensor comes back from a surface as from a mirror. Of a plate: as from behind it.
#[test]
fn the_sensors_reflection_comes_back_from_a_plate() {
    let plate = element([0.0; 2], 2.0, 10.0);
    let angle = 0.3f64;
    let ray = Ray {
        origin_mm: DVec3::new(-2.0, 0.0, 0.0),
        direction: DVec3::new(angle.sin(), 0.0, angle.cos()),
    };
    let reflections = reflections(None, 0.1);
    assert_eq!(reflections.pairs(&plate).len(), 3);
    let direct = reflections.trace_direct(&plate, ray).unwrap();
    let back = GhostPair { front: 1, back: 2 };
    let ghost = reflections.trace_pair(&plate, back, ray).unwrap();
    let shift = ghost.ray.origin_mm.x - direct.ray.origin_mm.x;
    assert!((shift - 2.0 * 10.0 * angle.tan()).abs() < 1e-12);
    let bare = fresnel(angle.cos(), 1.0, N);
    assert!((ghost.share / direct.share - 0.1 * bare).abs() < 1e-14);
}

/// A lens of two plates and a sensor: its pairs are the same traced together as one by one, with some left out.
#[test]
fn pairs_traced_together_are_those_traced_alone() {
    let mut plates = element([0.05, -0.03], 2.0, 10.0);
    let mut others = element([-0.02, 0.04], 1.5, 10.0).surfaces;
    for surface in &mut others {
        surface.pose.vertex_mm.z += 4.0;
    }
    // What is reflected far out is clipped by the third.
    others[0].aperture.semi_mm = 2.5;
    plates.surfaces.extend(others);
    plates.sensor_z_mm = 15.0;
    let reflections = Reflections {
        surfaces: vec![None; 4],
        sensor: 0.1,
    };
    let pairs = GhostPairs::new(&reflections, &plates);
    assert_eq!(pairs.len(), 10);
    let (mut landed, mut lost) = (0, 0);
    for x in [0.0, 0.7, 1.9, 2.6, 4.9] {
        for wanted in [|_| true, |number| number % 3 == 1] {
            let together = reflections.trace_pairs(&plates, &pairs, parallel(x), wanted);
            for (number, together) in together.into_iter().enumerate() {
                let alone = reflections.trace_pair(&plates, pairs[number], parallel(x));
                assert_eq!(together, alone.filter(|_| wanted(number)), "{x} {number}");
                landed += usize::from(together.is_some());
                lost += usize::from(alone.is_none());
            }
        }
    }
    assert!(landed > 20 && lost > 10, "{landed} {lost}");
}
