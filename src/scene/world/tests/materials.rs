//! Every material: reciprocity, energy, and its sampler against its own density and value.

use glam::{DVec3, Vec3A as Vec3};

use crate::rays::Ray;
use crate::sampling::{concentric_disk, uniform};
use crate::scene::world::bsdf::{Bsdf, Kind};
use crate::scene::world::sampler::SurfaceNumbers;
use crate::scene::world::surface::Footprint;
use crate::scene::world::walk::Walks;
use crate::scene::world::{Alpha, Material, TriangleMesh, World, WorldDescription};

/// A square of the material at z = 0, facing +z.
fn world_of(material: &Material) -> World {
    let mut description = WorldDescription {
        materials: vec![material.clone()],
        ..WorldDescription::default()
    };
    let square = TriangleMesh::rectangle(
        DVec3::new(-1.0, 1.0, 0.0),
        DVec3::new(2.0, 0.0, 0.0),
        DVec3::new(0.0, -2.0, 0.0),
        0,
    );
    description.add(square, 0);
    World::new(description).unwrap()
}

/// The material at the origin, seen from the direction `view`.
fn seen_from(world: &World, view: Vec3) -> Bsdf {
    let ray = Ray {
        origin_mm: DVec3::new(0.1, 0.2, 0.0) + view.as_dvec3(),
        direction: -view.as_dvec3(),
    };
    let element = world.closest(&ray, &mut Walks::default()).unwrap();
    let surface = world.surface(element, &ray);
    world.bsdf(&surface, &ray, &Footprint::POINT, Vec3::ONE)
}

fn direction(cos: f32, phi: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}

fn white_plastic(roughness: f32) -> Material {
    Material {
        roughness,
        ..Material::default()
    }
}

/// Materials that spread light.
fn spreading() -> Vec<(&'static str, Material)> {
    let tinted = Material {
        base_colour: [0.8, 0.3, 0.1],
        metallic: 0.4,
        roughness: 0.35,
        ..Material::default()
    };
    let veil = Material {
        alpha: Alpha::Blend { alpha: 0.6 },
        ..tinted.clone()
    };
    vec![
        ("diffuse", Material::diffuse([1.0, 0.5, 0.2])),
        ("plastic 0.2", white_plastic(0.2)),
        ("plastic 0.6", white_plastic(0.6)),
        ("plastic 1", white_plastic(1.0)),
        ("metal 0.15", Material::metal([1.0; 3], 0.15)),
        ("metal 0.5", Material::metal([0.9, 0.6, 0.2], 0.5)),
        ("metal 1", Material::metal([1.0; 3], 1.0)),
        ("mixture", tinted),
        ("veil", veil),
    ]
}

/// Materials with mirrors and refraction too.
fn all() -> Vec<(&'static str, Material)> {
    let pane = Material {
        thin_walled: true,
        ..Material::glass(1.5)
    };
    let half = Material {
        transmission: 0.5,
        ..white_plastic(0.0)
    };
    let mut list = spreading();
    list.extend([
        ("mirror", Material::metal([1.0; 3], 0.0)),
        ("smooth plastic", white_plastic(0.0)),
        ("glass", Material::glass(1.5)),
        ("pane", pane),
        ("half clear", half),
    ]);
    list
}

#[test]
fn each_material_is_reciprocal() {
    for (name, material) in spreading() {
        let world = world_of(&material);
        for k in 0..200 {
            let u = |d| uniform(1, &[k, d]) as f32;
            let (a, b) = (
                direction(0.05 + 0.95 * u(0), std::f32::consts::TAU * u(1)),
                direction(0.05 + 0.95 * u(2), std::f32::consts::TAU * u(3)),
            );
            let f = |o: Vec3, i: Vec3| seen_from(&world, o).value(i).0 / i.z;
            let (ab, ba) = (f(a, b), f(b, a));
            // f32: a narrow lobe's value has a relative error of 1e-6 times the steepness of D.
            let error = (ab - ba).abs().max_element() / ab.max_element().max(1e-3);
            assert!(error < 2e-3, "{name}: {ab} and {ba} between {a} and {b}");
        }
    }
}

fn numbers(choice: f32, scatter: [f32; 2]) -> SurfaceNumbers {
    let (x, y) = concentric_disk(f64::from(scatter[0]), f64::from(scatter[1]));
    SurfaceNumbers {
        choice,
        light_choice: 0.0,
        scatter,
        disk: [x as f32, y as f32],
        light: [0.0; 2],
    }
}

/// Light returned of even light from everywhere, seen under `cos`: mean and standard error.
fn returned(world: &World, cos: f32, n: u64) -> (f64, f64) {
    let bsdf = seen_from(world, direction(cos, 0.7));
    let (mut sum, mut squares) = (0.0f64, 0.0f64);
    for k in 0..n {
        let u = |d| uniform(2, &[k, d]) as f32;
        let weight = bsdf.sample(&numbers(u(0), [u(1), u(2)])).map_or(0.0, |s| {
            let here = match s.kind {
                // Radiance is denser beyond; energy is not.
                Kind::Mirrored { denser } => denser,
                _ => 1.0,
            };
            f64::from(s.weight.x * here)
        });
        sum += weight;
        squares += weight * weight;
    }
    let mean = sum / n as f64;
    (
        mean,
        ((squares / n as f64 - mean * mean) / n as f64)
            .max(0.0)
            .sqrt(),
    )
}

#[test]
fn no_material_returns_more_light_than_it_gets_and_white_bodies_return_all() {
    for (name, material) in all() {
        let world = world_of(&material);
        for cos in [1.0, 0.7, 0.3, 0.1] {
            let (mean, error) = returned(&world, cos, 20_000);
            // The layer's reflectance is interpolated in a table: 0.003.
            assert!(
                mean < 1.003 + 4.0 * error,
                "{name} at {cos}: {mean} ± {error}"
            );
            let is_white = name.contains("plastic")
                || ["diffuse", "glass", "mirror", "pane", "half clear"].contains(&name);
            if is_white {
                assert!(
                    (mean - 1.0).abs() < 0.004 + 4.0 * error,
                    "{name} at {cos}: {mean} ± {error}"
                );
            }
        }
    }
}

#[test]
fn each_sampler_draws_directions_by_its_density() {
    // χ² over 8 × 16 cells of (cos θ, φ); the expected counts are integrals of the density by a 56 × 56 midpoint rule.
    const COS: usize = 8;
    const PHI: usize = 16;
    for (name, material) in spreading() {
        let world = world_of(&material);
        for cos in [0.9, 0.4] {
            let bsdf = seen_from(&world, direction(cos, 1.0));
            let n = 40_000;
            let mut counts = vec![0.0f64; COS * PHI];
            let mut lost = 0.0;
            for k in 0..n {
                let u = |d| uniform(3, &[k, d]) as f32;
                match bsdf.sample(&numbers(u(0), [u(1), u(2)])) {
                    Some(s) if matches!(s.kind, Kind::Spread { .. }) => {
                        let phi = s.direction.y.atan2(s.direction.x).rem_euclid(6.283_185_5);
                        let c = ((s.direction.z * COS as f32) as usize).min(COS - 1);
                        let p = ((phi / 6.283_185_5 * PHI as f32) as usize).min(PHI - 1);
                        counts[c * PHI + p] += 1.0;
                    }
                    _ => lost += 1.0,
                }
            }
            const FINE: usize = 56;
            let expected: Vec<f64> = (0..COS * PHI)
                .map(|cell| {
                    let mut sum = 0.0;
                    for k in 0..FINE * FINE {
                        let fine = |i: usize| (i as f32 + 0.5) / FINE as f32;
                        let c = ((cell / PHI) as f32 + fine(k / FINE)) / COS as f32;
                        let p = ((cell % PHI) as f32 + fine(k % FINE)) / PHI as f32;
                        let w = direction(c, p * std::f32::consts::TAU);
                        sum += f64::from(bsdf.value(w).1);
                    }
                    let cell = std::f64::consts::TAU / (COS * PHI) as f64;
                    n as f64 * cell * sum / (FINE * FINE) as f64
                })
                .collect();
            // What is drawn nowhere: light absorbed, passed on, or below the surface.
            let nowhere = n as f64 - expected.iter().sum::<f64>();
            let mut chi2 = 0.0;
            let mut cells = 0;
            // Cells with few expected are pooled.
            let (mut rare, mut rare_expected) = (0.0, 0.0);
            let all = counts.iter().zip(&expected);
            for (&seen, &e) in all.chain([(&lost, &nowhere)]) {
                if e < 10.0 {
                    rare += seen;
                    rare_expected += e;
                } else {
                    chi2 += (seen - e) * (seen - e) / e;
                    cells += 1;
                }
            }
            if rare_expected > 5.0 {
                chi2 += (rare - rare_expected).powi(2) / rare_expected;
                cells += 1;
            }
            // Mean k − 1, variance 2 (k − 1): five standard deviations, for 18 tries.
            let k = f64::from(cells - 1);
            assert!(
                chi2 < k + 5.0 * (2.0 * k).sqrt() + 5.0,
                "{name} at {cos}: χ² {chi2:.1} of {k} cells"
            );
        }
    }
}

#[test]
fn a_weight_is_value_over_density() {
    for (name, material) in spreading() {
        let world = world_of(&material);
        let bsdf = seen_from(&world, direction(0.6, 2.0));
        for k in 0..500 {
            let u = |d| uniform(4, &[k, d]) as f32;
            if let Some(s) = bsdf.sample(&numbers(u(0), [u(1), u(2)]))
                && let Kind::Spread { density, .. } = s.kind
            {
                let (value, again) = bsdf.value(s.direction);
                assert_eq!(density, again, "{name}");
                assert!(
                    (s.weight * density - value).abs().max_element() < 1e-4 * value.max_element()
                );
            }
        }
    }
}

#[test]
fn refraction_follows_snell_and_a_slab_gives_back_the_direction() {
    let world = world_of(&Material::glass(1.5));
    let view = direction(0.6, 0.0);
    let bsdf = seen_from(&world, view);
    let refracted = (0..200)
        .filter_map(|k| bsdf.sample(&numbers(uniform(5, &[k]) as f32, [0.5; 2])))
        .find(|s| s.direction.z < 0.0)
        .unwrap();
    let sin = (1.0 - refracted.direction.z.powi(2)).sqrt();
    assert!((sin * 1.5 - 0.8).abs() < 1e-5, "{sin}");
    // From inside: the square is seen from below with the inverse ratio.
    let inside = seen_from(&world, refracted.direction);
    let out = (0..200)
        .filter_map(|k| inside.sample(&numbers(uniform(6, &[k]) as f32, [0.5; 2])))
        .find(|s| s.direction.z > 0.0)
        .unwrap();
    assert!((out.direction - view).length() < 1e-5);
}
