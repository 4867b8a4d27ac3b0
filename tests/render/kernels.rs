//! Banks of kernels against the renderer's own picture of a small bright square, and against the disparity's truth.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::render::kernels::{BankPlan, Footprint, KernelBank};
use quadpixel::render::truth::{DisparityField, SightRays};
use quadpixel::render::{Camera, RenderSettings, SubPixelImage, render};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

use crate::{geometric, shots};

/// Pixels of the window's sides, and of the square in its middle.
const WINDOW: usize = 27;
const SQUARE: usize = 5;

fn bank(camera: &Camera, fields: &[DisparityField], depth_mm: f64, rays: usize) -> KernelBank {
    let plan = BankPlan {
        nodes: (2, 2),
        inverse_depths_per_mm: vec![1.0 / depth_mm],
        rays,
        footprint: Footprint::Pixel,
        cut_share: 0.0,
    };
    KernelBank::new(camera, &SightRays::centroids(fields), fields, &plan).unwrap()
}

/// A card that the middle of the window shows as a square of `side_px`, of radiance 1.
fn square(field: &DisparityField, camera: &Camera, depth_mm: f64, side_px: f64) -> Scene {
    let middle = camera.sensor().centre_mm();
    let half = 0.5 * side_px * camera.sensor().pitch_mm();
    let at = |d: DVec2| {
        let line = field.sight_line(middle + d);
        line.q0 * depth_mm + line.q1_mm
    };
    let size = (
        (at(DVec2::X * half) - at(-DVec2::X * half)).length(),
        (at(DVec2::Y * half) - at(-DVec2::Y * half)).length(),
    );
    let centre = at(DVec2::ZERO);
    let white = Arc::new(Texture::from_fn(1, 1, |_, _| [1.0]).unwrap());
    let place = DVec3::new(centre.x, centre.y, -depth_mm);
    let card = TexturedPlane::new(place, size, (0.0, 0.0, 0.0), white, None).unwrap();
    Scene::new(vec![card], [0.0; 3])
}

/// Energy and centroid (px from the middle) of the view of a sub-pixel, green.
fn moments(image: &SubPixelImage, subpixel: usize) -> (f64, DVec2) {
    let view = image.view(subpixel);
    let middle = DVec2::splat((WINDOW / 2) as f64);
    let (mut sum, mut first) = (0.0, DVec2::ZERO);
    for y in 0..WINDOW {
        for x in 0..WINDOW {
            let light = f64::from(view.pixel(x, y)[1]);
            sum += light;
            first += light * (DVec2::new(x as f64, y as f64) - middle);
        }
    }
    (sum, first / sum)
}

#[test]
fn a_rendered_square_has_the_energy_and_the_centroid_of_its_kernels() {
    let lens = shots::focused(shots::PHONE, 750.0);
    let pixel = geometric(2, 2, 3.5);
    for (place, depth_mm) in [
        (DVec2::ZERO, 750.0),
        (DVec2::ZERO, 320.0),
        (DVec2::new(0.9, -0.6), 320.0),
        (DVec2::new(0.9, -0.6), 4000.0),
    ] {
        let camera = shots::camera(&lens, &pixel, (WINDOW, WINDOW), place);
        // One channel's rays: the others' are alike in kind.
        let camera = camera.without_dispersion().unwrap();
        let fields = DisparityField::of_channels(&camera).unwrap();
        let bank = bank(&camera, &fields, depth_mm, 1 << 15);
        let settings = RenderSettings {
            rays_per_pixel: 1 << 13,
            seed: 5,
        };
        let scene = square(&fields[0], &camera, depth_mm, SQUARE as f64);
        let image = render(&camera, &scene, &settings).image;
        let (mut all, mut expected) = (0.0, 0.0);
        for subpixel in 0..4 {
            let (energy, centroid) = moments(&image, subpixel);
            let nodes = (0..4).map(|node| bank.figures(0, node, 0, subpixel));
            let figures: Vec<_> = nodes.collect();
            let mean = |f: fn(&quadpixel::render::kernels::LaneFigures) -> f64| {
                figures.iter().map(f).sum::<f64>() / 4.0
            };
            all += energy;
            expected += mean(|f| f.white_sr) * (SQUARE * SQUARE) as f64;
            let kernel = DVec2::new(mean(|f| f.centroid_px.x), mean(|f| f.centroid_px.y));
            let off = (centroid - kernel).length();
            assert!(
                off < 0.02,
                "{place} {depth_mm} {subpixel}: {centroid} {kernel}"
            );
        }
        let ratio = all / expected;
        assert!(
            (ratio - 1.0).abs() < 1e-3,
            "{place} {depth_mm}: energy {ratio}"
        );
    }
}

#[test]
fn a_rendered_square_is_the_sum_of_its_kernels_pixel_by_pixel() {
    let lens = shots::focused(shots::PHONE, 750.0);
    let camera = shots::camera(&lens, &geometric(2, 2, 3.5), (WINDOW, WINDOW), DVec2::ZERO);
    // With the aperture's diffraction, which both displace rays by.
    let camera = camera.without_dispersion().unwrap().with_lens_diffraction();
    let fields = DisparityField::of_channels(&camera).unwrap();
    let bank = bank(&camera, &fields, 320.0, 1 << 15);
    let settings = RenderSettings {
        rays_per_pixel: 1 << 14,
        seed: 9,
    };
    let scene = square(&fields[0], &camera, 320.0, SQUARE as f64);
    let image = render(&camera, &scene, &settings).image;
    let kernels = &bank.depths()[0];
    let support = kernels.support();
    for subpixel in 0..4 {
        let view = image.view(subpixel);
        let white_sr = bank.figures(0, 0, 0, subpixel).white_sr;
        let kept = 1.0 - kernels.beyond(0)[subpixel];
        let light = |column: i32, row: i32| {
            let (x, y) = (column - support.left, row - support.top);
            let inside =
                (0..support.width as i32).contains(&x) && (0..support.height as i32).contains(&y);
            let at = (y * support.width as i32 + x) as usize * bank.lanes() + subpixel;
            if inside {
                kept * f64::from(kernels.of_node(0)[at])
            } else {
                0.0
            }
        };
        let (middle, half) = ((WINDOW / 2) as i32, (SQUARE / 2) as i32);
        let (mut worst, mut squares): (f64, f64) = (0.0, 0.0);
        for y in 0..WINDOW as i32 {
            for x in 0..WINDOW as i32 {
                let sources = (-half..=half).flat_map(|j| (-half..=half).map(move |i| (i, j)));
                let sum: f64 = sources
                    .map(|(i, j)| light(x - middle - i, y - middle - j))
                    .sum();
                let rendered = f64::from(view.pixel(x as usize, y as usize)[1]) / white_sr;
                worst = worst.max((sum - rendered).abs());
                squares += (sum - rendered).powi(2);
            }
        }
        let rms = (squares / (WINDOW * WINDOW) as f64).sqrt();
        println!("{subpixel}: worst {worst}, RMS {rms}");
        assert!(
            worst < 0.02 && rms < 0.003,
            "{subpixel}: worst {worst}, RMS {rms}"
        );
    }
}

#[test]
fn the_centroids_are_the_disparity() {
    let lens = shots::focused(shots::PHONE, 500.0);
    let camera = shots::camera(
        &lens,
        &geometric(2, 2, 3.5),
        (400, 300),
        DVec2::new(0.5, 0.3),
    );
    let fields = DisparityField::of_channels(&camera).unwrap();
    let depths_mm = [200.0, 500.0, 2000.0, f64::INFINITY];
    let plan = BankPlan {
        nodes: (3, 3),
        inverse_depths_per_mm: depths_mm.map(|d| 1.0 / d).to_vec(),
        rays: 4096,
        footprint: Footprint::Sample,
        cut_share: 0.0,
    };
    let bank = KernelBank::new(&camera, &SightRays::centroids(&fields), &fields, &plan).unwrap();
    let mut traced = [DVec2::ZERO; 4];
    for (d, depth_mm) in depths_mm.into_iter().enumerate() {
        for node in 0..9 {
            fields[1].traced_px(bank.node_mm(node), depth_mm, &mut traced);
            for (subpixel, expected) in traced.into_iter().enumerate() {
                let kernel = bank.figures(d, node, 1, subpixel);
                let off = (kernel.centroid_px - expected).length();
                assert!(
                    off < 0.02,
                    "{depth_mm} {node} {subpixel}: {kernel:?} {expected}"
                );
            }
        }
    }
}
