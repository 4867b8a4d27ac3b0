//! Surfaces and lenses whose rays are known in closed form.

use glam::DVec3;
use quadpixel::lens::{Clipping, Travel, trace_backward, trace_forward, trace_visiting};
use quadpixel::rays::{Ray, RayFailure};

use crate::support::{asphere, conic, stop, system, tilted};

fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    Ray {
        origin_mm: DVec3::from(origin),
        direction: DVec3::from(direction).normalize(),
    }
}

fn free(system: &quadpixel::lens::OpticalSystem, ray: Ray) -> Result<Ray, RayFailure> {
    trace_visiting(system, ray, Travel::Forward, Clipping::Off, |_, _| {})
}

#[test]
fn ray_meets_a_sphere_where_the_quadratic_says_on_the_vertex_side() {
    for radius in [3.0, -3.0, 80.0, -0.9] {
        let surface = conic(0.0, 1.0 / radius, 0.0, (1.0, 1.5));
        for (x, y, dx, dy) in [
            (0.2, 0.1, 0.3, -0.2),
            (0.5, -0.6, 0.0, 0.0),
            (-0.4, 0.3, 0.5, 0.4),
        ] {
            for travel in [Travel::Forward, Travel::Backward] {
                let sign = if travel == Travel::Forward { 1.0 } else { -1.0 };
                let aim = ray([x, y, 0.0], [dx, dy, sign]);
                let far = Ray {
                    origin_mm: aim.origin_mm - aim.direction * 40.0,
                    ..aim
                };
                let p = surface.intersect(far, travel).unwrap();
                // |p − centre| = |radius|, on the hemisphere of the vertex, and on the ray.
                assert!(
                    ((p - DVec3::new(0.0, 0.0, radius)).length() - radius.abs()).abs()
                        < 1e-13 * (1.0 + radius.abs())
                );
                assert!(p.z.abs() < radius.abs());
                assert!((p - far.origin_mm).cross(far.direction).length() < 1e-13);
            }
        }
    }
}

#[test]
fn sphere_written_as_asphere_gives_the_same_point() {
    // z = r²/2R + Σ …: the binomial series of the sphere, as pure polynomial, against the conic. At r ≤ 0.2 R the
    // terms after r²⁰ are below 1e-17.
    let radius: f64 = 5.0;
    let mut terms = [0.0; 10];
    let mut binomial = 0.5;
    for (i, a) in terms.iter_mut().enumerate() {
        let n = i as f64 + 1.0;
        *a = binomial * radius.powi(1 - 2 * (i as i32 + 1));
        binomial *= (n - 0.5) / (n + 1.0);
    }
    let series = asphere(conic(0.0, 0.0, 0.0, (1.0, 1.5)), &terms);
    let sphere = conic(0.0, 1.0 / radius, 0.0, (1.0, 1.5));
    for (x, dx) in [(0.0, 0.1), (0.6, -0.3), (0.9, 0.05)] {
        let r = ray([x, 0.2, -1.0], [dx, 0.1, 1.0]);
        let (a, b) = (
            series.intersect(r, Travel::Forward).unwrap(),
            sphere.intersect(r, Travel::Forward).unwrap(),
        );
        assert!((a - b).length() < 1e-12, "{a} {b}");
        assert!(
            (series.normal(a.truncate()).unwrap() - sphere.normal(b.truncate()).unwrap()).length()
                < 1e-11
        );
    }
}

#[test]
fn ellipsoid_focuses_collimated_light_to_a_point() {
    // Air to glass at an ellipsoid with k = −1/n²: a perfect focus at n R / (n − 1) (Cartesian oval).
    let (n, radius) = (1.6, 4.0);
    let lens = system(
        vec![conic(0.0, 1.0 / radius, -1.0 / (n * n), (1.0, n))],
        n * radius / (n - 1.0),
    );
    for (x, y) in [(0.0, 0.5), (1.5, 0.0), (-1.8, 1.6), (0.1, -2.9)] {
        let end = free(&lens, ray([x, y, -20.0], [0.0, 0.0, 1.0])).unwrap();
        assert!(end.origin_mm.truncate().length() < 1e-12, "{end:?}");
    }
}

#[test]
fn plano_hyperboloid_focuses_collimated_light_to_a_point() {
    // Glass to air at a hyperboloid with k = −n²: focus |R| / (n − 1) behind the vertex.
    let (n, radius) = (1.5, -4.0);
    let lens = system(
        vec![
            conic(0.0, 0.0, 0.0, (1.0, n)),
            conic(2.0, 1.0 / radius, -n * n, (n, 1.0)),
        ],
        2.0 - radius / (n - 1.0),
    );
    for (x, y) in [(0.0, 0.5), (1.5, 0.0), (-1.8, 1.6), (0.1, -2.9)] {
        let end = free(&lens, ray([x, y, -20.0], [0.0, 0.0, 1.0])).unwrap();
        assert!(end.origin_mm.truncate().length() < 1e-12, "{end:?}");
    }
}

#[test]
fn aplanatic_points_of_a_sphere_image_without_aberration() {
    // Inside a ball of index n: the point at R/n from the centre is imaged on the one at n R (virtual).
    let (n, radius): (f64, f64) = (1.5, 2.0);
    // Light leaves the ball on its right: centre of curvature at −R from the vertex.
    let lens = system(vec![conic(0.0, -1.0 / radius, 0.0, (n, 1.0))], 5.0);
    let inside = DVec3::new(0.0, 0.0, -radius - radius / n);
    let image = DVec3::new(0.0, 0.0, -radius - n * radius);
    for slope in [0.0, 0.1, 0.4, 0.55] {
        let end = free(
            &lens,
            Ray {
                origin_mm: inside,
                direction: DVec3::new(slope, 0.3 * slope, 1.0).normalize(),
            },
        )
        .unwrap();
        assert!(
            (end.origin_mm - image).cross(end.direction).length() < 1e-13,
            "{end:?}"
        );
    }
}

#[test]
fn snell_holds_at_an_oblique_plane() {
    let tip: f64 = 0.4;
    let lens = system(
        vec![tilted(conic(1.0, 0.0, 0.0, (1.2, 1.7)), tip, 0.0)],
        3.0,
    );
    let normal = DVec3::new(0.0, -tip.sin(), tip.cos());
    let start = ray([0.1, 0.2, -1.0], [0.2, -0.1, 1.0]);
    let end = free(&lens, start).unwrap();
    // n sin θ along the surface is kept, as a vector, and the length stays one.
    assert!(
        (1.2 * start.direction.cross(normal) - 1.7 * end.direction.cross(normal)).length() < 1e-15
    );
    assert!((end.direction.length() - 1.0).abs() < 1e-15);
}

#[test]
fn tilted_plate_shifts_the_ray_and_keeps_its_direction() {
    // Shift of a plate of thickness t at incidence θ: t sin θ (1 − cos θ / √(n² − sin² θ)).
    let (n, t, theta): (f64, f64, f64) = (1.517, 0.8, 0.5);
    let first = tilted(conic(0.0, 0.0, 0.0, (1.0, n)), 0.0, theta);
    let mut second = tilted(conic(0.0, 0.0, 0.0, (n, 1.0)), 0.0, theta);
    second.pose.vertex_mm = second.pose.rotation.unwrap() * DVec3::new(0.0, 0.0, t);
    let end = free(
        &system(vec![first, second], 5.0),
        ray([0.0, 0.0, -3.0], [0.0, 0.0, 1.0]),
    )
    .unwrap();
    let shift = t * theta.sin() * (1.0 - theta.cos() / (n * n - theta.sin().powi(2)).sqrt());
    assert!((end.direction - DVec3::Z).length() < 1e-15);
    assert!((end.origin_mm.truncate().length() - shift).abs() < 1e-14);
}

#[test]
fn backward_trace_retraces_the_forward_ray() {
    let mut decentred = tilted(
        asphere(
            conic(0.9, -0.4, -2.0, (1.6, 1.0)),
            &[0.0, 0.03, -0.01, 0.002],
        ),
        0.02,
        -0.03,
    );
    decentred.pose.vertex_mm.x = 0.05;
    let lens = system(
        vec![
            stop(0.2, 1.2),
            asphere(conic(0.0, 0.5, -0.5, (1.0, 1.6)), &[0.0, 0.02, 0.01]),
            decentred,
        ],
        4.0,
    );
    for (x, y, dx, dy) in [
        (0.0, 0.0, 0.0, 0.0),
        (0.5, 0.3, 0.2, -0.3),
        (-0.7, 0.4, 0.4, 0.1),
    ] {
        let start = ray([x, y, -1.0], [dx, dy, 1.0]);
        let end = trace_forward(&lens, start).unwrap();
        let back = trace_backward(
            &lens,
            Ray {
                direction: -end.direction,
                ..end
            },
        )
        .unwrap();
        assert!((back.direction + start.direction).length() < 1e-10);
        assert!(
            (back.origin_mm - start.origin_mm)
                .cross(start.direction)
                .length()
                < 1e-10
        );
        // It ends on surface 0, the stop at z = 0.2.
        assert!((back.origin_mm.z - 0.2).abs() < 1e-15 && back.direction.z < 0.0);
    }
}

#[test]
fn lost_rays_say_where_and_why() {
    let ball = system(vec![stop(-1.0, 0.7), conic(0.0, 1.0, 0.0, (1.0, 1.5))], 3.0);
    let along = |x: f64| ray([x, 0.0, -5.0], [0.0, 0.0, 1.0]);
    assert!(trace_forward(&ball, along(0.69)).is_ok());
    assert_eq!(
        trace_forward(&ball, along(0.71)),
        Err(RayFailure::Vignetted { surface: 0 })
    );
    assert_eq!(
        free(&ball, along(1.01)),
        Err(RayFailure::Missed { surface: 1 })
    );
    // Grazing the ball at its equator, just inside.
    assert!(free(&ball, along(0.999_999)).is_ok());
    // Glass to air at a plane beyond the critical angle asin(1/1.5) = 41.81°.
    let exit = system(vec![conic(0.0, 0.0, 0.0, (1.5, 1.0))], 1.0);
    let at = |deg: f64| {
        ray(
            [0.0; 3],
            [deg.to_radians().sin(), 0.0, deg.to_radians().cos()],
        )
    };
    assert!(trace_forward(&exit, at(41.80)).is_ok());
    assert_eq!(
        trace_forward(&exit, at(41.82)),
        Err(RayFailure::TotalInternalReflection { surface: 0 })
    );
    // A ray that runs along the plane never crosses it.
    assert_eq!(
        trace_forward(&exit, ray([0.0, 0.0, -1.0], [1.0, 0.0, 0.0])),
        Err(RayFailure::Missed { surface: 0 })
    );
}

#[test]
fn clipping_can_be_limited_to_the_stop() {
    let mut narrow = conic(0.0, 0.1, 0.0, (1.0, 1.5));
    narrow.aperture.semi_mm = 0.5;
    let lens = system(vec![narrow, stop(1.0, 0.8)], 10.0);
    let trace = |x: f64, clipping| {
        trace_visiting(
            &lens,
            ray([x, 0.0, -5.0], [0.0, 0.0, 1.0]),
            Travel::Forward,
            clipping,
            |_, _| {},
        )
    };
    assert_eq!(
        trace(0.7, Clipping::All),
        Err(RayFailure::Vignetted { surface: 0 })
    );
    assert!(trace(0.7, Clipping::StopOnly).is_ok());
    assert_eq!(
        trace(0.9, Clipping::StopOnly),
        Err(RayFailure::Vignetted { surface: 1 })
    );
    assert!(trace(0.9, Clipping::Off).is_ok());
}
