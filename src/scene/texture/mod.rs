//! Linear-light rasters that rays look up.
//!
//! Coordinates: s to the right, t **down**, both in [0, 1] over the whole raster; the centre of texel (i, j) is at
//! ((i + 0.5)/W, (j + 0.5)/H). Between centres the value is bilinear; beyond the outermost centres it is the border's.
//!
//! Storage is one f32 plane a channel, one for a grey texture. Measured at 4096² with rays near one spot, a channel's
//! lookup costs 5 ns with f32, 20 % more with 16-bit texels, and three planes are no slower than interleaved RGB; the
//! checked slice costs 1.4 ns of the 5, which does not pay for unsafe code. A guard column and row repeat the border,
//! so that the four taps need no clamping of their own.

mod lookup;
mod smooth;

pub use smooth::WindowMoments;

use crate::scene::mip::Halving;
use rayon::prelude::*;
use std::sync::OnceLock;
use thiserror::Error;

/// A linear-light raster of one (grey) or three (RGB) channels; values are finite and not negative.
#[derive(Clone, Debug)]
pub struct Texture {
    width: usize,
    height: usize,
    /// Texels from one row of a plane to the next.
    stride: usize,
    planes: Vec<Vec<f32>>,
    /// Levels 1, 2, …, built at the first use.
    levels: OnceLock<Vec<Texture>>,
}

/// Why a [`Texture`] was refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum TextureError {
    /// A side is zero or too long.
    #[error("texture: size {width}×{height} is not within 1..={max}", max = Texture::MAX_SIDE_PX)]
    Size {
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
    /// Neither grey nor RGB, or a plane of the wrong length.
    #[error(
        "texture: {planes} planes of {len} values do not make a {width}×{height} grey or RGB raster"
    )]
    Planes {
        /// Number of planes given.
        planes: usize,
        /// Length of the first plane that does not fit (or of the first).
        len: usize,
        /// Columns asked for.
        width: usize,
        /// Rows asked for.
        height: usize,
    },
    /// A value that cannot be a radiance.
    #[error("texture: value {value} at column {x}, row {y} is not finite and ≥ 0")]
    Value {
        /// The value.
        value: f32,
        /// Its column.
        x: usize,
        /// Its row.
        y: usize,
    },
}

impl Texture {
    /// Longest side accepted.
    pub const MAX_SIDE_PX: usize = 16384;

    /// Evaluates `f(column, row)` at every texel; C = 1 is grey, C = 3 is RGB. Rows run in parallel, so `f` must depend
    /// on its arguments only. Fails on a bad size, channel count or value.
    pub fn from_fn<const C: usize>(
        width: usize,
        height: usize,
        f: impl Fn(usize, usize) -> [f32; C] + Sync,
    ) -> Result<Self, TextureError> {
        Self::check_size(width, height)?;
        if C != 1 && C != 3 {
            return Err(TextureError::Planes {
                planes: C,
                len: width * height,
                width,
                height,
            });
        }
        let stride = stride_of(width);
        let mut planes: Vec<Vec<f32>> = (0..C).map(|_| vec![0.0; stride * (height + 1)]).collect();
        let mut rows: Vec<Vec<&mut [f32]>> = (0..height).map(|_| Vec::with_capacity(C)).collect();
        for plane in &mut planes {
            for (row, chunk) in rows.iter_mut().zip(plane.chunks_mut(stride)) {
                row.push(chunk);
            }
        }
        rows.into_par_iter()
            .enumerate()
            .try_for_each(|(y, mut row)| {
                for x in 0..width {
                    let texel = f(x, y);
                    for (plane, value) in row.iter_mut().zip(texel) {
                        if !(value.is_finite() && value >= 0.0) {
                            return Err(TextureError::Value { value, x, y });
                        }
                        plane[x] = value;
                    }
                }
                for plane in &mut row {
                    let last = plane[width - 1];
                    plane[width..].fill(last);
                }
                Ok(())
            })?;
        for plane in &mut planes {
            plane.copy_within((height - 1) * stride..height * stride, height * stride);
        }
        Ok(Self {
            width,
            height,
            stride,
            planes,
            levels: OnceLock::new(),
        })
    }

    /// From one (grey) or three (R, G, B) planes, row-major from the top. Fails on a bad size, length or value.
    ///
    /// # Errors
    /// A side out of range, neither one nor three planes of the right length, or a value that is not finite and ≥ 0.
    pub fn from_planes(
        width: usize,
        height: usize,
        planes: &[Vec<f32>],
    ) -> Result<Self, TextureError> {
        Self::check_size(width, height)?;
        if let Some(bad) = planes.iter().find(|p| p.len() != width * height) {
            return Err(TextureError::Planes {
                planes: planes.len(),
                len: bad.len(),
                width,
                height,
            });
        }
        match planes {
            [grey] => Self::from_fn(width, height, |x, y| [grey[y * width + x]]),
            [r, g, b] => Self::from_fn(width, height, |x, y| {
                let i = y * width + x;
                [r[i], g[i], b[i]]
            }),
            _ => Err(TextureError::Planes {
                planes: planes.len(),
                len: width * height,
                width,
                height,
            }),
        }
    }

    fn check_size(width: usize, height: usize) -> Result<(), TextureError> {
        let side = 1..=Self::MAX_SIDE_PX;
        if side.contains(&width) && side.contains(&height) {
            Ok(())
        } else {
            Err(TextureError::Size { width, height })
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }
    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }
    /// Channels kept: 1 (grey) or 3 (RGB).
    pub fn channels(&self) -> usize {
        self.planes.len()
    }

    /// RGB of texel (column, row); beyond the raster, the border's.
    pub fn texel(&self, x: usize, y: usize) -> [f32; 3] {
        let i = y.min(self.height - 1) * self.stride + x.min(self.width - 1);
        std::array::from_fn(|c| self.plane(c)[i])
    }

    /// Value of channel `c` at texel (column, row); a grey texture answers every `c` alike.
    pub fn texel_channel(&self, x: usize, y: usize, c: usize) -> f32 {
        self.plane(c)[y.min(self.height - 1) * self.stride + x.min(self.width - 1)]
    }

    #[inline]
    fn plane(&self, c: usize) -> &[f32] {
        &self.planes[c.min(self.planes.len() - 1)]
    }

    /// The next smaller raster of the pyramid; `None` at 1×1.
    fn halved(&self) -> Option<Texture> {
        let halving = Halving::new(self.width, self.height)?;
        let average = |x, y, c| halving.average(x, y, |i, j| self.texel_channel(i, j, c));
        let (width, height) = halving.size();
        if self.channels() == 1 {
            Texture::from_fn(width, height, |x, y| [average(x, y, 0)]).ok()
        } else {
            Texture::from_fn(width, height, |x, y| [0, 1, 2].map(|c| average(x, y, c))).ok()
        }
    }

    /// The halved rasters, which the first call builds.
    pub(super) fn levels(&self) -> &[Texture] {
        self.levels.get_or_init(|| {
            let mut levels: Vec<Texture> = Vec::new();
            while let Some(next) = levels.last().unwrap_or(self).halved() {
                levels.push(next);
            }
            levels
        })
    }

    /// This raster (0) or one of [`Self::levels`].
    pub(super) fn level(&self, level: usize) -> &Texture {
        match level {
            0 => self,
            k => &self.levels()[k - 1],
        }
    }

    /// Mean of each channel.
    pub fn mean(&self) -> [f64; 3] {
        std::array::from_fn(|c| {
            let rows = self.plane(c).chunks(self.stride).take(self.height);
            let sum: f64 = rows
                .map(|row| row[..self.width].iter().map(|&v| f64::from(v)).sum::<f64>())
                .sum();
            sum / (self.width * self.height) as f64
        })
    }
}

/// Room for the guard column, and an odd number of cache lines, so that a column does not fall into a few cache sets.
fn stride_of(width: usize) -> usize {
    let lines = (width + 1).div_ceil(16);
    (lines | 1) * 16
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
