//! What a white wall is known to give takes noise away and adds no light: the ratio estimator held to many plain rays.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::render::truth::WhiteField;
use quadpixel::render::{Camera, Render, RenderSettings};
use quadpixel::sampling::uniform;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

use super::shots::{PHONE, camera, focused, shoot, wave_pixel, white};

fn shot(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Vec<f32> {
    known_shot(
        camera,
        scene,
        rays_per_pixel,
        seed,
        &WhiteField::new(camera),
    )
}

fn known_shot(
    camera: &Camera,
    scene: &Scene,
    rays_per_pixel: usize,
    seed: u64,
    known: &WhiteField,
) -> Vec<f32> {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    let render = Render::new(camera, scene, &settings).white(known);
    render.run().image.mosaic.data().to_vec()
}

fn plain(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Vec<f32> {
    let done = shoot(camera, scene, rays_per_pixel, seed);
    done.image.mosaic.data().to_vec()
}

/// Cells of random colour, each two pixels wide.
fn chart() -> Scene {
    let cells = Texture::from_fn(256, 256, |x, y| {
        [0, 1, 2].map(|channel| 0.1 + uniform(7, &[x as u64, y as u64, channel]) as f32)
    });
    let card = TexturedPlane::new(
        DVec3::new(0.0, 0.0, -400.0),
        (60.0, 60.0),
        (0.0, 0.0, 0.0),
        Arc::new(cells.unwrap()),
        None,
    );
    Scene::new(vec![card.unwrap()], [0.5; 3])
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64
}

fn rms(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.len() as f64).sqrt()
}

fn window() -> Camera {
    let lens = focused(PHONE, 500.0);
    camera(&lens, &wave_pixel(), (24, 24), DVec2::new(0.1, 0.05))
}

#[test]
fn a_wall_by_few_rays_is_the_wall_by_many() {
    // The wall that is known is one without diffraction at the lens, which lets a little more or less pass at the rim.
    for (camera, worst, even) in [
        (window(), 2e-3, 2e-4),
        (window().with_lens_diffraction(), 4e-3, 1e-3),
    ] {
        let few = shot(&camera, &white(), 24, 1);
        let many = plain(&camera, &white(), 16384, 2);
        for (few, many) in few.iter().zip(&many) {
            assert!((few / many - 1.0).abs() < worst, "{few} for {many}");
        }
        let off = mean(&few) / mean(&many) - 1.0;
        assert!(off.abs() < even, "{off}");
    }
}

#[test]
fn noise_is_less_and_the_mean_stays() {
    for camera in [window(), window().with_lens_diffraction()] {
        let scene = chart();
        let reference = plain(&camera, &scene, 16384, 9);
        let known = WhiteField::new(&camera);
        for (rays, seeds) in [(24, 64), (96, 16)] {
            let noise = |shots: &[Vec<f32>]| {
                let squares = shots.iter().map(|shot| rms(shot, &reference).powi(2));
                (squares.sum::<f64>() / shots.len() as f64).sqrt()
            };
            let with = (1..=seeds).map(|seed| known_shot(&camera, &scene, rays, seed, &known));
            let with: Vec<Vec<f32>> = with.collect();
            let without = (1..=seeds).map(|seed| plain(&camera, &scene, rays, seed));
            let (error, before) = (noise(&with), noise(&without.collect::<Vec<_>>()));
            let off =
                with.iter().map(|shot| mean(shot)).sum::<f64>() / seeds as f64 / mean(&reference)
                    - 1.0;
            println!(
                "{rays} rays: {:.3} % for {:.3} %, mean {:+.4} %",
                100.0 * error / mean(&reference),
                100.0 * before / mean(&reference),
                100.0 * off
            );
            assert!(error < 0.95 * before, "{rays} rays: {error} for {before}");
            // A pixel's values share its rays: the mean of 576 pixels has a twenty-fourth of their noise, that of all
            // seeds 2e-4.
            assert!(off.abs() < 1e-3, "{rays} rays: {off}");
        }
    }
}

#[test]
fn for_few_rays_nothing_changes() {
    let camera = window();
    // Four sub-pixels: fewer than 6 rays each.
    assert_eq!(
        shot(&camera, &chart(), 16, 3),
        plain(&camera, &chart(), 16, 3)
    );
}
