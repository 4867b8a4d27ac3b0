//! A picture through a lens, held to a golden that carries its variance: whatever changes the light that the renderer
//! computes, and no closed form sees, is found here. Another order of the rays is not: a golden is no set of bytes.
//!
//! A golden holds, for each value of a picture, mean and variance over [`SEEDS`] renders of other seeds. A render of a
//! new seed is drawn from the same distribution if the light is the same; see `z_test` for what is held against what.
//!
//! Where a change of the light is meant, the golden is made again (about a minute on two cores), and the commit says
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

use glam::DVec2;
use quadpixel::render::Camera;
use quadpixel::sampling::uniform;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;
use shots::{PHONE, focused, shoot, wave_pixel};
use z_test::Golden;

/// Microlenses.
const SIZE: (usize, usize) = (32, 24);
/// Renders that a golden is made of, with the seeds 1 to `SEEDS`.
const SEEDS: u64 = 192;
const RAYS_PER_PIXEL: usize = 64;
const NEW_SEED: u64 = 1_000_003;

/// Off the axis, where the microlenses follow the chief ray, by a table of the wave level.
fn lens_camera(shift_px: f64) -> Camera {
    let response = wave_pixel();
    let centre_mm = DVec2::new(1.0 + 1e-3 * response.pitch_um() * shift_px, 0.6);
    let sensor = Sensor::new(response.pitch_um(), response.subpixels(), SIZE, centre_mm).unwrap();
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

/// The four views, one after the other.
fn picture(camera: &Camera, scene: &Scene, seed: u64) -> Vec<f32> {
    let image = shoot(camera, scene, RAYS_PER_PIXEL, seed).image;
    (0..4)
        .flat_map(|view| image.view(view).data().to_vec())
        .collect()
}

#[test]
fn the_chart_through_the_lens_is_its_golden_and_a_changed_one_is_refused() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens/lens.exr");
    let (camera, scene) = (lens_camera(0.0), chart());
    if std::env::var("QUADPIXEL_GOLDENS").is_ok_and(|what| what == "make") {
        let pictures = (1..=SEEDS).map(|seed| picture(&camera, &scene, seed));
        Golden::from_pictures(pictures, SIZE).write(&path);
    }
    let golden = Golden::read(&path, SIZE, SEEDS);
    let image = picture(&camera, &scene, NEW_SEED);
    let outcome = golden.test(&image);
    assert!(outcome.agrees(), "{outcome:?}");

    // The test's own strength: what it must not let through.
    let brighter: Vec<f32> = image.iter().map(|value| 1.01 * value).collect();
    let outcome = golden.test(&brighter);
    assert!(!outcome.agrees(), "1 % brighter: {outcome:?}");
    let outcome = golden.test(&picture(&lens_camera(0.1), &scene, NEW_SEED));
    assert!(!outcome.agrees(), "0.1 px aside: {outcome:?}");
}
