//! Mip pyramid: each level halves the sides (rounded up) by exact area averaging.
//!
//! Output texel k of m covers the input interval [k n/m, (k+1) n/m] of n; its weights are the covered lengths times m/n. So the
//! mean is preserved for odd sizes too.

use super::texture::Texture;

/// Levels 1, 2, … down to 1×1 of `base`; empty when `base` is 1×1.
pub(super) fn levels(base: &Texture) -> Vec<Texture> {
    let mut levels: Vec<Texture> = Vec::new();
    while let Some(next) = halved(levels.last().unwrap_or(base)) {
        levels.push(next);
    }
    levels
}

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

fn halved(t: &Texture) -> Option<Texture> {
    if t.width() == 1 && t.height() == 1 {
        return None;
    }
    let (across, down) = (spans(t.width()), spans(t.height()));
    let average = |x: usize, y: usize, c: usize| {
        let (span_x, span_y) = (&across[x], &down[y]);
        let mut sum = 0.0;
        for (j, wy) in (span_y.first..).zip(&span_y.weights) {
            for (i, wx) in (span_x.first..).zip(&span_x.weights) {
                sum += wy * wx * t.texel_channel(i, j, c);
            }
        }
        sum
    };
    let (width, height) = (across.len(), down.len());
    if t.channels() == 1 {
        Texture::from_fn(width, height, |x, y| [average(x, y, 0)]).ok()
    } else {
        Texture::from_fn(width, height, |x, y| [0, 1, 2].map(|c| average(x, y, c))).ok()
    }
}
