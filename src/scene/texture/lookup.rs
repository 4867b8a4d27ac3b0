//! Values of a texture at points: bilinear, one by one, block by block, or averaged over a footprint.

use super::Texture;
use crate::simd::SimdLevel;

/// Points that are looked up together.
const BLOCK: usize = 64;

/// Where the four taps lie: index of the upper left one and weights of the right and lower ones.
#[derive(Clone, Copy)]
struct Taps {
    offset: usize,
    fx: f32,
    fy: f32,
}

#[inline(always)]
fn blend([a, b, c, d]: [f32; 4], fx: f32, fy: f32) -> f32 {
    let (upper, lower) = (a + (b - a) * fx, c + (d - c) * fx);
    upper + (lower - upper) * fy
}

impl Texture {
    #[inline(always)]
    fn taps(&self, s: f32, t: f32) -> Taps {
        // max before min: NaN becomes 0, so that the taps always exist.
        let x = (s * self.width as f32 - 0.5)
            .max(0.0)
            .min((self.width - 1) as f32);
        let y = (t * self.height as f32 - 0.5)
            .max(0.0)
            .min((self.height - 1) as f32);
        let (i, j) = (x as u32, y as u32);
        Taps {
            offset: j as usize * self.stride + i as usize,
            fx: x - i as f32,
            fy: y - j as f32,
        }
    }

    /// Upper left, upper right, lower left and lower right of four taps.
    #[inline(always)]
    fn corners(&self, plane: &[f32], offset: usize) -> [f32; 4] {
        let w = &plane[offset..offset + self.stride + 2];
        [w[0], w[1], w[self.stride], w[self.stride + 1]]
    }

    /// The same, two and two.
    #[inline(always)]
    fn corner_pairs(&self, plane: &[f32], offset: usize) -> [[f32; 2]; 2] {
        let w = &plane[offset..offset + self.stride + 2];
        [[w[0], w[1]], [w[self.stride], w[self.stride + 1]]]
    }

    #[inline(always)]
    fn blend(&self, plane: &[f32], taps: Taps) -> f32 {
        blend(self.corners(plane, taps.offset), taps.fx, taps.fy)
    }

    /// Bilinear RGB at (s, t).
    #[inline]
    pub fn sample_bilinear(&self, s: f32, t: f32) -> [f32; 3] {
        let taps = self.taps(s, t);
        match self.planes.as_slice() {
            [grey] => [self.blend(grey, taps); 3],
            planes => std::array::from_fn(|c| self.blend(&planes[c], taps)),
        }
    }

    /// Bilinear value of channel `c` (0 R, 1 G, 2 B; any for grey) at (s, t).
    #[inline]
    pub fn sample_channel(&self, s: f32, t: f32, c: usize) -> f32 {
        self.blend(self.plane(c), self.taps(s, t))
    }

    /// [`Self::sample_channel`] of many points: `out[k]` at (`s[k]`, `t[k]`), as far as the shortest slice reaches.
    pub fn sample_channel_batch(&self, s: &[f32], t: &[f32], c: usize, out: &mut [f32]) {
        let n = out.len().min(s.len()).min(t.len());
        let (s, t, out) = (&s[..n], &t[..n], &mut out[..n]);
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { self.sample_avx2(s, t, c, out) },
            _ => self.sample_blocks(s, t, c, out),
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn sample_avx2(&self, s: &[f32], t: &[f32], c: usize, out: &mut [f32]) {
        self.sample_blocks(s, t, c, out);
    }

    /// Block by block in three loops, of which only the fetch goes point by point.
    #[inline(always)]
    fn sample_blocks(&self, s: &[f32], t: &[f32], c: usize, out: &mut [f32]) {
        let plane = self.plane(c);
        let blocks = s.chunks(BLOCK).zip(t.chunks(BLOCK));
        for ((s, t), out) in blocks.zip(out.chunks_mut(BLOCK)) {
            let mut offsets = [0u32; BLOCK];
            let [mut fx, mut fy] = [[0.0; BLOCK]; 2];
            for (i, (&s, &t)) in s.iter().zip(t).enumerate() {
                let taps = self.taps(s, t);
                // A plane is shorter than 2³².
                offsets[i] = taps.offset as u32;
                (fx[i], fy[i]) = (taps.fx, taps.fy);
            }
            let [mut upper, mut lower] = [[[0.0; 2]; BLOCK]; 2];
            let pairs = upper.iter_mut().zip(&mut lower).zip(&offsets);
            for ((upper, lower), &offset) in pairs.take(out.len()) {
                [*upper, *lower] = self.corner_pairs(plane, offset as usize);
            }
            for (i, out) in out.iter_mut().enumerate() {
                let ([a, b], [c, d]) = (upper[i], lower[i]);
                *out = blend([a, b, c, d], fx[i], fy[i]);
            }
        }
    }

    /// [`Self::sample_bilinear`] of many points into one slice a channel, as far as the shortest slice reaches.
    pub fn sample_batch(
        &self,
        s: &[f32],
        t: &[f32],
        out_r: &mut [f32],
        out_g: &mut [f32],
        out_b: &mut [f32],
    ) {
        let out = out_r.iter_mut().zip(out_g).zip(out_b);
        for ((((r, g), b), &s), &t) in out.zip(s).zip(t) {
            [*r, *g, *b] = self.sample_bilinear(s, t);
        }
    }

    /// RGB averaged over about `footprint_texels` (side of a square, in texels of the full raster) around (s, t):
    /// trilinear between the levels of a box-filtered pyramid (Williams, SIGGRAPH 1983), which the first call builds.
    pub fn sample_footprint(&self, s: f32, t: f32, footprint_texels: f32) -> [f32; 3] {
        if footprint_texels.is_nan() || footprint_texels <= 1.0 {
            return self.sample_bilinear(s, t);
        }
        let levels = self.levels();
        let level = footprint_texels.log2().min(levels.len() as f32);
        let (whole, f) = (level as usize, level.fract());
        let pick = |k: usize| if k == 0 { self } else { &levels[k - 1] };
        let fine = pick(whole).sample_bilinear(s, t);
        if f == 0.0 {
            return fine;
        }
        let coarse = pick(whole + 1).sample_bilinear(s, t);
        std::array::from_fn(|c| fine[c] + (coarse[c] - fine[c]) * f)
    }
}
