//! Windows of the other picture at a fraction of a pixel, and their sums with the reference.

use super::geometry::TAPS_PX;
use super::lanes::{LANES, Lanes};
use super::matches::Verdict;
use super::reference::{LARGEST, Reference, Shape, VECTORS, View};
use crate::warp::weights::{TAPS, weights};

/// Sums over the window with b sampled at d; `thinning`: Σw², the share of white noise that sampling leaves.
pub(super) struct Sums {
    /// Σb̃².
    pub bb: f64,
    /// Σã b.
    pub ab: f64,
    /// Σp b.
    pub pb: [f64; 2],
    pub thinning: f64,
}

/// Samples windows of b: all rows under the kernel are filtered along x, then along y.
pub(super) struct Sampler<'s> {
    shape: &'s Shape,
    rows: [[f32; VECTORS * LANES]; LARGEST + TAPS - 1],
}

impl<'s> Sampler<'s> {
    /// For windows of `shape`.
    pub fn new(shape: &'s Shape) -> Self {
        Self {
            shape,
            rows: [[0.0; VECTORS * LANES]; LARGEST + TAPS - 1],
        }
    }

    /// The sums with the window of `b` at `at + d`.
    #[inline(always)]
    pub fn correlate<V: Lanes>(
        &mut self,
        reference: &Reference<'_, '_>,
        b: &View<'_>,
        at: [usize; 2],
        d: [f64; 2],
    ) -> Result<Sums, Verdict> {
        // By value: behind references they would be read again after every store to the rows.
        let &Shape {
            window, vectors, n, ..
        } = self.shape;
        let data = b.plane.data.as_slice();
        let whole = d.map(|d| d.floor());
        let before = (window / 2 + TAPS_PX - 1) as i64;
        let high = window + TAPS - 1;
        let inside = |p: usize, d: f64, size: usize| {
            let first = p as i64 + d as i64 - before;
            let fits = first >= 0 && first as usize + high <= size;
            fits.then_some(first as usize).ok_or(Verdict::Outside)
        };
        let (width, height) = (b.plane.width, b.plane.height);
        let x = inside(at[0], whole[0], width)?;
        let y = inside(at[1], whole[1], height)?;
        let mean = b.statistics.mean[(y + before as usize) * width + x + before as usize];
        let wx = weights::<4>((d[0] - whole[0]) as f32);
        let wy = weights::<4>((d[1] - whole[1]) as f32);
        let weights = splat::<V>(&wx);
        for (k, out) in self.rows.iter_mut().enumerate().take(high) {
            let from = (y + k) * width + x;
            for vector in 0..vectors {
                let lane = vector * LANES;
                let from = &data[from + lane..][..LANES + TAPS - 1];
                let mut samples = [V::splat(0.0); TAPS];
                for k in 0..TAPS {
                    samples[k] = V::load(&from[k..]);
                }
                filter(&weights, samples).store(&mut out[lane..]);
            }
        }
        let [b, bb, ab, xb, yb] = self.products::<V>(reference, &wy, mean);
        let ab = ab - reference.mean * b;
        let along =
            |axis: usize, gb: f64| gb - reference.means[axis] * b - reference.share[axis] * ab;
        let noise = |w: &[f32; TAPS]| w.iter().map(|&w| f64::from(w) * f64::from(w)).sum::<f64>();
        Ok(Sums {
            bb: bb - b * b / n,
            ab,
            pb: [along(0, xb), along(1, yb)],
            thinning: noise(&wx) * noise(&wy),
        })
    }

    /// Filters along y; sums of b, b², a b, gx b, gy b, with b without the `mean` of its whole-pixel window.
    #[inline(always)]
    fn products<V: Lanes>(
        &self,
        reference: &Reference<'_, '_>,
        wy: &[f32; TAPS],
        mean: f32,
    ) -> [f64; 5] {
        let &Shape {
            window,
            vectors,
            ref mask,
            ..
        } = self.shape;
        let view = reference.view;
        let [gx, gy] = &view.gradient;
        let (mean, weights) = (V::splat(mean), splat::<V>(wy));
        let mut sums = [0.0f64; 5];
        for vector in 0..vectors {
            let lane = vector * LANES;
            let mask = V::load(&mask[lane..]);
            let [mut b, mut bb, mut ab, mut xb, mut yb] = [V::splat(0.0); 5];
            for j in 0..window {
                let rows = &self.rows[j..j + TAPS];
                let mut samples = [V::splat(0.0); TAPS];
                for k in 0..TAPS {
                    samples[k] = V::load(&rows[k][lane..]);
                }
                let v = filter(&weights, samples).minus(mean).times(mask);
                let from = reference.first + j * view.plane.width + lane;
                let a = V::load(&view.plane.data[from..]);
                let (x, y) = (V::load(&gx[from..]), V::load(&gy[from..]));
                (b, bb, ab) = (b.plus(v), bb.plus(v.times(v)), ab.plus(a.times(v)));
                (xb, yb) = (xb.plus(x.times(v)), yb.plus(y.times(v)));
            }
            for (sum, part) in sums.iter_mut().zip([b, bb, ab, xb, yb]) {
                *sum += part.total();
            }
        }
        sums
    }
}

/// Weighted sum of eight samples, by halves: two short chains of additions instead of a long one. (No closure and no
/// iterator in here: they are functions of their own, which do not see the caller's instructions.)
#[inline(always)]
fn filter<V: Lanes>(w: &[V; TAPS], s: [V; TAPS]) -> V {
    let left = (w[0].times(s[0]).plus(w[1].times(s[1])))
        .plus(w[2].times(s[2]))
        .plus(w[3].times(s[3]));
    let right = (w[4].times(s[4]).plus(w[5].times(s[5])))
        .plus(w[6].times(s[6]))
        .plus(w[7].times(s[7]));
    left.plus(right)
}

/// The same number in all lanes of each weight's vector.
#[inline(always)]
fn splat<V: Lanes>(weights: &[f32; TAPS]) -> [V; TAPS] {
    let mut to = [V::splat(0.0); TAPS];
    for k in 0..TAPS {
        to[k] = V::splat(weights[k]);
    }
    to
}
