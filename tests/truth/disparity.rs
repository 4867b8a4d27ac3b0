use glam::DVec2;
use quadpixel::render::truth::DisparityField;
use quadpixel::render::{Camera, RayRecord, Render, RenderSettings};

use super::shots::{boxes, wave_pixel};
use super::{CASES, bias_and_rms, centroid, depths_mm, spot};

const LAYOUTS: [(usize, usize); 5] = [(1, 1), (2, 1), (2, 2), (3, 3), (4, 4)];
const SIDE: usize = 40;
const RAYS: usize = 1024;

/// A spot nearer and farther than the focus, with the rays that are traced for it. Cameras with another pixel get the
/// same rays.
struct Kept {
    depth_mm: f64,
    rays: RayRecord,
}

fn kept(camera: &Camera, coc_px: f64) -> Vec<Kept> {
    let rays = |(sign, depth_mm): (usize, f64)| {
        let scene = spot(camera, depth_mm, 12.0);
        let settings = RenderSettings {
            rays_per_pixel: RAYS,
            seed: 3 + sign as u64,
        };
        let rendered = Render::new(camera, &scene, &settings).run_recorded();
        let (_, rays) = rendered.unwrap();
        Kept { depth_mm, rays }
    };
    let depths = depths_mm(camera, coc_px).into_iter().enumerate();
    depths.map(rays).collect()
}

/// Differences of measured and told (x, y) shifts of each view from its own channel's sum, over the channels.
fn differences(camera: &Camera, kept: &[Kept]) -> Vec<f64> {
    let fields = DisparityField::of_channels(camera).unwrap();
    let mut all = Vec::new();
    for Kept { depth_mm, rays } in kept {
        let image = rays.develop(camera).unwrap().image;
        let (sum, count) = (image.sum(), image.subpixels.count());
        for channel in 0..3 {
            let field = &fields[channel.min(fields.len() - 1)];
            let middle = centroid(&sum, channel);
            let mut told = vec![DVec2::ZERO; count];
            let place = camera.sensor().position_mm(middle.x, middle.y);
            field.traced_px(place, *depth_mm, &mut told);
            for (i, told) in told.iter().enumerate() {
                let measured = centroid(&image.view(i), channel) - middle;
                all.extend((measured - *told).to_array());
            }
        }
    }
    all
}

#[test]
fn views_of_every_channel_stand_where_their_own_disparity_says() {
    for case in &CASES {
        let lens = case.focused();
        let mut all = LAYOUTS.map(|_| Vec::new());
        for field in 0..3 {
            let pixel = |(m, n)| boxes(m, n, case.pitch_um, case.focal_um);
            let camera = |layout| case.camera(&lens, &pixel(layout), field, SIDE);
            let kept = kept(&camera((2, 2)), 4.0);
            for (layout, all) in LAYOUTS.into_iter().zip(&mut all) {
                // The other layouts in one field.
                if layout == (2, 2) || field == 1 {
                    all.extend(differences(&camera(layout), &kept));
                }
            }
        }
        for ((m, n), all) in LAYOUTS.into_iter().zip(&all) {
            let (bias, rms) = bias_and_rms(all);
            println!("{} {m}x{n}: bias {bias:.4} px, RMS {rms:.4} px", case.lens);
            assert!(
                bias.abs() <= 0.005 && rms <= 0.02,
                "{} {m}x{n}: {bias} {rms}",
                case.lens
            );
        }
    }
}

#[test]
fn so_they_do_behind_a_wave_optical_pixel() {
    let case = &CASES[0];
    let lens = case.focused();
    let response = wave_pixel();
    let mut all = Vec::new();
    for field in 0..3 {
        let camera = case.camera(&lens, &response, field, SIDE);
        all.extend(differences(&camera, &kept(&camera, 4.0)));
    }
    let (bias, rms) = bias_and_rms(&all);
    println!("wave pixel: bias {bias:.4} px, RMS {rms:.4} px");
    assert!(bias.abs() <= 0.005 && rms <= 0.02, "{bias} {rms}");
}

#[test]
fn red_and_blue_do_not_stand_where_green_does() {
    // What the suite above would let through if the channels' truths were green's.
    let case = &CASES[0];
    let camera = case.camera(&case.focused(), &boxes(2, 1, 2.0, 5.0), 1, 8);
    let fields = DisparityField::of_channels(&camera).unwrap();
    let place = camera.sensor().centre_mm();
    let [near, _] = depths_mm(&camera, 4.0);
    let left_right = |channel: usize| {
        let mut shifts = [DVec2::ZERO; 2];
        fields[channel].traced_px(place, near, &mut shifts);
        shifts[0].x - shifts[1].x
    };
    let (red, green, blue) = (left_right(0), left_right(1), left_right(2));
    assert!(
        (red - green).abs() > 0.03 && (blue - green).abs() > 0.03,
        "{red} {green} {blue}"
    );
}
