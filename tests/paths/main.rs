//! Light in worlds of meshes: closed forms, an independent plain path tracer, and the same bytes whatever the threads.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod closed_forms;
mod many_lights;
mod plain;
mod render;
#[path = "../common/shots.rs"]
mod shots;

use glam::{DAffine3, DVec3};
use quadpixel::sampling::uniform;
use quadpixel::scene::world::{
    Material, PathKey, PathSettings, TriangleMesh, World, WorldDescription,
};

/// Mean radiance along a ray over `paths` paths, and its standard error, per channel.
fn mean(
    world: &World,
    (origin, direction): (DVec3, DVec3),
    settings: &PathSettings,
    paths: u32,
) -> [(f64, f64); 3] {
    let (mut sum, mut squares) = ([0.0f64; 3], [0.0f64; 3]);
    for first in 0..paths {
        // A key each: independent paths, so that the error can be told.
        let key = PathKey {
            key: 0xA11_0000 + u64::from(first),
            number: 0,
            spread: 0.0,
        };
        let l = world.radiance_along(origin, direction, settings, &key);
        for c in 0..3 {
            sum[c] += f64::from(l[c]);
            squares[c] += f64::from(l[c]) * f64::from(l[c]);
        }
    }
    let n = f64::from(paths);
    [0, 1, 2].map(|c| {
        let mean = sum[c] / n;
        (mean, ((squares[c] / n - mean * mean) / n).max(0.0).sqrt())
    })
}

fn bounces(max_bounces: u32) -> PathSettings {
    PathSettings {
        max_bounces,
        ..PathSettings::default()
    }
}

/// A cube of side 200 around (0, 0, −200), its fronts inside, of one material, as object 0.
fn room(material: Material) -> WorldDescription {
    let mut world = WorldDescription {
        materials: vec![material],
        ..WorldDescription::default()
    };
    let mut cube = TriangleMesh::cuboid(
        DVec3::new(-100.0, -100.0, -300.0),
        DVec3::new(100.0, 100.0, -100.0),
        0,
    );
    for [_, b, c] in &mut cube.triangles {
        std::mem::swap(b, c);
    }
    world.add(cube, 0);
    world
}

/// Adds a mesh, moved to `centre`.
fn add_at(world: &mut WorldDescription, mesh: TriangleMesh, centre: DVec3, object_id: u16) {
    world.add(mesh, object_id);
    if let Some(instance) = world.instances.last_mut() {
        instance.camera_from_mesh = DAffine3::from_translation(centre);
    }
}

fn random_direction(key: u64) -> DVec3 {
    let z = 2.0 * uniform(70, &[key, 0]) - 1.0;
    let (sin, cos) = (std::f64::consts::TAU * uniform(70, &[key, 1])).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}
