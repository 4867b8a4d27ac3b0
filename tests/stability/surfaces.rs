//! Single surfaces at the ends of what a ray can meet.

use glam::DVec3;
use quadpixel::lens::{
    Clipping, OpticalSurface, OpticalSystem, PacketTracer, Travel, builtin_names, trace_visiting,
};
use quadpixel::rays::{Ray, RayBatch, RayFailure};
use quadpixel::simd::SimdLevel;

use crate::support::{asphere, conic, stop, system, tilted};
use crate::{builtin, free};

/// Every surface of every lens of the library, alone at the origin.
pub fn library_surfaces() -> Vec<(String, OpticalSurface)> {
    let mut all = Vec::new();
    for name in builtin_names() {
        for (i, mut surface) in builtin(name)
            .at(550.0)
            .unwrap()
            .surfaces
            .into_iter()
            .enumerate()
        {
            surface.pose.vertex_mm = DVec3::ZERO;
            all.push((format!("{name}[{i}]"), surface));
        }
    }
    all
}

fn in_packet(system: &OpticalSystem, ray: Ray, travel: Travel) -> Result<Ray, RayFailure> {
    let mut batch = RayBatch::default();
    batch.push(ray.origin_mm, ray.direction);
    let tracer = PacketTracer::new(system);
    match travel {
        Travel::Forward => tracer.trace_forward(&mut batch, SimdLevel::detect()),
        Travel::Backward => tracer.trace_backward(&mut batch, SimdLevel::detect()),
    }
    batch.get(0)
}

/// From the vertex to the rim, at incidences from normal over critical to grazing, in both senses and in and across the
/// meridian: a ray obeys Snell's law as a vector to 1e-11 and keeps its length to 1e-12, or is totally reflected beyond
/// the critical angle. Every ray comes through a point of the surface, so none is missed. Both tracers say the same.
#[test]
fn grazing_incidence_and_total_reflection_at_every_surface() {
    let (mut passed, mut reflected) = (0, 0);
    for (name, surface) in library_surfaces() {
        let one = system(vec![surface.clone()], 0.0);
        let indices = (surface.index_before, surface.index_after);
        // Between equal indices there is none; 1.2 then.
        let critical = (indices.0.min(indices.1) / indices.0.max(indices.1))
            .asin()
            .min(1.2);
        for part in [0.0, 0.5, 0.999] {
            let x = part * surface.aperture.semi_mm.min(10.0);
            let at = DVec3::new(x, 0.0, surface.sag_mm(x * x).unwrap());
            let normal = surface.normal(at.truncate()).unwrap();
            for across in [DVec3::Y, normal.cross(DVec3::Y)] {
                for incidence in [0.0, 0.3, critical - 1e-6, critical + 1e-6, 1.4, 1.5706] {
                    for (travel, sense) in [(Travel::Forward, 1.0), (Travel::Backward, -1.0)] {
                        let direction = (normal * (incidence.cos() * sense)
                            + across * incidence.sin())
                        .normalize();
                        let ray = Ray {
                            origin_mm: at - direction,
                            direction,
                        };
                        let mut met = None;
                        let end =
                            trace_visiting(&one, ray, travel, Clipping::Off, |_, p| met = Some(p));
                        let packet = in_packet(&one, ray, travel);
                        let (n, n2) = match travel {
                            Travel::Forward => indices,
                            Travel::Backward => (indices.1, indices.0),
                        };
                        match (end, met) {
                            (Ok(end), Some(met)) => {
                                passed += 1;
                                let m = surface.normal(met.truncate()).unwrap();
                                let along = n * direction.cross(m) - n2 * end.direction.cross(m);
                                assert!(
                                    along.length() < 1e-11,
                                    "{name} {part} {incidence}: {along}"
                                );
                                assert!((end.direction.length() - 1.0).abs() < 1e-12, "{name}");
                                // At grazing incidence the place is as uncertain as the root of rounding.
                                if travel == Travel::Backward && incidence < 1.5 {
                                    let twin = packet.unwrap();
                                    assert!(
                                        (twin.origin_mm - end.origin_mm).length() < 1e-9,
                                        "{name}"
                                    );
                                    assert!(
                                        (twin.direction - end.direction).length() < 1e-9,
                                        "{name}"
                                    );
                                }
                            }
                            (Err(RayFailure::TotalInternalReflection { .. }), Some(met)) => {
                                reflected += 1;
                                let m = surface.normal(met.truncate()).unwrap();
                                let sine = n * direction.cross(m).length();
                                assert!(sine > n2 * (1.0 - 1e-12), "{name}: {sine} against {n2}");
                                let reason = packet.unwrap_err();
                                assert!(matches!(
                                    reason,
                                    RayFailure::TotalInternalReflection { .. }
                                ));
                            }
                            other => panic!("{name} {part} {incidence}: {other:?}"),
                        }
                    }
                }
            }
        }
    }
    assert!(passed > 1000 && reflected > 500, "{passed} {reflected}");
}

/// Rays at 0.999 and 1.001 of each asphere's rim: the point lies on the surface to 1e-12 mm and on the ray to 1e-12 mm.
#[test]
fn strong_aspheres_at_the_rim() {
    let aspheres = library_surfaces()
        .into_iter()
        .filter(|(_, s)| s.aspheric_terms > 0);
    let mut met = 0;
    for (name, surface) in aspheres {
        for part in [0.999, 1.001] {
            for slope in [0.0, 0.2, -0.2] {
                let x = part * surface.aperture.semi_mm;
                let Some(sag) = surface.sag_mm(x * x) else {
                    continue;
                };
                let at = DVec3::new(0.6 * x, 0.8 * x, sag);
                let direction = DVec3::new(slope, -slope, 1.0).normalize();
                let h = surface.slope_over_radius(x * x).unwrap();
                // Only where the ray crosses in the sense of the light.
                if direction.z - h * (at.x * direction.x + at.y * direction.y) < 0.05 {
                    continue;
                }
                let ray = Ray {
                    origin_mm: at - 5.0 * direction,
                    direction,
                };
                let Some(p) = surface.intersect(ray, Travel::Forward) else {
                    panic!("{name}: a ray through {at} is said to miss");
                };
                let r2 = p.x * p.x + p.y * p.y;
                assert!(
                    (p.z - surface.sag_mm(r2).unwrap()).abs() < 1e-12,
                    "{name} {p}"
                );
                assert!(
                    (p - ray.origin_mm).cross(direction).length() < 1e-12,
                    "{name}"
                );
                met += 1;
            }
        }
    }
    assert!(met > 200, "{met}");
}

/// z = r²/(R(1 + √(1 − r²/R²))) to 1e-13 mm and the deflection (1 − 1/n)·r/R to 1e-15, also from 100 m away.
#[test]
fn a_radius_of_1e6_mm_is_a_plane_but_for_its_sag() {
    for radius in [1e6, -1e6] {
        let one = system(vec![conic(0.0, 1.0 / radius, 0.0, (1.0, 1.5))], 0.0);
        for (r, far) in [(1e-3, 1.0), (5.0, 10.0), (20.0, 1e5)] {
            let ray = Ray {
                origin_mm: DVec3::new(r, 0.0, -far),
                direction: DVec3::Z,
            };
            let p = one.surfaces[0].intersect(ray, Travel::Forward).unwrap();
            let ratio: f64 = r / radius;
            let sag = r * ratio / (1.0 + (1.0 - ratio * ratio).sqrt());
            assert!(
                (p.z - sag).abs() < 1e-13 && (p.x - r).abs() < 1e-13,
                "{radius} {r}: {p}"
            );
            let bent = free(&one, ray, Travel::Forward).unwrap().direction.x;
            assert!(
                (bent + ratio * (1.0 - 1.0 / 1.5)).abs() < 1e-15,
                "{radius} {r}: {bent}"
            );
        }
    }
}

/// A ray along the axis stays on it exactly, in every lens at every wavelength; one through a pole meets exactly the
/// vertex; one that runs in a plane never crosses it, one 1e-9 rad off it does.
#[test]
fn rays_along_the_axis_through_a_pole_and_in_a_plane() {
    for name in builtin_names() {
        for nm in [350.0, 550.0, 1100.0] {
            let lens = builtin(name).at(nm).unwrap();
            let ray = Ray {
                origin_mm: DVec3::new(0.0, 0.0, -1000.0),
                direction: DVec3::Z,
            };
            let end = free(&lens, ray, Travel::Forward).unwrap();
            assert_eq!((end.origin_mm.x, end.origin_mm.y), (0.0, 0.0), "{name}");
            assert_eq!(end.direction, DVec3::Z, "{name}");
        }
    }
    for curvature in [0.0, 0.7, -0.7] {
        let surface = asphere(conic(0.0, curvature, -1.0, (1.0, 1.5)), &[0.0, 0.02]);
        for slope in [0.0, 0.5, 3.0] {
            let direction = DVec3::new(slope, -slope, 1.0).normalize();
            let ray = Ray {
                origin_mm: -7.0 * direction,
                direction,
            };
            let p = surface.intersect(ray, Travel::Forward).unwrap();
            assert!(p.length() < 1e-15, "{p}");
        }
    }
    let plane = system(vec![stop(0.0, f64::INFINITY)], 1.0);
    let along = |z: f64| Ray {
        origin_mm: DVec3::new(0.0, 0.1, -1e-3),
        direction: DVec3::new(1.0, 0.0, z).normalize(),
    };
    assert_eq!(
        free(&plane, along(0.0), Travel::Forward),
        Err(RayFailure::Missed { surface: 0 })
    );
    let end = free(&plane, along(1e-9), Travel::Forward).unwrap();
    assert!(
        (end.origin_mm.x / 1e9 - (1.0 + 1e-3)).abs() < 1e-6,
        "{end:?}"
    );
}

/// Surfaces and ray turned together by 10° about the stop: the same picture turned, to 1e-12 mm.
#[test]
fn a_lens_tilted_with_its_rays_is_the_same_lens() {
    let (tip, tilt) = (10f64.to_radians(), -7f64.to_radians());
    let turned = tilted(conic(0.0, 0.0, 0.0, (1.0, 1.0)), tip, tilt);
    let turn = turned.pose.rotation.unwrap();
    let mut compared = 0;
    for name in builtin_names() {
        let straight = builtin(name).at(550.0).unwrap();
        let mut leaning = straight.clone();
        for s in &mut leaning.surfaces {
            s.pose.vertex_mm = turn * s.pose.vertex_mm;
            s.pose.rotation = Some(turn);
        }
        let semi = straight.surfaces[0].aperture.semi_mm.min(10.0);
        for part in [0.0, 0.2, 0.4] {
            let ray = Ray {
                origin_mm: DVec3::new(part * semi, 0.3 * part * semi, -5.0),
                direction: DVec3::new(-0.01, 0.02, 1.0).normalize(),
            };
            let also = Ray {
                origin_mm: turn * ray.origin_mm,
                direction: turn * ray.direction,
            };
            // Up to the last surface: the sensor stays where it is.
            let last = |system: &OpticalSystem, ray: Ray| {
                let mut p = DVec3::ZERO;
                let end = trace_visiting(system, ray, Travel::Forward, Clipping::Off, |_, q| p = q);
                end.map(|end| (p, end.direction))
            };
            match (last(&straight, ray), last(&leaning, also)) {
                (Ok(a), Ok(b)) => {
                    compared += 1;
                    assert!((a.0 - b.0).length() < 1e-12, "{name}: {} {}", a.0, b.0);
                    assert!((turn * a.1 - b.1).length() < 1e-12, "{name}");
                }
                (a, b) => assert_eq!(a.unwrap_err(), b.unwrap_err(), "{name}"),
            }
        }
    }
    assert!(compared > 40, "{compared}");
}
