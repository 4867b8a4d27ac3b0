//! Pictures on surfaces: repeated, mirrored or held at their borders, and filtered by the footprint of a ray.
//!
//! A lookup is trilinear in a pyramid of halved pictures (Williams, SIGGRAPH 1983). Pictures of files stay 8-bit (5.3
//! bytes a texel with the pyramid; a film set has hundreds), those of generators are [`Texture`]s.

use std::sync::Arc;

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

#[derive(Clone, Debug)]
enum Raster {
    Float(Arc<Texture>),
    /// The picture and its halvings down to 1×1.
    Bytes {
        levels: Vec<Level>,
        /// Linear value of a code of R, G and B.
        decode: Box<[f32; 256]>,
    },
}

#[derive(Clone, Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<[u8; 4]>,
}

impl TextureMap {
    /// A linear picture without alpha.
    pub fn from_texture(texture: Arc<Texture>, wrap: [Wrap; 2]) -> Self {
        Self {
            raster: Raster::Float(texture),
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
        let mut levels = vec![Level {
            width,
            height,
            texels,
        }];
        while let Some(next) = levels.last().and_then(|l| l.halved(&decode, encoding)) {
            levels.push(next);
        }
        Ok(Self {
            raster: Raster::Bytes { levels, decode },
            wrap,
        })
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        self.level_size(0)
    }

    /// Mean of linear R, G, B and A.
    pub fn mean(&self) -> [f32; 4] {
        match &self.raster {
            Raster::Float(texture) => {
                let [r, g, b] = texture.mean();
                [r as f32, g as f32, b as f32, 1.0]
            }
            Raster::Bytes { levels, decode } => {
                let mut sum = [0f64; 4];
                for texel in &levels[0].texels {
                    let linear = linear(*texel, decode);
                    sum.iter_mut()
                        .zip(linear)
                        .for_each(|(s, x)| *s += f64::from(x));
                }
                sum.map(|s| (s / levels[0].texels.len() as f64) as f32)
            }
        }
    }

    /// Linear R, G, B and A at `uv` (see [`super::TriangleMesh::uvs`]), averaged over about a square of the side
    /// `footprint`, in units of `uv`.
    pub fn sample(&self, uv: [f32; 2], footprint: f32) -> [f32; 4] {
        let (width, height) = self.size();
        let texels = footprint * width.max(height) as f32;
        let last = self.level_count() - 1;
        // NaN and anything below a texel is the full picture.
        let level = if texels > 1.0 {
            texels.log2().min(last as f32)
        } else {
            0.0
        };
        let (whole, share) = (level as usize, level.fract());
        let fine = self.bilinear(whole, uv);
        if share == 0.0 {
            return fine;
        }
        let coarse = self.bilinear(whole + 1, uv);
        std::array::from_fn(|c| fine[c] + (coarse[c] - fine[c]) * share)
    }

    fn level_count(&self) -> usize {
        match &self.raster {
            Raster::Float(texture) => 1 + texture.levels().len(),
            Raster::Bytes { levels, .. } => levels.len(),
        }
    }

    fn level_size(&self, level: usize) -> (usize, usize) {
        match &self.raster {
            Raster::Float(texture) => {
                let t = texture.level(level);
                (t.width(), t.height())
            }
            Raster::Bytes { levels, .. } => (levels[level].width, levels[level].height),
        }
    }

    fn bilinear(&self, level: usize, [u, v]: [f32; 2]) -> [f32; 4] {
        let (width, height) = self.level_size(level);
        let ([x0, x1], fx) = taps(u, width, self.wrap[0]);
        let ([y0, y1], fy) = taps(v, height, self.wrap[1]);
        let corners = [(x0, y0), (x1, y0), (x0, y1), (x1, y1)];
        let [a, b, c, d] = match &self.raster {
            Raster::Float(texture) => {
                let level = texture.level(level);
                corners.map(|(x, y)| {
                    let [r, g, b] = level.texel(x, y);
                    [r, g, b, 1.0]
                })
            }
            Raster::Bytes { levels, decode } => {
                let texels = &levels[level].texels;
                corners.map(|(x, y)| linear(texels[y * width + x], decode))
            }
        };
        std::array::from_fn(|i| {
            let upper = a[i] + (b[i] - a[i]) * fx;
            let lower = c[i] + (d[i] - c[i]) * fx;
            upper + (lower - upper) * fy
        })
    }
}

#[inline]
fn linear([r, g, b, a]: [u8; 4], decode: &[f32; 256]) -> [f32; 4] {
    [
        decode[usize::from(r)],
        decode[usize::from(g)],
        decode[usize::from(b)],
        f32::from(a) / 255.0,
    ]
}

/// The two texels around `u` (texel centres at (i + ½)/n) and the weight of the second.
#[inline]
fn taps(u: f32, n: usize, wrap: Wrap) -> ([usize; 2], f32) {
    // Periods are taken off before the product, so that a far coordinate keeps its digits; NaN becomes 0.
    let reduced = match wrap {
        Wrap::Repeat => u - u.floor(),
        Wrap::Mirror => u - 2.0 * (0.5 * u).floor(),
        Wrap::Clamp => u.clamp(0.0, 1.0),
    };
    let x = if reduced.is_finite() { reduced } else { 0.0 } * n as f32 - 0.5;
    let first = x.floor();
    let place = |i: i64| -> usize {
        let n = n as i64;
        let i = match wrap {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Mirror => {
                let j = i.rem_euclid(2 * n);
                j.min(2 * n - 1 - j)
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        i as usize
    };
    ([place(first as i64), place(first as i64 + 1)], x - first)
}

impl Level {
    /// Half the sides (rounded up): each texel the mean of up to 2×2, in linear light. An odd side's last texel stands
    /// alone.
    fn halved(&self, decode: &[f32; 256], encoding: Encoding) -> Option<Level> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let code = |x: f32| match encoding {
            Encoding::Srgb => srgb::code_from_linear(x),
            Encoding::Linear => (x * 255.0).round() as u8,
        };
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = [0.0f32; 4];
                let mut count = 0.0;
                for j in 2 * y..(2 * y + 2).min(self.height) {
                    for i in 2 * x..(2 * x + 2).min(self.width) {
                        let texel = linear(self.texels[j * self.width + i], decode);
                        sum.iter_mut().zip(texel).for_each(|(s, t)| *s += t);
                        count += 1.0;
                    }
                }
                let [r, g, b, a] = sum.map(|s| s / count);
                texels.push([code(r), code(g), code(b), (a * 255.0).round() as u8]);
            }
        }
        Some(Level {
            width,
            height,
            texels,
        })
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
