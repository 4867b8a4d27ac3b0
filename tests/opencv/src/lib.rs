//! The algorithms side by side with OpenCV: what the tests and the benchmark share.
//!
//! OpenCV is an independent code, not a reference for truth: where it rounds or stops early the tests say so.

pub mod accuracy;
pub mod convert;
#[path = "../../../algorithms/tests/matching/texture.rs"]
mod texture;

use quadpixel::image::Image;
use texture::{Lcg, Texture, picture};

/// Blur (Gaussian σ) of the textures, px.
pub const BLUR_PX: f64 = 0.85;

/// `count` uniform numbers in [0, 1).
pub fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let mut lcg = Lcg(seed);
    (0..count).map(|_| lcg.uniform()).collect()
}

/// White noise blurred by [`BLUR_PX`], and the same moved right and down by `shift_px` in the Fourier domain; normal noise of
/// deviation `noise` in both, each its own. `side` is odd.
pub fn pair(side: usize, seed: u64, shift_px: [f64; 2], noise: f64) -> [Image; 2] {
    let texture = Texture::white(side, side, seed);
    let still = texture.render(BLUR_PX, [0.0, 0.0], None);
    let moved = texture.render(BLUR_PX, shift_px, None);
    [
        picture(side, &still, 1.0, 0.0, noise, seed ^ 0xa),
        picture(side, &moved, 1.0, 0.0, noise, seed ^ 0xb),
    ]
}
