//! Windows of the other picture at a fraction of a pixel, and their sums with the reference.

use super::Verdict;
use super::geometry::TAPS_PX;
use super::reference::{LARGEST, Reference, View, total};
use crate::warp::weights::weights;

/// Sums over the window with b sampled at d; `thinning`: Σw², the share of white noise that sampling leaves.
pub(super) struct Sums {
    pub b: f64,
    pub bb: f64,
    pub ab: f64,
    pub pb: [f64; 2],
    pub thinning: f64,
}

/// Samples windows of b: a patch of whole pixels, its rows filtered along x, then along y.
pub(super) struct Sampler<const LANES: usize> {
    pub window: usize,
    pub mask: [f32; LANES],
    /// Whole-pixel shift that `patch` was cut out at.
    pub patch_at: Option<[i64; 2]>,
    pub patch: [[f32; 40]; LARGEST + 7],
    pub rows: [[f32; LANES]; LARGEST + 7],
}

impl<const LANES: usize> Sampler<LANES> {
    pub fn new(window: usize) -> Self {
        let mut mask = [0.0; LANES];
        mask[..window].fill(1.0);
        Self {
            window,
            mask,
            patch_at: None,
            patch: [[0.0; 40]; LARGEST + 7],
            rows: [[0.0; LANES]; LARGEST + 7],
        }
    }

    /// Cuts out the window at `at + whole` with three pixels before and four after it.
    #[inline(always)]
    fn cut(&mut self, b: &View<'_>, at: [usize; 2], whole: [i64; 2]) -> Result<(), Verdict> {
        if self.patch_at == Some(whole) {
            return Ok(());
        }
        let before = (self.window / 2 + TAPS_PX - 1) as i64;
        let (width, height) = (b.plane.width, b.plane.height);
        let inside = |p: usize, d: i64, size: usize| {
            let first = p as i64 + d - before;
            let fits = first >= 0 && first as usize + self.window + 7 <= size;
            fits.then_some(first as usize).ok_or(Verdict::Outside)
        };
        let x = inside(at[0], whole[0], width)?;
        let y = inside(at[1], whole[1], height)?;
        let centre = (y + before as usize) * width + x + before as usize;
        let mean = b.mean[centre];
        for (k, out) in self.patch.iter_mut().enumerate().take(self.window + 7) {
            let from = (y + k) * width + x;
            let row = &b.plane.data[from..from + self.window + 7];
            for (out, v) in out.iter_mut().zip(row) {
                *out = v - mean;
            }
        }
        self.patch_at = Some(whole);
        Ok(())
    }

    #[inline(always)]
    pub fn correlate(
        &mut self,
        reference: &Reference<LANES>,
        b: &View<'_>,
        at: [usize; 2],
        d: [f64; 2],
    ) -> Result<Sums, Verdict> {
        let whole = d.map(|d| d.floor() as i64);
        self.cut(b, at, whole)?;
        let [wx, wy] = [0, 1].map(|i| weights::<4>((d[i] - whole[i] as f64) as f32));
        for (out, patch) in self.rows.iter_mut().zip(&self.patch).take(self.window + 7) {
            let mut sum = [0.0f32; LANES];
            for (k, w) in wx.iter().enumerate() {
                for (s, v) in sum.iter_mut().zip(&patch[k..k + LANES]) {
                    *s += w * v;
                }
            }
            *out = sum;
        }
        let mut sums = [[0.0f32; LANES]; 5];
        for lane in (0..LANES).step_by(8) {
            let mut part = [[0.0f32; 8]; 5];
            for j in 0..self.window {
                let mut v = [0.0f32; 8];
                for (w, row) in wy.iter().zip(&self.rows[j..j + 8]) {
                    for i in 0..8 {
                        v[i] += w * row[lane + i];
                    }
                }
                for i in 0..8 {
                    let (v, at) = (v[i] * self.mask[lane + i], lane + i);
                    part[0][i] += v;
                    part[1][i] += v * v;
                    part[2][i] += reference.values[j][at] * v;
                    part[3][i] += reference.p[0][j][at] * v;
                    part[4][i] += reference.p[1][j][at] * v;
                }
            }
            for (sum, part) in sums.iter_mut().zip(&part) {
                sum[lane..lane + 8].copy_from_slice(part);
            }
        }
        let [b, bb, ab, px, py] = sums.map(|lanes| total(&lanes));
        let noise = |w: &[f32; 8]| w.iter().map(|&w| f64::from(w) * f64::from(w)).sum::<f64>();
        Ok(Sums {
            b,
            bb,
            ab,
            pb: [px, py],
            thinning: noise(&wx) * noise(&wy),
        })
    }
}
