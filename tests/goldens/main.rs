//! A chart and a room through a lens, each held to a golden that carries its variance: whatever changes the light that
//! computes, and no closed form sees, is found here. Another order of the rays is not: a golden is no set of bytes.
//!
//! A golden holds, for each value of a picture, mean and variance over [`SEEDS`] renders of other seeds. A render of a
//! new seed is drawn from the same distribution if the light is the same; see `z_test` for what is held against what.
//!
//! Where a change of the light is meant, the golden is made again (some minutes on two cores), and the commit says
//! why:
//!
//! ```text
//! QUADPIXEL_GOLDENS=make cargo test --release --test goldens
//! ```

#![allow(clippy::unwrap_used)] // because tests fail by panicking

#[path = "../common/shots.rs"]
mod shots;
mod z_test;

use std::path::Path;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::render::Camera;
use quadpixel::sampling::uniform;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::world::{Light, PathSettings, World, WorldDescription};
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;
use shots::{PHONE, boxes, focused, shoot, wave_pixel};
use z_test::Golden;

/// Renders that a golden is made of, with the seeds 1 to `SEEDS`.
const SEEDS: u64 = 192;
/// Microlenses of the chart's picture.
const CHART_PX: (usize, usize) = (32, 24);
const CHART_RAYS: usize = 64;
/// Microlenses of the room's picture.
const ROOM_PX: (usize, usize) = (16, 16);
const ROOM_RAYS: usize = 512;
const NEW_SEED: u64 = 1_000_003;

/// Off the axis, where the microlenses follow the chief ray, by a table of the wave level.
fn lens_camera(shift_px: f64) -> Camera {
    let response = wave_pixel();
    let centre_mm = DVec2::new(1.0 + 1e-3 * response.pitch_um() * shift_px, 0.6);
    let sensor = Sensor::new(
        response.pitch_um(),
        response.subpixels(),
        CHART_PX,
        centre_mm,
    )
    .unwrap();
    let (lens, bands) = (focused(PHONE, 500.0), ChannelWavelengths::default());
    Camera::new(&lens, sensor, ShiftRule::ChiefRay, &response, bands).unwrap()
}

/// Coloured squares before the focus, some 4 px wide, blurred by about 1 px.
fn chart() -> Scene {
    let colour = |x: usize, y: usize, c: u64| uniform(3, &[x as u64 / 2, y as u64 / 2, c]) as f32;
    let texture = Texture::from_fn(128, 128, |x, y| {
        [0, 1, 2].map(|c| 0.1 + 0.8 * colour(x, y, c))
    });
    let efl_mm = focused(PHONE, 500.0).paraxial(550.0).unwrap().efl_mm;
    let depth_mm = 480.0;
    let centre = depth_mm / efl_mm * DVec2::new(1.0, -0.6);
    let side_mm = 0.15 * depth_mm / efl_mm;
    let plane = TexturedPlane::new(
        centre.extend(-depth_mm),
        (side_mm, side_mm),
        (10.0, -5.0, 0.0),
        Arc::new(texture.unwrap()),
        None,
    );
    Scene::new(vec![plane.unwrap()], [0.3; 3])
}

/// Light of a path, at most: that through the glass has too long a tail for a test of normal values.
const CLAMP: f32 = 1.0;

/// The Cornell box, a lamp of no size beside its shining one: diffuse walls, glass, rough metal.
fn room(max_bounces: u32) -> Scene {
    let mut world = WorldDescription::cornell_box();
    world.lights.push(Light::Point {
        position_mm: DVec3::new(60.0, 60.0, -700.0),
        intensity_m2: [0.02, 0.03, 0.04],
    });
    let world = Arc::new(World::new(world).unwrap());
    let settings = PathSettings {
        max_bounces,
        clamp: Some(CLAMP),
        ..PathSettings::default()
    };
    Scene::from_world(world, settings)
}

/// On the axis, as wide as the box.
fn room_camera() -> Camera {
    let lens = focused(PHONE, 800.0);
    shots::camera(&lens, &boxes(2, 2, 110.0, 250.0), ROOM_PX, DVec2::ZERO)
}

/// The four views, one after the other.
fn picture(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Vec<f32> {
    let image = shoot(camera, scene, rays_per_pixel, seed).image;
    (0..4)
        .flat_map(|view| image.view(view).data().to_vec())
        .collect()
}

/// The golden of that name, made first where that is asked for.
fn golden(name: &str, size: (usize, usize), picture: impl Fn(u64) -> Vec<f32>) -> Golden {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/goldens")
        .join(name);
    if std::env::var("QUADPIXEL_GOLDENS").is_ok_and(|what| what == "make") {
        Golden::from_pictures((1..=SEEDS).map(picture), size).write(&path);
    }
    Golden::read(&path, size, SEEDS)
}

fn brighter(picture: &[f32], by: f32) -> Vec<f32> {
    picture.iter().map(|value| by * value).collect()
}

#[test]
fn the_chart_through_the_lens_is_its_golden_and_a_changed_one_is_refused() {
    let scene = chart();
    let shot = |shift_px, seed| picture(&lens_camera(shift_px), &scene, CHART_RAYS, seed);
    let golden = golden("lens.exr", CHART_PX, |seed| shot(0.0, seed));
    let image = shot(0.0, NEW_SEED);
    let outcome = golden.test(&image);
    assert!(outcome.agrees(), "{outcome:?}");

    // The test's own strength: what it must not let through.
    let outcome = golden.test(&brighter(&image, 1.01));
    assert!(!outcome.agrees(), "1 % brighter: {outcome:?}");
    let outcome = golden.test(&shot(0.1, NEW_SEED));
    assert!(!outcome.agrees(), "0.1 px aside: {outcome:?}");
}

#[test]
fn the_room_is_its_golden_and_a_changed_one_is_refused() {
    let camera = room_camera();
    let shot = |max_bounces, seed| picture(&camera, &room(max_bounces), ROOM_RAYS, seed);
    let golden = golden("room.exr", ROOM_PX, |seed| shot(16, seed));
    let image = shot(16, NEW_SEED);
    let outcome = golden.test(&image);
    assert!(outcome.agrees(), "{outcome:?}");

    // Light of paths has more noise than that of charts: 3 %, not 1.
    let outcome = golden.test(&brighter(&image, 1.03));
    assert!(!outcome.agrees(), "3 % brighter: {outcome:?}");
    let outcome = golden.test(&shot(3, NEW_SEED));
    assert!(!outcome.agrees(), "no fourth bounce: {outcome:?}");
}
