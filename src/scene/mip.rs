//! Mip pyramid: each level halves the sides (rounded up) by exact area averaging.
//!
//! Output texel k of m covers the input interval [k n/m, (k+1) n/m] of n; its weights are the covered lengths times
//! m/n. So the mean is preserved for odd sizes too.

/// The input texels under one output texel: the first, and the weight of each.
struct Span {
    first: usize,
    weights: Vec<f32>,
}

/// The spans along an axis of `n` texels.
fn spans(n: usize) -> Vec<Span> {
    let m = n.div_ceil(2);
    (0..m)
        .map(|k| {
            // In units of 1/m texel, so that the limits are whole numbers.
            let (from, to) = (k * n, (k + 1) * n);
            let first = from / m;
            let weights = (first..to.div_ceil(m))
                .map(|i| (to.min((i + 1) * m) - from.max(i * m)) as f32 / n as f32)
                .collect();
            Span { first, weights }
        })
        .collect()
}

/// How a raster of one size is averaged onto the next smaller one.
pub(super) struct Halving {
    across: Vec<Span>,
    down: Vec<Span>,
}

impl Halving {
    /// For a raster of this size; `None` if it is 1×1.
    pub fn new(width: usize, height: usize) -> Option<Self> {
        (width > 1 || height > 1).then(|| Self {
            across: spans(width),
            down: spans(height),
        })
    }

    /// Width and height of the smaller raster.
    pub fn size(&self) -> (usize, usize) {
        (self.across.len(), self.down.len())
    }

    /// Its texel (x, y), from the larger raster's texels.
    pub fn average(&self, x: usize, y: usize, texel: impl Fn(usize, usize) -> f32) -> f32 {
        let (span_x, span_y) = (&self.across[x], &self.down[y]);
        let mut sum = 0.0;
        for (j, wy) in (span_y.first..).zip(&span_y.weights) {
            for (i, wx) in (span_x.first..).zip(&span_x.weights) {
                sum += wy * wx * texel(i, j);
            }
        }
        sum
    }
}
