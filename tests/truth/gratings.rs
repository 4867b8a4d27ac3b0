use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::image::Image;
use quadpixel::render::truth::DisparityField;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

use super::depths_mm;
use super::shots::{PHONE, camera, focused, shoot, wave_pixel};

/// Six of the longest periods: under a Hann window the mean then leaks into no phase.
const WIDTH: usize = 270;

fn hann(x: usize, columns: &Range<usize>) -> f64 {
    1.0 - (TAU * ((x - columns.start) as f64 + 0.5) / columns.len() as f64).cos()
}

/// Phase of the green channel at a period, px, under a Hann window over some columns.
fn phase(image: &Image, period_px: f64, columns: Range<usize>) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for x in columns.clone() {
        let rows = 0..image.height();
        let column: f64 = rows.map(|y| f64::from(image.pixel(x, y)[1])).sum();
        let (sin, cos) = (TAU * x as f64 / period_px).sin_cos();
        re += hann(x, &columns) * column * cos;
        im += hann(x, &columns) * column * sin;
    }
    im.atan2(re)
}

/// The period in the picture, px, near a nominal one: by the phases of its two halves.
fn period_of(image: &Image, nominal_px: f64) -> f64 {
    let half = image.width() / 2;
    let [left, right] = [0..half, half..2 * half].map(|c| phase(image, nominal_px, c) / TAU);
    let turns = right - left - (right - left).round();
    // A place x has the phase x/P − x/nominal, in turns.
    1.0 / (1.0 / nominal_px - turns / half as f64)
}

/// SPEC.md, "Matched shift": what any matcher finds between two views of a grating is the difference of their phases.
/// Made anew here as the table of docs/claims.md.
#[test]
fn a_coarse_grating_is_matched_where_the_centroids_are_and_a_fine_one_is_not() {
    let lens = focused(PHONE, 500.0);
    let response = wave_pixel();
    let camera = camera(&lens, &response, (WIDTH, 8), DVec2::ZERO);
    let field = DisparityField::new(&camera, 1).unwrap();
    let left_right = [&[0usize, 2][..], &[1, 3]];
    let p = camera.paraxial().unwrap();
    for coc_px in [3.0, 8.0] {
        let [depth_mm, _] = depths_mm(&camera, coc_px);
        // The mean over the window, under the weight of the phase.
        let (mut told, mut weights) = (0.0, 0.0);
        for x in 0..WIDTH {
            let place = camera.sensor().position_mm(x as f64, 3.5);
            let [left, right] = left_right.map(|group| field.group_px(place, depth_mm, group).1.x);
            told += hann(x, &(0..WIDTH)) * (left - right);
            weights += hann(x, &(0..WIDTH));
        }
        told /= weights;
        let mut differences = Vec::new();
        for period_px in [5.6, 8.4, 17.0, 45.0] {
            let magnification = p.exit_pupil_semi_mm / p.entrance_pupil_semi_mm;
            let focal_mm = (camera.sensor_z_mm() - p.exit_pupil_z_mm) / magnification;
            let px_mm = camera.sensor().pitch_mm() * (depth_mm + p.entrance_pupil_z_mm) / focal_mm;
            let side_mm = 2.0 * WIDTH as f64 * px_mm;
            let texels = 4096;
            let wave = |x: usize| {
                let at_px = (x as f64 + 0.5) / texels as f64 * 2.0 * WIDTH as f64;
                (0.5 + 0.4 * (TAU * at_px / period_px).cos()) as f32
            };
            let texture = Texture::from_fn(texels, 1, |x, _| [wave(x)]).unwrap();
            let centre = DVec3::new(0.0, 0.0, -depth_mm);
            let card = TexturedPlane::new(
                centre,
                (side_mm, side_mm),
                (0.0, 0.0, 0.0),
                Arc::new(texture),
                None,
            );
            let scene = Scene::new(vec![card.unwrap()], [0.0; 3]);
            let image = shoot(&camera, &scene, 1024, 9).image;
            let view = |group: &[usize]| {
                let views: Vec<Image> = group.iter().map(|&i| image.view(i)).collect();
                quadpixel::image::views::sum_of(&views).unwrap()
            };
            let [left, right] = left_right.map(|group| phase(&view(group), period_px, 0..WIDTH));
            let turns = (left - right) / TAU;
            let matched = (turns - turns.round()) * period_of(&image.sum(), period_px);
            println!(
                "coc {coc_px} px, period {period_px} px: centroids {told:.4}, matched {matched:.4}, difference {:.4} px",
                matched - told
            );
            differences.push(matched - told);
        }
        let [finest, _, coarse, coarsest] = differences[..] else {
            unreachable!("four gratings");
        };
        assert!(coarsest.abs() < 0.02 * told, "{coc_px}: {differences:?}");
        assert!(coarse > 2.0 * coarsest.abs(), "{coc_px}: {differences:?}");
        // Beyond the blur's first zero a grating shows nothing that could be matched.
        assert!(
            coc_px > 5.0 || finest > 0.1 * told,
            "{coc_px}: {differences:?}"
        );
    }
}
