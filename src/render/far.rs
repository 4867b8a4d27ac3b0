//! Light that diffraction takes far, smoothed over neighbouring pixels.
//!
//! A few rays of a hundred are displaced far, and what they meet has little to do with the pixel. Their pattern is
//! broad where they land, so their mean radiance is taken over the 3 × 3 pixels around, by binomial weights: as if far
//! displacements were 0.7 px uncertain, RMS, along each axis.
//!
//! ```text
//! E = E_near + W_far · ⟨E_far⟩ / ⟨W_far⟩
//! ```
//!
//! W: the same rays' sums over a white wall, so that of such a wall nothing is changed.

use rayon::prelude::*;

use crate::image::Image;

/// Displacements from here on are far, px.
const FROM_PX: f64 = 4.0;
/// And from here on, in the units of the pattern's phase at the pupil's edge: the third ring.
const FROM_PHASE: f64 = 10.0;
/// Weights of a pixel and its two neighbours, along each axis.
const WEIGHTS: [f32; 3] = [0.25, 0.5, 0.25];

/// Root of the sum of the squared weights of the 3 × 3 pixels: what is left of noise.
const NOISE_LEFT: f64 = 0.375;

/// Least displacement over wavelength that is far. `scale`: that of phase 1.
pub(super) fn from(scale: f64, wavelength_mm: f64, pitch_mm: f64) -> f64 {
    (FROM_PX * pitch_mm / wavelength_mm).max(FROM_PHASE * scale)
}

/// Light of far rays, and what they would bring from a white wall, in the layout of the mosaic.
pub(super) struct FarLight {
    light: Image,
    walls: Image,
}

impl FarLight {
    /// None yet, for a mosaic of this size.
    pub fn like(mosaic: &Image) -> Self {
        let zeros = || Image::zeros(mosaic.width(), mosaic.height(), mosaic.channels());
        Self {
            light: zeros(),
            walls: zeros(),
        }
    }

    /// Light and walls by lines of a row of pixels each.
    pub fn rows_mut(&mut self, line: usize) -> impl Iterator<Item = [&mut [f32]; 2]> {
        let light = self.light.data_mut().chunks_mut(line);
        light
            .zip(self.walls.data_mut().chunks_mut(line))
            .map(|(light, walls)| [light, walls])
    }

    /// Adds the smoothed light to a mosaic of m × n sub-pixels.
    pub fn add_to(&self, mosaic: &mut Image, (m, n): (usize, usize)) {
        let channels = mosaic.channels();
        let (line, height) = (mosaic.width() * channels, mosaic.height());
        let step = m * channels;
        let (light, walls) = (self.light.data(), self.walls.data());
        let rows = mosaic.data_mut().par_chunks_mut(line).enumerate();
        rows.for_each(|(y, out)| {
            let mut sums = vec![[0f32; 2]; line];
            for (down, weight) in (0..3).zip(WEIGHTS) {
                let Some(y) = (y + down * n).checked_sub(n).filter(|&y| y < height) else {
                    continue;
                };
                let row = |all: &'_ [f32]| all[y * line..][..line].to_vec();
                let rows = [row(light), row(walls)];
                for (across, along) in (0..3).zip(WEIGHTS) {
                    let weight = weight * along;
                    for (x, sums) in sums.iter_mut().enumerate() {
                        let Some(x) = (x + across * step).checked_sub(step).filter(|&x| x < line)
                        else {
                            continue;
                        };
                        (sums.iter_mut().zip(&rows)).for_each(|(sum, row)| *sum += weight * row[x]);
                    }
                }
            }
            let own = &walls[y * line..][..line];
            for ((out, [light, walls]), own) in out.iter_mut().zip(sums).zip(own) {
                if walls > 0.0 {
                    *out += own * light / walls;
                }
            }
        });
    }
}

/// Two values with the difference that two renders of a pixel's near light and far light (with its walls) would have
/// once far light is smoothed.
pub(super) fn smoothed_pair(
    (a, (light_a, walls_a)): (f64, (f64, f64)),
    (b, (light_b, walls_b)): (f64, (f64, f64)),
) -> (f64, f64) {
    let walls = walls_a + walls_b;
    if walls == 0.0 {
        return (a, b);
    }
    // Both have the radiance of both; what theirs differ by is left of smoothing in part.
    let radiance = (light_a + light_b) / walls;
    let (a, b) = (a + walls_a * radiance, b + walls_b * radiance);
    let own = |light: f64, walls: f64| if walls > 0.0 { light / walls } else { radiance };
    let left = NOISE_LEFT * 0.5 * walls * (own(light_a, walls_a) - own(light_b, walls_b));
    let (middle, half) = (0.5 * (a + b), 0.5 * (a - b).hypot(left));
    (middle + half, middle - half)
}
