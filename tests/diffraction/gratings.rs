//! Contrast of rendered gratings with and without diffraction.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::lens::{Clipping, OpticalSystem, chief_ray};
use quadpixel::render::Camera;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

use crate::pupil::Pupil;
use crate::shots::{boxes, camera, focused, shoot, white};

const FOCUS_MM: f64 = 750.0;
const PITCH_UM: f64 = 0.7;
const SIZE: (usize, usize) = (64, 16);

/// Where the chief ray of a place meets the depth in focus, x and y.
fn seen(system: &OpticalSystem, place: DVec2) -> DVec2 {
    let start = chief_ray(system, place.x, place.y).unwrap();
    let ray = quadpixel::lens::trace_visiting(
        system,
        start,
        quadpixel::lens::Travel::Backward,
        Clipping::Off,
        |_, _| {},
    );
    let ray = ray.unwrap();
    let t = (-FOCUS_MM - ray.origin_mm.z) / ray.direction.z;
    (ray.origin_mm + t * ray.direction).truncate()
}

/// An upright grating across x around `centre`, `period_mm` long in the scene.
fn grating(centre: DVec2, period_mm: f64) -> Scene {
    const TEXELS: usize = 16;
    const PERIODS: usize = 64;
    let texture = Texture::from_fn(TEXELS * PERIODS, 4, |x, _| {
        let phase = std::f64::consts::TAU * (x as f64 + 0.5) / TEXELS as f64;
        [0.5 + 0.4 * phase.cos() as f32; 3]
    });
    let width = period_mm * PERIODS as f64;
    let plane = TexturedPlane::new(
        DVec3::new(centre.x, centre.y, -FOCUS_MM),
        (width, width),
        (0.0, 0.0, 0.0),
        Arc::new(texture.unwrap()),
        None,
    );
    Scene::new(vec![plane.unwrap()], [0.5; 3])
}

/// Amplitude of the part of a period in green over the mean, by least squares.
fn contrast(camera: &Camera, scene: &Scene, period_px: f64) -> f64 {
    let image = shoot(camera, scene, 1024, 3).image.mosaic;
    let (mut sum, mut cosine, mut sine) = (0.0, 0.0, 0.0);
    // Whole periods.
    let columns = ((SIZE.0 as f64 / period_px).floor() * period_px).round() as usize;
    for row in 0..SIZE.1 {
        for column in 0..columns {
            let value = f64::from(image.pixel(column, row)[1]);
            let phase = std::f64::consts::TAU * column as f64 / period_px;
            sum += value;
            cosine += value * phase.cos();
            sine += value * phase.sin();
        }
    }
    2.0 * cosine.hypot(sine) / sum
}

#[test]
fn gratings_lose_the_contrast_that_the_aperture_takes() {
    for (name, place, period_px) in [
        ("wide_US20120327520A1_emb3", DVec2::ZERO, 8.0),
        ("wide_US20120327520A1_emb3", DVec2::ZERO, 4.0),
        ("wide_US20120327520A1_emb3", DVec2::new(1.6, 1.2), 8.0),
        ("tele_US10571665B2_220b", DVec2::new(1.2, 0.9), 8.0),
    ] {
        let lens = focused(name, FOCUS_MM);
        let pixel = boxes(1, 1, PITCH_UM, 1.0);
        let rays = camera(&lens, &pixel, SIZE, place);
        let waves = rays.clone().with_lens_diffraction();
        let green_nm = rays.wavelengths().rgb_nm[1];
        let system = lens.at(green_nm).unwrap();
        let step = DVec2::new(1e-3, 0.0);
        let scale = (seen(&system, place + step) - seen(&system, place - step))
            .x
            .abs()
            / 2e-3;
        let scene = grating(seen(&system, place), period_px * PITCH_UM * 1e-3 * scale);
        let ratio = contrast(&waves, &scene, period_px) / contrast(&rays, &scene, period_px);
        // The frequency on the grid of directions, from the two whole numbers of cells around it.
        let pupil = Pupil::new(&system, place, FOCUS_MM, 256);
        let cells = green_nm * 1e-3 / (period_px * PITCH_UM) / pupil.step;
        let at = |cells: usize| {
            let [waves, product, overlap] = pupil
                .transfer((cells, 0), green_nm * 1e-6)
                .map(DVec2::length);
            DVec3::new(waves, product / overlap, overlap)
        };
        let (low, part) = (cells.floor() as usize, cells.fract());
        let [waves, alone, overlap] = at(low).lerp(at(low + 1), part).to_array();
        let (rendered, plain) = (ratio * alone, overlap * alone);
        println!(
            "{name} {place} {period_px} px: rendered {rendered:.3}, waves {waves:.3}; rays alone {alone:.3}, \
             independent draw {plain:.3}"
        );
        let error = (rendered - waves).abs();
        assert!(error < 0.02, "{name} {place}: {rendered} {waves}");
        assert!(
            error < (plain - waves).abs().max(0.01),
            "{name} {place}: {rendered} {waves} {plain}"
        );
    }
}

#[test]
fn an_even_wall_keeps_its_light_and_runs_are_repeatable() {
    let lens = focused("wide_US20120327520A1_emb3", FOCUS_MM);
    let pixel = boxes(2, 2, 1.6, 1.0);
    let rays = camera(&lens, &pixel, (16, 12), DVec2::new(1.5, 1.0));
    let waves = rays.clone().with_lens_diffraction();
    let [a, b, c] = [&rays, &waves, &waves].map(|c| shoot(c, &white(), 256, 5).image.mosaic);
    assert_eq!(b.data(), c.data());
    let sum =
        |image: &quadpixel::image::Image| image.data().iter().map(|&v| f64::from(v)).sum::<f64>();
    assert!(
        (sum(&b) / sum(&a) - 1.0).abs() < 2e-3,
        "{} {}",
        sum(&a),
        sum(&b)
    );
}
