use glam::DVec2;
use quadpixel::render::truth::DisparityField;

use super::shots::{boxes, shoot, wave_pixel};
use super::{CASES, bias_and_rms, centroid, depths_mm, spot};

const LAYOUTS: [(usize, usize); 5] = [(1, 1), (2, 1), (2, 2), (3, 3), (4, 4)];
const SIDE: usize = 40;
const RAYS: usize = 1024;

/// Differences of measured and told (x, y) shifts of each view from its own channel's sum, over the channels.
fn differences(camera: &quadpixel::render::Camera, coc_px: f64) -> Vec<f64> {
    let fields = DisparityField::of_channels(camera).unwrap();
    let mut all = Vec::new();
    for (sign, depth_mm) in depths_mm(camera, coc_px).into_iter().enumerate() {
        let scene = spot(camera, depth_mm, 12.0);
        let image = shoot(camera, &scene, RAYS, 3 + sign as u64).image;
        let (sum, count) = (image.sum(), image.subpixels.count());
        for channel in 0..3 {
            let field = &fields[channel.min(fields.len() - 1)];
            let middle = centroid(&sum, channel);
            let mut told = vec![DVec2::ZERO; count];
            let place = camera.sensor().position_mm(middle.x, middle.y);
            field.traced_px(place, depth_mm, &mut told);
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
        for (m, n) in LAYOUTS {
            let response = boxes(m, n, case.pitch_um, case.focal_um);
            let mut all = Vec::new();
            for field in 0..3 {
                // The other layouts in one field: their rays are the same.
                if (m, n) != (2, 2) && field != 1 {
                    continue;
                }
                let camera = case.camera(&lens, &response, field, SIDE);
                all.extend(differences(&camera, 4.0));
            }
            let (bias, rms) = bias_and_rms(&all);
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
        all.extend(differences(&camera, 4.0));
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
