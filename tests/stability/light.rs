//! Few and many samples, no light, and far too much of it.

use std::sync::Arc;

use glam::DVec3;
use quadpixel::render::{Camera, Rendered};
use quadpixel::response::{GeometricResponse, Response};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::Subpixels;
use quadpixel::spectrum::ChannelWavelengths;

use super::shots::{self, white};

/// Bare pixels of 2 µm that look at a disk of radius `semi_mm`, `far_mm` away.
fn bare(subpixels: Subpixels, size: (usize, usize), semi_mm: f64, far_mm: f64) -> Camera {
    let response = Response::Geometric(GeometricResponse::new(subpixels, 2.0, 1.0).unwrap());
    let wavelengths = ChannelWavelengths::default();
    shots::bare(&response, size, [semi_mm, far_mm], wavelengths)
}

fn shoot(camera: &Camera, scene: &Scene, rays_per_pixel: usize) -> Rendered {
    shots::shoot(camera, scene, rays_per_pixel, 5)
}

/// Under an even wall every ray of a far, small disk is worth the same, so the estimate is π a²/z² whatever the number
/// of rays: what is left is the sum's rounding, half a unit of f32 (6e-8), and the disk's own size (a/z)² = 1e-12.
#[test]
fn one_ray_and_a_million_in_a_pixel_have_the_same_sum() {
    let camera = bare(Subpixels::SINGLE, (1, 1), 1e-3, 1000.0);
    let wall = white();
    let closed_form = std::f64::consts::PI * 1e-12;
    for rays in [1, 2, 3, 255, 257, 1_000_000] {
        let image = shoot(&camera, &wall, rays).image;
        for &e in image.mosaic.pixel(0, 0) {
            assert!(
                (f64::from(e) / closed_form - 1.0).abs() < 1e-7,
                "{rays}: {e}"
            );
        }
    }
}

/// Boxes part the light without loss: the sub-pixels of every m×n add up to the undivided pixel, to the rounding of 16
/// f32 terms.
#[test]
fn parted_pixels_add_up_to_the_whole_one_for_any_number_of_rays() {
    let wall = white();
    for rays in [1, 7, 4096] {
        let whole = shoot(&bare(Subpixels::SINGLE, (3, 3), 0.5, 10.0), &wall, rays);
        for subpixels in Subpixels::SIMULATED {
            let parted = shoot(&bare(subpixels, (3, 3), 0.5, 10.0), &wall, rays);
            let pairs = parted.image.sum();
            for (a, b) in pairs.data().iter().zip(whole.image.sum().data()) {
                assert!((a / b - 1.0).abs() < 1e-6, "{subpixels} {rays}: {a} {b}");
            }
        }
    }
}

/// No light: zeros, not one NaN, and no spread is told.
#[test]
fn a_dark_scene_is_black_and_says_nothing_of_its_spread() {
    let camera = bare(Subpixels::QUAD, (16, 16), 0.5, 10.0);
    let dark = shoot(&camera, &Scene::default(), 16);
    assert!(dark.image.mosaic.data().iter().all(|&x| x == 0.0));
    assert_eq!(dark.stats.errors, None);
    assert_eq!(dark.stats.lost.total(), 0);
}

/// One texel of 1e6 on a black card: every value is finite and 1e6 times that of a texel of 1, to the rounding of f32:
/// 4e-7 of the value, and 1e-7 of what a pixel full of the texel has, as bilinear weights are differences. Pixels that
/// do not see it stay exactly 0.
#[test]
fn one_bright_texel_of_a_million_is_linear() {
    let camera = bare(Subpixels::QUAD, (16, 16), 0.4, 10.0);
    let lit = |value: f32| {
        let texture = Texture::from_fn(16, 16, |x, y| [if (x, y) == (9, 6) { value } else { 0.0 }]);
        let place = DVec3::new(0.0, 0.0, -5.0);
        let card = TexturedPlane::new(
            place,
            (1.0, 1.0),
            (0.0, 0.0, 0.0),
            Arc::new(texture.unwrap()),
            None,
        );
        shoot(&camera, &Scene::new(vec![card.unwrap()], [0.0; 3]), 256).image
    };
    let (one, million) = (lit(1.0), lit(1e6));
    let full = shoot(&camera, &white(), 256).image;
    let full = full.mosaic.data().iter().cloned().fold(0.0, f32::max);
    let mut seen = 0;
    for (a, b) in one.mosaic.data().iter().zip(million.mosaic.data()) {
        assert!(b.is_finite() && (*a == 0.0) == (*b == 0.0), "{a} {b}");
        if *a > 0.0 {
            seen += 1;
            assert!((b / 1e6 - a).abs() < 1e-7 * full + 4e-7 * a, "{a} {b}");
        }
    }
    assert!(seen > 100, "{seen}");
}
