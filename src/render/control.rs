//! Less noise from the same rays: what they would give of a white wall is known from many more.
//!
//! With W the light of a white wall on a sub-pixel ([`WhiteField`]), and Ŵ and Ê the sums of a pixel's own rays over
//! such a wall and over the scene,
//!
//! ```text
//! E ≈ Ê · W / Ŵ
//! ```
//!
//! the ratio estimator (Cochran, *Sampling Techniques*, chapter 6): what rays miss of pupil and response, they miss of
//! both alike. A wall of one radiance has no noise at all, whatever the rays. Its bias falls as 1/N against the
//! noise's 1/√N, so it is not taken for few rays.

use glam::DVec2;

use super::truth::WhiteField;
use super::{Camera, RenderSettings};

/// W/Ŵ beyond which a pixel's own rays say too little of the pupil, at its dark edge, and the sum stays as it is.
const LARGEST: f64 = 2.0;

/// Fewest rays per pixel and channel, over the pixel's sub-pixels, with which [`Render::white`](super::Render::white)
/// changes anything: with so many the bias is below a quarter of the noise.
pub const LEAST_RAYS_PER_SUBPIXEL: usize = 6;

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control<'a> {
    white: &'a WhiteField,
}

impl<'a> Control<'a> {
    /// `None` for too few rays.
    pub fn new(camera: &Camera, settings: &RenderSettings, white: &'a WhiteField) -> Option<Self> {
        let fewest = LEAST_RAYS_PER_SUBPIXEL * camera.sensor().subpixels().count();
        (settings.rays_per_pixel >= fewest).then_some(Self { white })
    }

    /// Brings the sums of the pixel at a sensor position, channels outermost, then sub-pixels, to the known light of
    /// the wall; `walls`: the same rays' sums over it. `buffer` is used again from pixel to pixel.
    pub fn apply<const K: usize>(
        &self,
        xy_mm: DVec2,
        walls: &[f64],
        mut sums: [&mut [f64]; K],
        buffer: &mut Vec<f64>,
    ) {
        self.white.read_subpixels_sr(xy_mm, buffer);
        for (i, (wall, known)) in walls.iter().zip(buffer.iter()).enumerate() {
            let ratio = known / wall;
            if (1.0 / LARGEST..=LARGEST).contains(&ratio) {
                sums.iter_mut()
                    .filter_map(|sum| sum.get_mut(i))
                    .for_each(|value| *value *= ratio);
            }
        }
    }
}
