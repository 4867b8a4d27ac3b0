//! Rays against triangles: no holes, and the same nearest hit as a plain search in f64.

use glam::{DAffine3, DVec3, Vec3A as Vec3};

use crate::rays::Ray;
use crate::sampling::uniform;
use crate::scene::world::trace::{QueryResult, RayQuery};
use crate::scene::world::walk::Walks;
use crate::scene::world::{Instance, Material, TriangleMesh, World, WorldDescription};
use crate::simd::SimdLevel;

fn random_direction(key: u64) -> DVec3 {
    let z = 2.0 * uniform(7, &[key, 0]) - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * uniform(7, &[key, 1])).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

fn ball(rings: usize, centre: DVec3, stretch: DVec3) -> WorldDescription {
    let mut world = WorldDescription {
        materials: vec![Material::default()],
        ..WorldDescription::default()
    };
    world.add(TriangleMesh::sphere(1.0, rings, 0), 0);
    world.instances[0].camera_from_mesh = DAffine3::from_scale_rotation_translation(
        stretch,
        glam::DQuat::from_rotation_x(0.3),
        centre,
    );
    world
}

#[test]
fn no_ray_leaves_a_closed_body_through_an_edge_or_a_vertex() {
    // Large, far from the origin and flat: the worst for rounding. Instances are baked, so the vertices are f32 in the
    // camera frame.
    for (stretch, centre) in [
        (DVec3::splat(1.0), DVec3::ZERO),
        (DVec3::splat(3000.0), DVec3::new(500.0, 0.0, -8000.0)),
        (
            DVec3::new(4000.0, 1.0, 4000.0),
            DVec3::new(0.0, -100.0, -5000.0),
        ),
    ] {
        let world = World::new(ball(24, centre, stretch)).unwrap();
        let geometry = &world.stage.geometries[0];
        let mut walks = Walks::default();
        let mut tries = 0;
        for (k, triangle) in geometry.triangles.iter().enumerate() {
            let [a, b, c] = triangle
                .vertices
                .map(|v| geometry.positions[v as usize].as_dvec3());
            let random = uniform(8, &[k as u64]);
            let targets = [
                a,
                b,
                c,
                0.5 * (a + b),
                b + random * (c - b),
                a + random * (c - a),
            ];
            for target in targets {
                // From the middle and from another place inside.
                for origin in [centre, centre + 0.3 * (a - centre)] {
                    let ray = Ray {
                        origin_mm: origin,
                        direction: (target - origin).normalize(),
                    };
                    if ray.direction.is_finite() {
                        tries += 1;
                        assert!(
                            world.closest(&ray, &mut walks).is_some(),
                            "ray {ray:?} to a vertex or edge of triangle {k} gets out"
                        );
                    }
                }
            }
        }
        assert!(tries > 10_000);
    }
}

/// The nearest hit by testing every triangle in f64 (T. Möller, B. Trumbore, J. Graph. Tools 2, 21 (1997)).
fn plain(triangles: &[[DVec3; 3]], ray: &Ray) -> Option<f64> {
    let mut nearest = None::<f64>;
    for [a, b, c] in triangles {
        let (e1, e2) = (*b - *a, *c - *a);
        let p = ray.direction.cross(e2);
        let det = e1.dot(p);
        let s = ray.origin_mm - *a;
        let u = s.dot(p) / det;
        let q = s.cross(e1);
        let v = ray.direction.dot(q) / det;
        let t = e2.dot(q) / det;
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && nearest.is_none_or(|n| t < n) {
            nearest = Some(t);
        }
    }
    nearest
}

#[test]
fn the_nearest_hit_is_that_of_a_plain_search() {
    // Scattered shapes, one mesh with enough triangles and instances to have a tree of its own, mirrored and sheared
    // ones among them.
    let mut world = WorldDescription {
        materials: vec![Material::default()],
        ..WorldDescription::default()
    };
    world.add(
        TriangleMesh::cuboid(DVec3::splat(-80.0), DVec3::splat(-40.0), 0),
        0,
    );
    world.meshes.push(TriangleMesh::sphere(1.0, 20, 0));
    for k in 0..130u64 {
        let u = |d| uniform(9, &[k, d]);
        let scale = DVec3::new(1.0 + 5.0 * u(0), 1.0 + 5.0 * u(1), -1.0 - 5.0 * u(2));
        let turn = glam::DQuat::from_axis_angle(random_direction(k), u(3));
        let place = 100.0 * DVec3::new(u(4) - 0.5, u(5) - 0.5, u(6) - 0.5);
        world.instances.push(Instance {
            mesh: 1,
            camera_from_mesh: DAffine3::from_scale_rotation_translation(scale, turn, place),
            object_id: k as u16 + 1,
        });
    }
    let all: Vec<[DVec3; 3]> = world
        .instances
        .iter()
        .flat_map(|i| {
            let mesh = &world.meshes[i.mesh];
            mesh.triangles.iter().map(|t| {
                t.map(|v| {
                    let p = glam::Vec3::from(mesh.positions_mm[v as usize]).as_dvec3();
                    i.camera_from_mesh.transform_point3(p)
                })
            })
        })
        .collect();
    let world = World::new(world).unwrap();
    assert_eq!(
        world.stage.geometries.len(),
        2,
        "a baked one and one of its own"
    );
    assert_eq!(world.triangles(), all.len());
    let mut hits = 0;
    for k in 0..300 {
        let ray = Ray {
            origin_mm: 120.0 * random_direction(1000 + k),
            direction: DVec3::ZERO,
        };
        let aim = 60.0 * random_direction(2000 + k) * uniform(10, &[k]);
        let ray = Ray {
            direction: (aim - ray.origin_mm).normalize(),
            ..ray
        };
        let ours = world.first_hit(ray.origin_mm, ray.direction);
        match (ours, plain(&all, &ray)) {
            (Some(hit), Some(t)) => {
                hits += 1;
                // Baked vertices are rounded to f32: 1e-5 mm at 100 mm, more along a grazing ray.
                assert!(
                    (hit.distance_mm - t).abs() < 1e-2,
                    "{} and {t}",
                    hit.distance_mm
                );
                assert!(hit.normal.dot(ray.direction) < 0.05);
            }
            (None, None) => {}
            (ours, plain) => panic!("{ours:?} but {plain:?} for ray {k}"),
        }
    }
    assert!(hits > 50);
}

/// Growing triangles that share a corner: one tree over them takes minutes to build.
#[test]
fn a_fan_of_triangles_is_built_at_once_and_searched_right() {
    const N: usize = 30_000;
    let triangles: Vec<[DVec3; 3]> = (1..=N)
        .map(|k| {
            let size = 50.0 * k as f64 / N as f64;
            let (near, far) = (
                DVec3::new(size, 0.0, -size),
                DVec3::new(0.0, size, -2.0 * size),
            );
            [DVec3::ZERO, near, far].map(|v| v.as_vec3().as_dvec3())
        })
        .collect();
    let mesh = TriangleMesh {
        positions_mm: triangles
            .iter()
            .flatten()
            .map(|v| v.as_vec3().to_array())
            .collect(),
        triangles: (0..N as u32)
            .map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect(),
        ..TriangleMesh::default()
    };
    let mut world = WorldDescription {
        materials: vec![Material::default()],
        ..WorldDescription::default()
    };
    world.add(mesh, 0);
    let world = World::new(world).unwrap();
    let mut hits = 0;
    for k in 0..60 {
        let origin_mm = DVec3::new(60.0, 40.0, 30.0) * uniform(11, &[k, 3]);
        let aim = 50.0
            * DVec3::new(
                uniform(11, &[k, 0]),
                uniform(11, &[k, 1]),
                -1.5 * uniform(11, &[k, 2]),
            );
        let ray = Ray {
            origin_mm,
            direction: (aim - origin_mm).normalize(),
        };
        let ours = world.first_hit(ray.origin_mm, ray.direction);
        let wanted = plain(&triangles, &ray);
        assert_eq!(ours.is_some(), wanted.is_some(), "ray {k}");
        if let (Some(hit), Some(t)) = (ours, wanted) {
            hits += 1;
            assert!(
                (hit.distance_mm - t).abs() < 1e-2,
                "{} and {t}",
                hit.distance_mm
            );
        }
    }
    assert!(hits > 10, "{hits}");
}

#[test]
fn every_level_of_instructions_finds_the_same_triangle_for_rays_alone_and_together() {
    let (steps, rays) = if cfg!(miri) { (6, 30) } else { (40, 2000) };
    let mut world = World::new(ball(
        steps,
        DVec3::new(3.0, 2.0, -9.0),
        DVec3::new(2.0, 1.0, 3.0),
    ))
    .unwrap();
    let ray = |k: u64| {
        let origin = DVec3::new(3.0, 2.0, -9.0) + 4.0 * random_direction(k);
        let aim = DVec3::new(3.0, 2.0, -9.0) + 2.0 * random_direction(9000 + k);
        Ray {
            origin_mm: origin,
            direction: (aim - origin).normalize(),
        }
    };
    // Every third asks for light from 2 mm away.
    let query = |k: u64| match k % 3 {
        0 => RayQuery::transmittance(k as usize, ray(k), 2.0),
        _ => RayQuery::nearest(k as usize, ray(k)),
    };
    let mut walks = Walks::default();
    let mut found: Option<Vec<QueryResult>> = None;
    let best = SimdLevel::detect();
    for simd in SimdLevel::ALL.into_iter().filter(|level| *level <= best) {
        for geometry in &mut world.stage.geometries {
            geometry.bvh.set_simd(simd);
        }
        let mut together: Vec<RayQuery> = (0..rays).map(query).collect();
        for some in together.chunks_mut(100) {
            world.trace(some, &mut walks);
        }
        let alone: Vec<QueryResult> = (0..rays)
            .map(|k| {
                let mut query = query(k);
                world.trace(std::slice::from_mut(&mut query), &mut walks);
                query.result
            })
            .collect();
        let together: Vec<QueryResult> = together.iter().map(|q| q.result).collect();
        assert_eq!(together, alone, "{simd:?}");
        assert_eq!(
            *found.get_or_insert_with(|| alone.clone()),
            alone,
            "{simd:?}"
        );
    }
    let found = found.unwrap_or_default();
    let count = |result| found.iter().filter(|r| **r == result).count();
    let (open, dark) = (
        count(QueryResult::Transmittance(Vec3::ONE)),
        count(QueryResult::Transmittance(Vec3::ZERO)),
    );
    assert!(open > 0 && dark > 0, "{open} and {dark}");
}

#[test]
fn bad_geometry_is_counted_and_an_empty_world_is_dark() {
    let mut world = ball(4, DVec3::ZERO, DVec3::ONE);
    let good = world.meshes[0].triangles.len();
    world.meshes[0].positions_mm.push([f32::NAN, 0.0, 0.0]);
    world.meshes[0].normals.as_mut().unwrap().push([0.0; 3]);
    world.meshes[0]
        .uvs
        .as_mut()
        .unwrap()
        .push([f32::INFINITY, 0.0]);
    let bad = world.meshes[0].positions_mm.len() as u32 - 1;
    world.meshes[0].triangles.push([0, 7, bad]);
    world.meshes[0].triangles.push([7, 7, 8]);
    world.instances.push(Instance {
        mesh: 0,
        camera_from_mesh: DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)),
        object_id: 0,
    });
    let world = World::new(world).unwrap();
    let w = world.warnings();
    assert_eq!(world.triangles(), good);
    assert_eq!(
        (
            w.non_finite_triangles,
            w.degenerate_triangles,
            w.bad_normals,
            w.bad_uvs,
            w.flat_instances
        ),
        (1, 1, 1, 1, 1)
    );
    assert_eq!(w.lines().len(), 5);
    let empty = World::new(WorldDescription::default()).unwrap();
    assert!(empty.first_hit(DVec3::ZERO, DVec3::NEG_Z).is_none());
    assert!(empty.bounds_mm().is_none());
}

#[test]
fn tens_of_thousands_of_equal_triangles_and_instances_are_one_to_a_ray() {
    const N: usize = 64_000;
    let mut triangles = WorldDescription {
        materials: vec![Material::default()],
        ..WorldDescription::default()
    };
    let corners = [[0.0, 0.0, -5.0], [1.0, 0.0, -5.0], [-0.0, 1.0, -5.0]];
    let mesh = TriangleMesh {
        positions_mm: corners.into(),
        triangles: (0..N).map(|k| [[0, 1, 2], [1, 2, 0]][k % 2]).collect(),
        ..TriangleMesh::default()
    };
    triangles.add(mesh, 0);
    let mut instances = ball(8, DVec3::new(0.0, 0.0, -5.0), DVec3::ONE);
    instances.instances = vec![instances.instances[0].clone(); N];
    for (world, kept) in [
        (triangles, 1),
        (instances.clone(), instances.meshes[0].triangles.len()),
    ] {
        let world = World::new(world).unwrap();
        assert_eq!(world.triangles(), kept);
        assert_eq!(world.warnings().repeated, N - 1);
        let hit = world.first_hit(DVec3::new(0.1, 0.1, 0.0), DVec3::NEG_Z);
        assert!(hit.is_some());
    }
}
