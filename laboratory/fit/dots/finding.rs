//! Bright regions of a picture.

/// Threshold between dark and bright around a dot.
const THRESHOLD: f32 = 0.35;
/// Tiles along the shorter side of the picture in which dark and bright are looked up, each with its neighbours.
const TILES: usize = 12;
/// What is less bright than this part of the whole picture's range is no dot.
const LEAST: f32 = 0.1;

/// A dot by the box around it, px.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub middle: [f64; 2],
    pub width: f64,
}

/// Connected bright regions that do not touch the picture's border.
pub(super) fn found(sum: &[f32], w: usize, h: usize) -> Vec<Found> {
    let bright = bright(sum, w, h);
    let mut seen = vec![false; w * h];
    let mut dots = Vec::new();
    let mut open = Vec::new();
    for start in 0..w * h {
        if !bright[start] || seen[start] {
            continue;
        }
        let (mut low, mut high) = ([w, h], [0, 0]);
        seen[start] = true;
        open.push(start);
        while let Some(at) = open.pop() {
            let (x, y) = (at % w, at / w);
            low = [low[0].min(x), low[1].min(y)];
            high = [high[0].max(x), high[1].max(y)];
            for ny in y.saturating_sub(1)..=(y + 1).min(h - 1) {
                for nx in x.saturating_sub(1)..=(x + 1).min(w - 1) {
                    let next = ny * w + nx;
                    if bright[next] && !seen[next] {
                        seen[next] = true;
                        open.push(next);
                    }
                }
            }
        }
        if low[0] > 0 && low[1] > 0 && high[0] + 1 < w && high[1] + 1 < h {
            let side = |axis: usize| (high[axis] - low[axis] + 1) as f64;
            dots.push(Found {
                middle: [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]) as f64),
                width: side(0).max(side(1)),
            });
        }
    }
    dots
}

/// Pixels above the threshold between dark and bright of their tile and those beside it.
fn bright(sum: &[f32], w: usize, h: usize) -> Vec<bool> {
    let tile = (w.min(h) / TILES).max(8);
    let (columns, rows) = (w.div_ceil(tile), h.div_ceil(tile));
    let mut ranges = vec![[f32::INFINITY, f32::NEG_INFINITY]; columns * rows];
    for y in 1..h.saturating_sub(1) {
        for x in 1..w.saturating_sub(1) {
            // Of 3 x 3 pixels, so that noise counts for less.
            let mean = (0..9)
                .map(|k| sum[(y + k / 3 - 1) * w + x + k % 3 - 1])
                .sum::<f32>()
                / 9.0;
            let [low, high] = &mut ranges[y / tile * columns + x / tile];
            (*low, *high) = (low.min(mean), high.max(mean));
        }
    }
    let join = |a: [f32; 2], b: &[f32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
    let none = [f32::INFINITY, f32::NEG_INFINITY];
    let all = ranges.iter().fold(none, join);
    let around = |tx: usize, ty: usize| {
        let rows = ty.saturating_sub(1)..=(ty + 1).min(rows - 1);
        let near = rows.flat_map(|y| {
            (tx.saturating_sub(1)..=(tx + 1).min(columns - 1)).map(move |x| y * columns + x)
        });
        near.map(|k| &ranges[k]).fold(none, join)
    };
    let levels: Vec<f32> = (0..columns * rows)
        .map(|k| {
            let [low, high] = around(k % columns, k / columns);
            match high - low >= LEAST * (all[1] - all[0]) {
                true => low + THRESHOLD * (high - low),
                false => f32::INFINITY,
            }
        })
        .collect();
    let above = |(at, value): (usize, &f32)| {
        let (x, y) = (at % w, at / w);
        *value > levels[y / tile * columns + x / tile]
    };
    sum.iter().enumerate().map(above).collect()
}
