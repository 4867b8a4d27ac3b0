//! Which view had less light: a converter that makes both views equally bright cannot take back the noise of the darker
//! one.
//!
//! The finest detail, second differences along both axes (white noise of variance 1 has a variance of 1 in it), is
//! mostly noise in the quietest blocks of a picture. Its variance in the left view over that in the right one, green,
//! in codes of 8 bits; rounding adds 1/12 to both.

use quadpixel::image::Image;
use quadpixel::image::srgb::from_linear;

use crate::data::Views;
use crate::measure::GREEN;

/// Parts of the picture's width.
pub const PARTS: usize = 6;
/// Side of a block, px.
const BLOCK: usize = 16;
/// Part of the blocks that counts.
const QUIET: f64 = 0.3;

/// Variance of the left over that of the right view, by parts of the width.
pub fn left_over_right(views: &Views) -> [f64; PARTS] {
    let fine = [&views.left, &views.right].map(detail);
    let (width, height) = (fine[0].width() / BLOCK, fine[0].height() / BLOCK);
    let variance = |image: &Image, bx: usize, by: usize| {
        let pixels = (0..BLOCK * BLOCK).map(|k| (bx * BLOCK + k % BLOCK, by * BLOCK + k / BLOCK));
        let sum: f64 = pixels
            .map(|(x, y)| f64::from(image.pixel(x, y)[0]).powi(2))
            .sum();
        sum / (BLOCK * BLOCK) as f64
    };
    std::array::from_fn(|part| {
        let columns = part * width / PARTS..(part + 1) * width / PARTS;
        let mut blocks: Vec<[f64; 2]> = columns
            .flat_map(|bx| (0..height).map(move |by| (bx, by)))
            .map(|(bx, by)| [0, 1].map(|i| variance(&fine[i], bx, by)))
            .collect();
        blocks.sort_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])));
        blocks.truncate((QUIET * blocks.len() as f64).ceil() as usize);
        let sum = |i: usize| blocks.iter().map(|b| b[i]).sum::<f64>();
        sum(0) / sum(1)
    })
}

/// Second differences of the green codes along both axes, over 6; without the border.
fn detail(view: &Image) -> Image {
    let (width, height) = (view.width(), view.height());
    let code = |x: usize, y: usize| 255.0 * f64::from(from_linear(view.pixel(x, y)[GREEN]));
    let mut out = Image::zeros(width - 2, height - 2, 1);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let row = |y: usize| code(x - 1, y) - 2.0 * code(x, y) + code(x + 1, y);
            out.pixel_mut(x - 1, y - 1)[0] =
                ((row(y - 1) - 2.0 * row(y) + row(y + 1)) / 6.0) as f32;
        }
    }
    out
}
