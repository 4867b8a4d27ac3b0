//! Rays that look charts up over what their pixel sees: the picture of points, with less noise.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::render::truth::WhiteField;
use quadpixel::render::{Camera, Footprints, Render, RenderSettings};
use quadpixel::sampling::uniform;
use quadpixel::scene::coverage::Coverage;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

use super::shots::{PHONE, camera, focused, shoot, wave_pixel};

/// A card of random colours, `side` texels of `texel_mm` each, and so on.
fn card(
    depth_mm: f64,
    (side, texel_mm): (usize, f64),
    turns_deg: (f64, f64, f64),
    coverage: Option<Coverage>,
) -> TexturedPlane {
    let cells = Texture::from_fn(side, side, |x, y| {
        [0, 1, 2].map(|channel| 0.1 + uniform(7, &[x as u64, y as u64, channel]) as f32)
    });
    let length = side as f64 * texel_mm;
    let middle = DVec3::new(0.0, 0.0, -depth_mm);
    let texture = Arc::new(cells.unwrap());
    TexturedPlane::new(
        middle,
        (length, length),
        turns_deg,
        texture,
        coverage.map(Arc::new),
    )
    .unwrap()
}

/// A card in focus, turned every way, 3.5 texels a pixel, and before it a disk out of focus of 1.6.
fn scene() -> Scene {
    let disk = (0..64 * 64).map(|i| {
        let (x, y) = ((i % 64) as f64 - 31.5, (i / 64) as f64 - 31.5);
        u8::from(x * x + y * y < 400.0)
    });
    let disk = Coverage::new(64, disk.collect());
    Scene::new(
        vec![
            card(500.0, (256, 0.0405), (20.0, -15.0, 30.0), None),
            card(420.0, (32, 0.075), (5.0, 0.0, 0.0), Some(disk.unwrap())),
        ],
        [0.5; 3],
    )
}

fn window() -> Camera {
    let lens = focused(PHONE, 500.0);
    camera(&lens, &wave_pixel(), (24, 24), DVec2::ZERO)
}

fn by_areas(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Vec<f32> {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    let footprints = Footprints::new(camera, scene).unwrap();
    let white = WhiteField::new(camera);
    let render = Render::new(camera, scene, &settings).white(&white);
    let done = render.footprints(&footprints).run();
    done.image.mosaic.data().to_vec()
}

fn by_points(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Vec<f32> {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    let white = WhiteField::new(camera);
    let done = Render::new(camera, scene, &settings).white(&white).run();
    done.image.mosaic.data().to_vec()
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64
}

/// RMS difference over the mean of the second, and the slope of the first over the second, both from their means.
fn compared(a: &[f32], b: &[f32]) -> (f64, f64) {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let [mut squares, mut both, mut own] = [0.0; 3];
    for (&a, &b) in a.iter().zip(b) {
        let (a, b) = (f64::from(a), f64::from(b));
        squares += (a - b) * (a - b);
        both += (a - mean_a) * (b - mean_b);
        own += (b - mean_b) * (b - mean_b);
    }
    ((squares / a.len() as f64).sqrt() / mean_b, both / own)
}

#[test]
fn areas_give_the_picture_of_points_with_less_noise() {
    // Parts of the mean: how far the pictures may differ, and how much less noise there must be.
    for (camera, allowed, less) in [
        (window(), 4e-3, 0.5),
        (window().with_lens_diffraction(), 4e-3, 0.55),
    ] {
        let scene = scene();
        let points = by_points(&camera, &scene, 16384, 9);
        let areas = by_areas(&camera, &scene, 4096, 1);
        let (off, slope) = compared(&areas, &points);
        let bias = mean(&areas) / mean(&points) - 1.0;
        println!("RMS {off:.5}, slope {slope:.5}, mean {bias:+.6}");
        assert!(off < allowed, "{off}");
        assert!((slope - 1.0).abs() < 3e-3, "{slope}");
        assert!(bias.abs() < 3e-4, "{bias}");
        let noise = |shot: &dyn Fn(u64) -> Vec<f32>| {
            let squares = (1..=8).map(|seed| compared(&shot(seed), &points).0.powi(2));
            (squares.sum::<f64>() / 8.0).sqrt()
        };
        let few = noise(&|seed| by_areas(&camera, &scene, 48, seed));
        let before = noise(&|seed| by_points(&camera, &scene, 48, seed));
        println!("noise of 48 rays: {few:.5} for {before:.5}");
        assert!(few < less * before, "{few} for {before}");
    }
}

#[test]
fn an_even_card_is_even() {
    let camera = window().with_lens_diffraction();
    let even = Texture::from_fn(64, 64, |_, _| [1.0; 3]).unwrap();
    let middle = DVec3::new(0.0, 0.0, -400.0);
    let turns_deg = (20.0, 0.0, 0.0);
    let card = TexturedPlane::new(middle, (60.0, 60.0), turns_deg, Arc::new(even), None);
    let scene = Scene::new(vec![card.unwrap()], [1.0; 3]);
    let areas = by_areas(&camera, &scene, 48, 1);
    let points = by_points(&camera, &scene, 48, 2);
    for (area, point) in areas.iter().zip(&points) {
        assert!((area / point - 1.0).abs() < 1e-5, "{area} {point}");
    }
}

#[test]
fn threads_and_lost_light_change_nothing() {
    let camera = window().with_lens_diffraction();
    let scene = scene();
    let shot = |threads| super::shots::on_threads(threads, || by_areas(&camera, &scene, 16, 3));
    assert!(shot(1) == shot(3));
    assert!(Footprints::new(&camera, &Scene::new(Vec::new(), [1.0; 3])).is_none());
}

#[test]
fn a_card_seen_at_too_many_angles_is_looked_up_at_points() {
    let lens = focused("lib_wide_22mm", 600.0);
    let pixel = super::shots::boxes(2, 2, 100.0, 200.0);
    // 24 mm on the sensor, and a card that lies almost along the sight.
    let camera = camera(&lens, &pixel, (240, 160), DVec2::ZERO);
    let floor = card(600.0, (64, 100.0), (79.0, 0.0, 0.0), None);
    assert!(Footprints::new(&camera, &Scene::new(vec![floor.clone()], [0.5; 3])).is_none());
    let wall = card(600.0, (64, 100.0), (10.0, 0.0, 0.0), None);
    let both = Scene::new(vec![floor, wall], [0.5; 3]);
    let footprints = Footprints::new(&camera, &both);
    assert!(footprints.is_some());
    let settings = RenderSettings {
        rays_per_pixel: 24,
        seed: 5,
    };
    let render = Render::new(&camera, &both, &settings);
    let areas = render.footprints(footprints.as_ref()).run().image.mosaic;
    let points = shoot(&camera, &both, 24, 5).image.mosaic;
    // Above the middle the floor lies behind the wall; below, before it: there nothing is changed.
    let half = areas.data().len() / 2;
    let differ = |range: std::ops::Range<usize>| {
        let pairs = areas.data()[range.clone()]
            .iter()
            .zip(&points.data()[range]);
        pairs.filter(|(a, b)| a != b).count()
    };
    let (above, below) = (differ(0..half), differ(half..2 * half));
    println!("{above} values differ above, {below} below");
    assert!(above.min(below) < half / 20 && above.max(below) > half / 2);
}
