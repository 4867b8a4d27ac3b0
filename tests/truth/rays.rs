use glam::DVec2;
use quadpixel::image::Image;
use quadpixel::image::views::Side;
use quadpixel::render::truth::DisparityField;
use quadpixel::render::{Camera, Render, RenderSettings, blur_rays};
use quadpixel_datasets::BlurRays;

use super::shots::{boxes, wave_pixel};
use super::{CASES, centroid, depths_mm, spot};

/// Mean of what rays of these weights show at `depth_mm`, px, and the variance along x and y.
fn moments(rays: &BlurRays, weights: &[f64], camera: &Camera, depth_mm: f64) -> [DVec2; 2] {
    let pupil_mm = camera.paraxial().unwrap().entrance_pupil_z_mm;
    let per_m = |depth_mm: f64| 1e3 / (depth_mm + pupil_mm);
    let t = per_m(depth_mm) - per_m(camera.focus_distance_mm());
    let (mut all, mut sum, mut squares) = (0.0, DVec2::ZERO, DVec2::ZERO);
    for ((x, y), w) in rays.x_px.iter().zip(&rays.y_px).zip(weights) {
        let at = -DVec2::new(x[0] + x[1] * t, y[0] + y[1] * t);
        all += w;
        sum += *w * at;
        squares += *w * at * at;
    }
    let mean = sum / all;
    [mean, squares / all - mean * mean]
}

fn variance(image: &Image, channel: usize) -> DVec2 {
    let middle = centroid(image, channel);
    let (mut sum, mut total) = (DVec2::ZERO, 0.0);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let w = f64::from(image.pixel(x, y)[channel]);
            let away = DVec2::new(x as f64, y as f64) - middle;
            sum += w * away * away;
            total += w;
        }
    }
    sum / total
}

/// Each case's camera half-way out; the phones' also with a wave-optical pixel, which is a phone's.
fn cameras() -> impl Iterator<Item = (&'static str, Camera)> {
    CASES.iter().enumerate().flat_map(|(number, case)| {
        let lens = case.focused();
        let ideal = boxes(2, 2, case.pitch_um, case.focal_um);
        let wave = (number < 2).then(wave_pixel);
        let responses = [Some(ideal), wave].into_iter().flatten();
        let camera = |response| (case.lens, case.camera(&lens, &response, 1, 48));
        responses.map(camera).collect::<Vec<_>>()
    })
}

#[test]
fn the_rays_of_opposite_halves_stand_apart_by_the_disparity() {
    for (lens, camera) in cameras() {
        let rays = blur_rays(&camera).unwrap();
        assert!(rays.is_sound() && rays.displaced_px.is_empty(), "{lens}");
        let fields = DisparityField::of_channels(&camera).unwrap();
        let field = &fields[1.min(fields.len() - 1)];
        for depth_mm in depths_mm(&camera, 8.0) {
            let mut told = vec![DVec2::ZERO; 4];
            field.traced_px(camera.sensor().centre_mm(), depth_mm, &mut told);
            let mean = |weights| moments(&rays, weights, &camera, depth_mm)[0];
            let across = (mean(&rays.left) - mean(&rays.right)).x;
            let down = (mean(&rays.top) - mean(&rays.bottom)).y;
            let half = |side: Side| {
                let members = side.members(camera.sensor().subpixels());
                let sum: DVec2 = members.iter().map(|&i| told[i]).sum();
                sum / members.len() as f64
            };
            let wanted = [
                (half(Side::Left) - half(Side::Right)).x,
                (half(Side::Top) - half(Side::Bottom)).y,
            ];
            for (found, wanted) in [across, down].into_iter().zip(wanted) {
                let allowed = 0.02 + 0.02 * wanted.abs();
                assert!(
                    (found - wanted).abs() < allowed,
                    "{lens}, {depth_mm}: {found} {wanted}"
                );
            }
        }
    }
}

#[test]
fn they_spread_a_spot_as_a_render_does() {
    for (lens, camera) in cameras() {
        let rays = blur_rays(&camera).unwrap();
        let all: Vec<f64> = (rays.left.iter().zip(&rays.right))
            .map(|(l, r)| l + r)
            .collect();
        let settings = RenderSettings {
            rays_per_pixel: 1024,
            seed: 5,
        };
        let rendered = |depth_mm| {
            let scene = spot(&camera, depth_mm, 12.0);
            let rendered = Render::new(&camera, &scene, &settings).run();
            variance(&rendered.image.sum(), 1)
        };
        let of_rays = |depth_mm| moments(&rays, &all, &camera, depth_mm)[1];
        let focus_mm = camera.focus_distance_mm();
        let in_focus = rendered(focus_mm) - of_rays(focus_mm);
        for depth_mm in depths_mm(&camera, 8.0) {
            let off = rendered(depth_mm) - in_focus - of_rays(depth_mm);
            let allowed = 0.02 + 0.01 * of_rays(depth_mm).max_element();
            assert!(
                off.abs().max_element() < allowed,
                "{lens}, {depth_mm}: {off}"
            );
        }
    }
}
