//! Pictures on surfaces: repeated, mirrored or held at their borders, and filtered by the footprint of a ray.
//!
//! A lookup is trilinear in a pyramid of halved pictures (Williams, SIGGRAPH 1983). Pictures of files stay 8-bit (5.3
//! bytes per texel with the pyramid; a film set has hundreds), those of [`Texture`]s are f32 (21 bytes per texel).

use glam::Vec4;

use super::texture_levels::{Raster, Taps};
use crate::image::srgb;
use crate::scene::texture::{Texture, TextureError};

/// What is beyond a picture's border, along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// Its mirror image, in turn.
    Mirror,
    /// The border's texel.
    Clamp,
}

/// What an 8-bit code of R, G and B stands for. A is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// sRGB: colours.
    Srgb,
    /// code/255: normals, roughness.
    Linear,
}

/// A picture on a surface, linear RGB and alpha.
#[derive(Clone, Debug)]
pub struct TextureMap {
    raster: Raster,
    /// Along u and v.
    wrap: [Wrap; 2],
}

/// Levels of the pyramid that a lookup is between.
#[derive(Clone, Copy, Debug)]
pub(super) struct Filter {
    fine: usize,
    /// Weight of the next coarser one.
    coarse_share: f32,
}

impl TextureMap {
    /// A linear picture without alpha.
    pub fn from_texture(texture: &Texture, wrap: [Wrap; 2]) -> Self {
        Self {
            raster: Raster::from_texture(texture),
            wrap,
        }
    }

    /// An 8-bit picture, row-major from the top.
    ///
    /// # Errors
    /// A side that is 0 or above [`Texture::MAX_SIDE_PX`], or another number of texels.
    pub fn from_rgba8(
        (width, height): (usize, usize),
        texels: Vec<[u8; 4]>,
        encoding: Encoding,
        wrap: [Wrap; 2],
    ) -> Result<Self, TextureError> {
        let side = 1..=Texture::MAX_SIDE_PX;
        if !side.contains(&width) || !side.contains(&height) {
            return Err(TextureError::Size { width, height });
        }
        if texels.len() != width * height {
            return Err(TextureError::Planes {
                planes: 4,
                len: texels.len(),
                width,
                height,
            });
        }
        let decode = Box::new(std::array::from_fn(|code| {
            let value = code as f32 / 255.0;
            match encoding {
                Encoding::Srgb => srgb::to_linear(value),
                Encoding::Linear => value,
            }
        }));
        Ok(Self {
            raster: Raster::from_bytes((width, height), texels, encoding, decode),
            wrap,
        })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        self.raster.size(0)
    }

    /// Mean of linear R, G, B and A.
    pub fn mean(&self) -> [f32; 4] {
        self.raster.mean()
    }

    /// Linear R, G, B and A at `uv` (see [`super::TriangleMesh::uvs`]), averaged over about a square of the side
    /// `footprint`, in units of `uv`.
    pub fn sample(&self, uv: [f32; 2], footprint: f32) -> [f32; 4] {
        self.filtered(&self.filter(footprint), uv).to_array()
    }

    /// The levels of the pyramid for squares of this side.
    #[inline(always)]
    pub(super) fn filter(&self, footprint: f32) -> Filter {
        let (width, height) = self.size();
        let texels = footprint * width.max(height) as f32;
        let last = self.raster.level_count() - 1;
        // NaN and anything below a texel is the full picture.
        let level = if texels > 1.0 {
            texels.log2().min(last as f32)
        } else {
            0.0
        };
        let fine = level as usize;
        Filter {
            fine,
            coarse_share: level - fine as f32,
        }
    }

    /// [`Self::sample`] by levels that are known.
    #[inline(always)]
    pub(super) fn filtered(&self, filter: &Filter, uv: [f32; 2]) -> Vec4 {
        let fine = self.bilinear(filter.fine, uv);
        if filter.coarse_share == 0.0 {
            return fine;
        }
        let coarse = self.bilinear(filter.fine + 1, uv);
        fine + (coarse - fine) * filter.coarse_share
    }

    #[inline(always)]
    fn bilinear(&self, level: usize, [u, v]: [f32; 2]) -> Vec4 {
        let (width, height) = self.raster.size(level);
        let across = taps(u, width, self.wrap[0]);
        let down = taps(v, height, self.wrap[1]);
        self.raster.bilinear(level, across, down)
    }
}

/// The two texels around `u` (texel centres at (i + ½)/n).
#[inline(always)]
fn taps(u: f32, n: usize, wrap: Wrap) -> Taps {
    // Periods are taken off before the product, so that a far coordinate keeps its digits; NaN becomes 0.
    let reduced = match wrap {
        Wrap::Repeat => u - floor(u),
        Wrap::Mirror => u - 2.0 * floor(0.5 * u),
        Wrap::Clamp => u.clamp(0.0, 1.0),
    };
    let x = if reduced.is_finite() { reduced } else { 0.0 } * n as f32 - 0.5;
    let below = floor(x);
    let (first, n) = (below as i32, n as i32);
    // Within −1..=n, or 2n for mirrored pictures: once around at most.
    let around = |i: i32, period: i32| match i {
        i if i < 0 => i + period,
        i if i >= period => i - period,
        i => i,
    };
    let place = |i: i32| -> usize {
        let i = match wrap {
            Wrap::Repeat => around(i, n),
            Wrap::Mirror => {
                let j = around(i, 2 * n);
                j.min(2 * n - 1 - j)
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        i as usize
    };
    Taps {
        texels: [place(first), place(first + 1)],
        share: x - below,
    }
}

/// The same as [`f32::floor`], which is a call where the target has no instruction for it.
#[inline(always)]
fn floor(x: f32) -> f32 {
    // Above, all numbers are whole.
    const WHOLE: f32 = 8_388_608.0;
    if x.abs() < WHOLE {
        let near = x as i32 as f32;
        if near > x { near - 1.0 } else { near }
    } else {
        x
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// Four columns of code 0, 85, 170, 255, one row.
    fn ramp(wrap: Wrap) -> TextureMap {
        let texels = (0..4u8).map(|i| [85 * i, 0, 255, 85 * i]).collect();
        TextureMap::from_rgba8((4, 1), texels, Encoding::Linear, [wrap; 2]).unwrap()
    }

    #[test]
    fn borders_repeat_mirror_or_hold() {
        let at = |wrap, u: f32| ramp(wrap).sample([u, 0.5], 0.0)[0];
        let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-5, "{a} is not {b}");
        // Texel centres at 1/8, 3/8, 5/8, 7/8; u = 0 lies between the last texel of the picture before and the first.
        close(at(Wrap::Repeat, 0.125), 0.0);
        close(at(Wrap::Repeat, 0.0), 0.5);
        close(at(Wrap::Repeat, 1.375), 1.0 / 3.0);
        close(at(Wrap::Repeat, -0.125), 1.0);
        close(at(Wrap::Mirror, 1.125), 1.0);
        close(at(Wrap::Mirror, 1.875), 0.0);
        close(at(Wrap::Mirror, -0.375), 1.0 / 3.0);
        close(at(Wrap::Clamp, -5.0), 0.0);
        close(at(Wrap::Clamp, 5.0), 1.0);
        close(at(Wrap::Clamp, f32::NAN), 0.0);
    }

    #[test]
    fn a_footprint_as_large_as_the_picture_sees_its_mean() {
        let map = ramp(Wrap::Repeat);
        let mean = map.mean();
        assert!((mean[0] - 0.5).abs() < 1e-6 && mean[2] == 1.0);
        let seen = map.sample([0.3, 0.5], 4.0);
        // Two halvings, each rounded to half a code.
        assert!((seen[0] - mean[0]).abs() < 1.0 / 255.0, "{seen:?}");
    }

    #[test]
    fn srgb_codes_are_averaged_in_linear_light() {
        let texels = vec![[0, 0, 0, 255], [255; 4]];
        let wrap = [Wrap::Clamp; 2];
        let map = TextureMap::from_rgba8((2, 1), texels, Encoding::Srgb, wrap).unwrap();
        // Code 188 is 0.503 linear: the nearest to one half.
        assert!((map.sample([0.5, 0.5], 2.0)[0] - 0.5).abs() < 0.004);
    }

    #[test]
    fn a_wrong_number_of_texels_is_refused() {
        let make = |size| {
            TextureMap::from_rgba8(size, vec![[0; 4]; 6], Encoding::Linear, [Wrap::Clamp; 2])
        };
        assert!(make((3, 2)).is_ok());
        assert!(matches!(make((2, 2)), Err(TextureError::Planes { .. })));
        assert!(matches!(make((0, 2)), Err(TextureError::Size { .. })));
    }
}
