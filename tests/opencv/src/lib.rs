//! The algorithms side by side with OpenCV: what the tests and the benchmark share.
//!
//! OpenCV is an independent code, not a reference for truth: where it rounds or stops early the tests say so.
#![cfg(feature = "opencv")]

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

/// What sets B apart from A beside the shift.
#[derive(Clone, Copy, Debug)]
pub struct Change {
    /// Deviation of the normal noise in both pictures, each its own, on textures in 0..1.
    pub noise: f64,
    /// Factor on B's values.
    pub gain: f64,
    /// What is added to them.
    pub offset: f64,
}

impl Change {
    /// The same light on both, with `noise`.
    pub const fn noise(noise: f64) -> Self {
        Self {
            noise,
            gain: 1.0,
            offset: 0.0,
        }
    }
}

/// What the matchers are compared at: no noise, 1 %, and 1 % where B is darker and lifted.
pub const CHANGES: [Change; 3] = [
    Change::noise(0.0),
    Change::noise(0.01),
    Change {
        noise: 0.01,
        gain: 0.8,
        offset: 0.05,
    },
];

/// White noise blurred by [`BLUR_PX`], and the same moved right and down by `shift_px` in the Fourier domain and
/// changed. `side` is odd.
pub fn pair(side: usize, seed: u64, shift_px: [f64; 2], change: Change) -> [Image; 2] {
    let texture = Texture::white(side, side, seed);
    let still = texture.render(BLUR_PX, [0.0, 0.0], None);
    let moved = texture.render(BLUR_PX, shift_px, None);
    let Change {
        noise,
        gain,
        offset,
    } = change;
    [
        picture(side, &still, 1.0, 0.0, noise, seed ^ 0xa),
        picture(side, &moved, gain, offset, noise, seed ^ 0xb),
    ]
}
