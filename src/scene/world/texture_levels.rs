//! The rasters of a picture on a surface: the full one and its halvings, the channels of a texel side by side.

use glam::Vec4;

use super::texture_map::Encoding;
use crate::image::srgb;
use crate::scene::texture::Texture;

/// A picture and its halvings down to 1×1.
#[derive(Clone, Debug)]
pub(super) enum Raster {
    /// Linear, with the mean of the full picture.
    Float {
        levels: Vec<Level<Vec4>>,
        mean: Vec4,
    },
    Bytes {
        levels: Vec<Level<[u8; 4]>>,
        /// Linear value of a code of R, G and B.
        decode: Box<[f32; 256]>,
    },
}

/// One raster, row-major from the top.
#[derive(Clone, Debug)]
pub(super) struct Level<T> {
    width: usize,
    height: usize,
    texels: Vec<T>,
}

/// Two neighbouring columns or rows, and the weight of the second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taps {
    pub texels: [usize; 2],
    pub share: f32,
}

impl Raster {
    pub fn from_texture(texture: &Texture) -> Self {
        let [r, g, b] = texture.mean();
        let count = 1 + texture.levels().len();
        Self::Float {
            levels: (0..count)
                .map(|k| Level::from_texture(texture.level(k)))
                .collect(),
            mean: Vec4::new(r as f32, g as f32, b as f32, 1.0),
        }
    }

    /// `texels` has width × height entries, one at least.
    pub fn from_bytes(
        (width, height): (usize, usize),
        texels: Vec<[u8; 4]>,
        encoding: Encoding,
        decode: Box<[f32; 256]>,
    ) -> Self {
        let mut levels = vec![Level {
            width,
            height,
            texels,
        }];
        while let Some(next) = levels.last().and_then(|l| l.halved(&decode, encoding)) {
            levels.push(next);
        }
        Self::Bytes { levels, decode }
    }

    pub fn level_count(&self) -> usize {
        match self {
            Self::Float { levels, .. } => levels.len(),
            Self::Bytes { levels, .. } => levels.len(),
        }
    }

    /// Columns and rows of a level.
    #[inline(always)]
    pub fn size(&self, level: usize) -> (usize, usize) {
        match self {
            Self::Float { levels, .. } => (levels[level].width, levels[level].height),
            Self::Bytes { levels, .. } => (levels[level].width, levels[level].height),
        }
    }

    /// Linear R, G, B and A.
    pub fn mean(&self) -> [f32; 4] {
        match self {
            Self::Float { mean, .. } => mean.to_array(),
            Self::Bytes { levels, decode } => {
                let mut sum = [0f64; 4];
                for texel in &levels[0].texels {
                    let linear = linear(*texel, decode).to_array();
                    sum.iter_mut()
                        .zip(linear)
                        .for_each(|(s, x)| *s += f64::from(x));
                }
                sum.map(|s| (s / levels[0].texels.len() as f64) as f32)
            }
        }
    }

    /// Linear R, G, B and A between four texels.
    #[inline(always)]
    pub fn bilinear(&self, level: usize, across: Taps, down: Taps) -> Vec4 {
        match self {
            Self::Float { levels, .. } => levels[level].bilinear(across, down, |t| t),
            Self::Bytes { levels, decode } => {
                levels[level].bilinear(across, down, |t| linear(t, decode))
            }
        }
    }
}

#[inline(always)]
fn linear([r, g, b, a]: [u8; 4], decode: &[f32; 256]) -> Vec4 {
    Vec4::new(
        decode[usize::from(r)],
        decode[usize::from(g)],
        decode[usize::from(b)],
        f32::from(a) / 255.0,
    )
}

impl<T: Copy> Level<T> {
    #[inline(always)]
    fn bilinear(&self, across: Taps, down: Taps, linear: impl Fn(T) -> Vec4) -> Vec4 {
        let row = |y: usize| {
            let row = &self.texels[y * self.width..][..self.width];
            let [a, b] = across.texels.map(|x| linear(row[x]));
            a + (b - a) * across.share
        };
        let [upper, lower] = down.texels.map(row);
        upper + (lower - upper) * down.share
    }
}

impl Level<Vec4> {
    fn from_texture(texture: &Texture) -> Self {
        let (width, height) = (texture.width(), texture.height());
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let texels = places.map(|(x, y)| {
            let [r, g, b] = texture.texel(x, y);
            Vec4::new(r, g, b, 1.0)
        });
        Self {
            width,
            height,
            texels: texels.collect(),
        }
    }
}

impl Level<[u8; 4]> {
    /// Half the sides (rounded up): each texel the mean of up to 2×2, in linear light. An odd side's last texel stands
    /// alone.
    fn halved(&self, decode: &[f32; 256], encoding: Encoding) -> Option<Self> {
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
                        let texel = linear(self.texels[j * self.width + i], decode).to_array();
                        sum.iter_mut().zip(texel).for_each(|(s, t)| *s += t);
                        count += 1.0;
                    }
                }
                let [r, g, b, a] = sum.map(|s| s / count);
                texels.push([code(r), code(g), code(b), (a * 255.0).round() as u8]);
            }
        }
        Some(Self {
            width,
            height,
            texels,
        })
    }
}
