use quadpixel::image::Image;
use quadpixel::render::truth::WhiteField;

use super::CASES;
use super::shots::{boxes, shoot, wave_pixel, white};

/// Of the mean over a window, which the render's noise leaves within some 1e-4.
#[test]
fn shading_is_what_a_white_wall_gives_to_a_thousandth() {
    const SIDE: usize = 32;
    const BOUND: f64 = 1e-3;
    for case in &CASES {
        let lens = case.focused();
        let ideal = boxes(2, 2, case.pitch_um, 2.5 * case.pitch_um);
        for response in [ideal, wave_pixel()] {
            for field in [0, 2] {
                let camera = case.camera(&lens, &response, field, SIDE);
                let image = shoot(&camera, &white(), 2048, 7).image;
                let told = WhiteField::new(&camera).of_subpixels_sr(camera.sensor());
                let mut worst: f64 = 0.0;
                for (i, told) in told.iter().enumerate() {
                    let view = image.view(i);
                    for channel in 0..3 {
                        let sum = |image: &Image| {
                            let values = image.data().iter().skip(channel).step_by(3);
                            values.map(|&v| f64::from(v)).sum::<f64>()
                        };
                        worst = worst.max((sum(told) / sum(&view) - 1.0).abs());
                    }
                }
                println!(
                    "{} at {} mm: {worst:.5} of {BOUND}",
                    case.lens, case.heights_mm[field]
                );
                assert!(worst <= BOUND, "{} {field}: {worst}", case.lens);
            }
        }
    }
}
