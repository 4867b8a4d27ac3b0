use quadpixel::image::Image;
use quadpixel::render::truth::WhiteField;

use super::CASES;
use super::shots::{boxes, shoot, wave_pixel, white};

/// Of the mean over a window, which the render's noise leaves within some 1e-4. Edges of the ideal pixel's boxes are
/// found by rays less well than a wave-optical response is.
#[test]
fn shading_is_what_a_white_wall_gives_to_a_thousandth() {
    const SIDE: usize = 32;
    for case in &CASES {
        let lens = case.focused();
        let ideal = boxes(2, 2, case.pitch_um, 2.5 * case.pitch_um);
        for (response, bound) in [(ideal, 2.5e-3), (wave_pixel(), 1e-3)] {
            for field in [0, 2] {
                let camera = case.camera(&lens, &response, field, SIDE);
                let image = shoot(&camera, &white(), 1024, 7).image;
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
                    "{} at {} mm: {worst:.5} of {bound}",
                    case.lens, case.heights_mm[field]
                );
                assert!(worst <= bound, "{} {field}: {worst}", case.lens);
            }
        }
    }
}
