//! Prints how much of the light from each angle the left and the right half of a quad pixel take: the curve that makes
//! depth from one shot possible.
//!
//! `cargo run --release --example pixel_response`
//!
//! Expect a line per angle of incidence in the horizontal plane: the left half takes all light from the one side, the
//! right half all from the other, and beyond the pixel's edge nothing is left. A real pixel's table, by
//! `qpgen response`, has soft edges and losses.

use quadpixel::image::views::Side;
use quadpixel::response::GeometricResponse;
use quadpixel::sensor::Subpixels;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let subpixels = Subpixels::new(2, 2)?;
    let pixel = GeometricResponse::new(subpixels, 2.8, 5.6)?;
    println!("angle (deg)   left  right");
    for angle_deg in (-20..=20).step_by(4) {
        let u = f64::from(angle_deg).to_radians().sin() as f32;
        let mut absorbed = [0.0; 4];
        // A little off the horizontal plane, on which the upper and the lower half meet.
        pixel.weights(u, 0.01, &mut absorbed);
        let half = |side: Side| -> f32 {
            let members = side.members(subpixels);
            members.into_iter().map(|subpixel| absorbed[subpixel]).sum()
        };
        let (left, right) = (half(Side::Left), half(Side::Right));
        println!("{angle_deg:11}   {left:.2}   {right:.2}");
    }
    Ok(())
}
