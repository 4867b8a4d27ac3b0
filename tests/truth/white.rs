use quadpixel::render::truth::WhiteField;

use super::CASES;
use super::shots::{boxes, shoot, wave_pixel, white};

/// Mean and largest relative difference of the shading and a rendered white wall, per sub-pixel and channel, over blocks of
/// the window that average the render's noise.
#[test]
fn shading_is_what_a_white_wall_gives_to_a_thousandth() {
    const SIDE: usize = 32;
    for case in &CASES {
        let lens = case.focused();
        for response in [boxes(2, 2, case.pitch_um, 2.5 * case.pitch_um), wave_pixel()] {
            for field in [0, 2] {
                let camera = case.camera(&lens, &response, field, SIDE);
                let image = shoot(&camera, &white(), 1024, 7).image;
                let told = WhiteField::new(&camera).of_subpixels_sr(camera.sensor());
                for (i, told) in told.iter().enumerate() {
                    let view = image.view(i);
                    for channel in 0..3 {
                        let sum = |image: &quadpixel::image::Image| {
                            let values = image.data().iter().skip(channel).step_by(3);
                            values.map(|&v| f64::from(v)).sum::<f64>()
                        };
                        let ratio = sum(told) / sum(&view);
                        assert!((ratio - 1.0).abs() <= 1e-3, "{} {field} sub-pixel {i}, channel {channel}: {ratio}", case.lens);
                    }
                }
            }
        }
    }
}
