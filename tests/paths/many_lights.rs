//! Many lights: right whichever of them are drawn, and little noise although each place is lit by few.

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use quadpixel::render::RenderSettings;
use quadpixel::render::truth::{SightRays, WhiteField};
use quadpixel::sampling::uniform;
use quadpixel::scene::Scene;
use quadpixel::scene::world::{Light, Material, TriangleMesh, World, WorldDescription};

use super::shots::{self, PHONE, boxes, focused};
use super::{add_at, bounces, mean, plain};

#[test]
fn a_plain_path_tracer_agrees_on_lamps_of_all_kinds() {
    // Beside the large one: balls, a lamp that shines from both sides, one that is mirrored and shines downwards.
    let mut world = WorldDescription::cornell_box();
    world.instances.retain(|i| ![2, 3].contains(&i.object_id));
    let first = world.materials.len();
    world.materials.extend([
        Material::emitter([6.0, 3.0, 1.0]),
        Material {
            two_sided: true,
            ..Material::emitter([1.0, 2.0, 5.0])
        },
        Material::emitter([3.0, 9.0, 3.0]),
    ]);
    for k in 0..6u64 {
        let u = |d| uniform(31, &[k, d]) - 0.5;
        let mut ball = TriangleMesh::sphere(18.0, 3, first);
        ball.normals = None;
        let at = DVec3::new(300.0 * u(0), 200.0 * u(1), -750.0 + 250.0 * u(2));
        add_at(&mut world, ball, at, 10 + k as u16);
    }
    let upright =
        TriangleMesh::rectangle(DVec3::ZERO, DVec3::X * 90.0, DVec3::Y * -90.0, first + 1);
    add_at(&mut world, upright, DVec3::new(-140.0, -60.0, -700.0), 20);
    // Its front is up, and down when it is mirrored.
    let lying = TriangleMesh::rectangle(DVec3::ZERO, DVec3::X * 100.0, DVec3::Z * 100.0, first + 2);
    world.add(lying, 21);
    if let Some(instance) = world.instances.last_mut() {
        instance.camera_from_mesh = DAffine3::from_translation(DVec3::new(60.0, -20.0, -820.0))
            * DAffine3::from_scale(DVec3::new(1.0, -1.0, 1.0));
    }
    plain::agrees(world);
}

/// Where 400 lamps are, 30 mm above a floor at y = −100 of 8 m × 8 m.
fn places() -> Vec<DVec3> {
    let at = |k, d| 8000.0 * (uniform(32, &[k, d]) - 0.5);
    (0..400)
        .map(|k| DVec3::new(at(k, 0), -70.0, at(k, 1)))
        .collect()
}

fn floor_with_lamps(are_points: bool) -> World {
    let mut world = WorldDescription {
        materials: vec![Material::diffuse([0.5; 3]), Material::emitter([50.0; 3])],
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-4000.0, -100.0, -4000.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::Z * 8000.0, DVec3::X * 8000.0, 0),
        0,
    );
    for place in places() {
        if are_points {
            world.lights.push(Light::Point {
                position_mm: place,
                intensity_m2: [1e-3; 3],
            });
        } else {
            add_at(&mut world, TriangleMesh::sphere(4.0, 4, 1), place, 1);
        }
    }
    World::new(world).unwrap()
}

/// Deviation of one path over the mean, against that of even chances of all lamps: √(N Σ c²/(Σ c)² − 1), c what each
/// gives, cos θ/d².
#[test]
fn each_place_draws_the_lights_that_light_it() {
    for are_points in [false, true] {
        let world = floor_with_lamps(are_points);
        let (mut log, count) = (0.0, 20);
        for k in 0..count {
            let at = |d| 4000.0 * (uniform(33, &[k, d]) - 0.5);
            let eye = DVec3::new(at(0), -99.0, at(1));
            let [(light, error), ..] = mean(&world, (eye, -DVec3::Y), &bounces(1), 2000);
            let spread = error * 2000f64.sqrt() / light;
            let given = places().into_iter().map(|p| {
                let way = p - eye.with_y(-100.0);
                way.y / way.length().powi(3)
            });
            let (sum, squares) = given.fold((0.0, 0.0), |(s, q), c| (s + c, q + c * c));
            let even = (400.0 * squares / (sum * sum) - 1.0f64).sqrt();
            log += (spread / even).ln() / count as f64;
        }
        assert!(log.exp() < 0.3, "points {are_points}: {}", log.exp());
    }
}

#[test]
fn the_paths_of_a_targets_pixel_are_spread_evenly() {
    let lens = focused(PHONE, 750.0);
    let pixel = boxes(2, 2, 60.0, 150.0);
    let camera = shots::camera(&lens, &pixel, (16, 16), DVec2::ZERO);
    let mut room = WorldDescription::cornell_box();
    room.instances.retain(|i| ![2, 3].contains(&i.object_id));
    let world = Arc::new(World::new(room).unwrap());
    let scene = Scene::from_world(world.clone(), bounces(2));
    let (chief, white) = (SightRays::chief_rays(&camera), WhiteField::new(&camera));
    let [a, b] = [1, 2].map(|seed| {
        let settings = RenderSettings {
            rays_per_pixel: 256,
            seed,
        };
        chief.target(&camera, &scene, &white, &settings)
    });
    let greens = a.data().chunks(3).zip(b.data().chunks(3));
    let target = median(greens.map(|(x, y)| {
        let (x, y) = (f64::from(x[1]), f64::from(y[1]));
        (x - y).abs() / (0.5 * (x + y))
    }));
    // The same number of paths, each with random numbers of its own, along the pixels' chief rays. The median of what
    // two such means differ by is 0.954 of an error's deviation.
    let independent = median((0..256).map(|pixel| {
        let place = (camera.sensor()).position_mm((pixel % 16) as f64, (pixel / 16) as f64);
        let line = chief.line(&camera, place).unwrap();
        let ray = (line.q1_mm.extend(0.0), line.q0.extend(-1.0).normalize());
        let [_, (green, error), _] = mean(&world, ray, &bounces(2), 128);
        0.954 * error / green
    }));
    assert!(
        0.0 < target && target < 0.75 * independent,
        "{target} for {independent}"
    );
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
