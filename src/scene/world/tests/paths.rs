//! Paths, and what is found of them apart.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3A as Vec3};

use crate::rays::{Ray, RayBatch, RaySlices};
use crate::sampling::uniform;
use crate::scene::texture::Texture;
use crate::scene::world::path::PathWorkspace;
use crate::scene::world::path_state::Start;
use crate::scene::world::sampler::PathSamples;
use crate::scene::world::trace::RayQuery;
use crate::scene::world::{
    Alpha, Environment, Material, PathSettings, TextureMap, TextureRef, TriangleMesh, World,
    WorldDescription, Wrap,
};
use crate::scene::{Hits, Scene};

/// Balls of many materials, one of which shines, before a wall with a picture.
fn balls() -> WorldDescription {
    let picture = Texture::from_fn(32, 16, |x, y| {
        [(x % 5) as f32 / 5.0, 0.5, (y % 3) as f32 / 3.0]
    });
    let texture = TextureRef {
        texture: 0,
        uv_from_mesh: glam::Affine2::from_scale(glam::Vec2::splat(3.0)),
    };
    let veil = Material {
        alpha: Alpha::Blend { alpha: 0.4 },
        ..Material::diffuse([0.2, 0.8, 0.4])
    };
    let glass = Material {
        transmission: 1.0,
        roughness: 0.0,
        ..Material::default()
    };
    let pictured = Material {
        base_colour_texture: Some(texture),
        roughness: 0.4,
        ..Material::default()
    };
    let mut world = WorldDescription {
        textures: vec![TextureMap::from_texture(
            &picture.unwrap(),
            [Wrap::Repeat, Wrap::Mirror],
        )],
        materials: vec![
            pictured,
            Material::diffuse([0.7, 0.5, 0.3]),
            Material::metal([0.9, 0.7, 0.5], 0.3),
            veil,
            glass,
            Material::emitter([9.0, 8.0, 7.0]),
        ],
        ..WorldDescription::default()
    };
    for k in 0..12u64 {
        let u = |d: u64| uniform(21, &[k, d]);
        world.add(
            TriangleMesh::sphere(1.0, 12, 1 + (k % 5) as usize),
            10 + k as u16,
        );
        let place = DVec3::new(6.0 * u(0) - 3.0, 4.0 * u(1) - 2.0, -6.0 - 6.0 * u(2));
        let instance = world.instances.last_mut().unwrap();
        instance.camera_from_mesh = DAffine3::from_translation(place);
    }
    world.add(TriangleMesh::sphere(1.0, 12, 0), 5);
    let wall = world.instances.last_mut().unwrap();
    wall.camera_from_mesh = DAffine3::from_scale_rotation_translation(
        DVec3::splat(20.0),
        glam::DQuat::IDENTITY,
        DVec3::ZERO,
    );
    world
}

fn rays(count: u64) -> Vec<Ray> {
    let ray = |k: u64| Ray {
        origin_mm: DVec3::ZERO,
        direction: DVec3::new(uniform(4, &[k, 0]) - 0.5, uniform(4, &[k, 1]) - 0.5, -1.0)
            .normalize(),
    };
    (0..count).map(ray).collect()
}

/// Radiances in the order of the rays.
fn followed(world: &World, settings: &PathSettings, by_level: bool) -> Vec<Vec3> {
    let mut workspace = PathWorkspace::default();
    let all = rays(if cfg!(miri) { 20 } else { 3000 });
    let mut found = vec![Vec3::NAN; all.len()];
    for (first, some) in (0..).step_by(60).zip(all.chunks(60)) {
        workspace.queries.clear();
        let queries = some
            .iter()
            .enumerate()
            .map(|(i, ray)| RayQuery::nearest(i, *ray));
        workspace.queries.extend(queries);
        world.trace(&mut workspace.queries, &mut workspace.walks);
        let starts = workspace.queries.iter().map(|query| Start {
            number: first + query.number,
            ray: query.ray,
            hit: query.nearest_element(),
            spread: 1e-3,
            samples: PathSamples::new(9, (first + query.number) as u32),
        });
        workspace.paths.start(starts);
        let mut visit = |number: usize, radiance| found[number] = radiance;
        match by_level {
            true => world.radiance(settings, &mut workspace, &mut visit),
            false => world.follow(settings, &mut workspace, &mut visit),
        }
    }
    found
}

#[test]
fn paths_are_the_same_for_every_level_of_instructions() {
    let world = World::new(balls()).unwrap();
    let settings = PathSettings::default();
    let [best, plain] = [true, false].map(|by_level| followed(&world, &settings, by_level));
    assert_eq!(best, plain);
    assert!(plain.iter().all(|l| l.is_finite()));
    let lit = plain.iter().filter(|l| l.max_element() > 0.0).count();
    assert!(lit * 2 > plain.len(), "{lit}");
}

/// A sky of next to nothing has every path followed to its last surface.
#[test]
fn of_the_last_surface_only_what_shines_is_looked_for() {
    let world = |sky| {
        let environment = Environment::Even([sky; 3]);
        World::new(WorldDescription {
            environment,
            ..balls()
        })
        .unwrap()
    };
    let (dark, all) = (world(0.0), world(1e-36));
    for max_bounces in [0, 1, 2, 4] {
        let settings = PathSettings {
            max_bounces,
            ..PathSettings::default()
        };
        let found = [&dark, &all].map(|world| followed(world, &settings, true));
        let pairs = || found[0].iter().zip(&found[1]);
        assert!(
            pairs().all(|(a, b)| a.abs_diff_eq(*b, 1e-30)),
            "{max_bounces}"
        );
        assert!(pairs().any(|(a, _)| a.max_element() > 0.0));
    }
}

#[test]
fn surfaces_found_apart_are_those_of_first_hits() {
    let world = World::new(balls()).unwrap();
    let scene = Scene::from_world(Arc::new(world), PathSettings::default());
    let mut batch = RayBatch::default();
    rays(500)
        .iter()
        .for_each(|ray| batch.push(ray.origin_mm, ray.direction));
    batch.status[7] = 1;
    let (mut whole, mut found) = (Hits::default(), Hits::default());
    scene.intersect(RaySlices::from_batch(&batch), &mut whole);
    scene.find_surfaces(RaySlices::from_batch(&batch), &mut found);
    assert_eq!(found.surface, whole.surface);
    assert_eq!(found.world.elements, whole.world.elements);
    let kinds: std::collections::BTreeSet<u16> = found.surface.iter().copied().collect();
    assert!(kinds.len() > 8, "{kinds:?}");
}
