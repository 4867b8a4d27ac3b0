//! Semi-global matching (Hirschmüller, PAMI 30, 328 (2008)): costs summed along eight paths to each pixel, on which a
//! step from one disparity to the next costs P₁ and a farther one P₂, less across edges of the picture.
//!
//! Four of the paths run with the rows and four against them, so that only a band of rows of each has to be kept.

use rayon::prelude::*;

use super::cost::Volume;
use super::guide::Guide;

/// P₁ of a step of one px of the level, in units of the cost.
const NEAR: f32 = 4.0;
/// P₂ where the picture is flat.
const FAR: f32 = 5.0;
/// Contrast across which P₂ is e times less, parts of white.
const EDGE: f32 = 0.05;

/// Rows of a band.
const BAND: usize = 16;

/// Steps of x and y along the paths that run with the rows; the others are their opposites.
const STEPS: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [-1, 1]];

/// The summed costs of candidates of which so many lie in one px of the level.
pub(super) fn aggregated(volume: &Volume, guide: &Guide, steps_per_px: f64) -> Volume {
    let near = NEAR / steps_per_px as f32;
    let paths = Paths {
        volume,
        guide,
        near,
    };
    let (mut costs, back) = rayon::join(|| paths.summed(1), || paths.summed(-1));
    (costs.par_iter_mut().zip(&back)).for_each(|(sum, v)| *sum += v);
    Volume { costs, ..*volume }
}

struct Paths<'a> {
    volume: &'a Volume,
    guide: &'a Guide,
    near: f32,
}

impl Paths<'_> {
    /// Of the four paths that run with the rows (`sign` 1) or against them (−1).
    fn summed(&self, sign: isize) -> Vec<f32> {
        let (height, line) = (self.volume.height, self.line());
        let mut sum = vec![0.0f32; self.volume.costs.len()];
        let mut paths: [Path; 4] = STEPS.map(|[dx, dy]| Path {
            step: [sign * dx, sign * dy],
            rows: vec![0.0; (BAND + 1) * line],
        });
        let order: Vec<usize> = match sign {
            1 => (0..height).collect(),
            _ => (0..height).rev().collect(),
        };
        for band in order.chunks(BAND) {
            (paths.par_iter_mut()).for_each(|path| self.advance(path, band));
            for (j, &y) in band.iter().enumerate() {
                let to = &mut sum[y * line..][..line];
                let [a, b, c, d] = paths.each_ref().map(|path| &path.rows[(j + 1) * line..]);
                let four = a.iter().zip(b).zip(c.iter().zip(d));
                (to.iter_mut().zip(four)).for_each(|(to, ((a, b), (c, d)))| *to = a + b + c + d);
            }
        }
        sum
    }

    /// Floats of a row.
    fn line(&self) -> usize {
        self.volume.width * self.volume.candidates.count
    }

    /// Brings a path through a band of rows.
    fn advance(&self, path: &mut Path, band: &[usize]) {
        let (width, height) = (self.volume.width, self.volume.height);
        let (n, line) = (self.volume.candidates.count, self.line());
        let [dx, dy] = path.step;
        path.rows.copy_within(BAND * line.., 0);
        let mut before = vec![f32::INFINITY; n + 2];
        for (j, &y) in band.iter().enumerate() {
            let (done, rest) = path.rows.split_at_mut((j + 1) * line);
            let (last, row) = (&done[j * line..], &mut rest[..line]);
            for i in 0..width {
                let x = if dx < 0 { width - 1 - i } else { i };
                let at = y * width + x;
                let cost = &self.volume.costs[at * n..][..n];
                let from = (x.checked_add_signed(-dx).filter(|x| *x < width))
                    .zip(y.checked_add_signed(-dy).filter(|y| *y < height));
                let Some((fx, fy)) = from else {
                    row[x * n..][..n].copy_from_slice(cost);
                    continue;
                };
                let own: &[f32] = if dy == 0 { row } else { last };
                before[1..=n].copy_from_slice(&own[fx * n..][..n]);
                let contrast = self.guide.contrast(at, fy * width + fx);
                let far = (FAR * (-contrast / EDGE).exp()).max(self.near);
                step(cost, &before, self.near, far, &mut row[x * n..][..n]);
            }
        }
    }
}

/// What has been summed along one path at each pixel of a band of rows, after that of the row before them.
struct Path {
    step: [isize; 2],
    rows: Vec<f32>,
}

/// cost + min(before, neighbours + near, least + far) − least; `before` has a margin of ∞ on both sides.
fn step(cost: &[f32], before: &[f32], near: f32, far: f32, to: &mut [f32]) {
    let least = before.iter().fold(f32::INFINITY, |m, &v| m.min(v));
    let neighbours = before.windows(3);
    for ((to, cost), b) in to.iter_mut().zip(cost).zip(neighbours) {
        let best = b[1].min(least + far).min(b[0].min(b[2]) + near);
        *to = cost + (best - least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::cost::Candidates;
    use quadpixel::image::Image;

    #[test]
    fn a_single_wrong_pixel_gives_in_to_its_surroundings() {
        let candidates = Candidates {
            first_px: 0.0,
            step_px: 1.0,
            count: 5,
        };
        let (width, height) = (9, 7);
        let costs = (0..width * height)
            .flat_map(|i| {
                (0..5).map(move |d| {
                    if d == if i == 31 { 4 } else { 1 } {
                        0.0
                    } else {
                        1.0
                    }
                })
            })
            .collect();
        let volume = Volume {
            width,
            height,
            candidates,
            costs,
        };
        let flat = Guide::new(&Image::zeros(width, height, 1), false);
        let summed = aggregated(&volume, &flat, 8.0);
        for c in summed.costs.chunks_exact(5) {
            assert!((0..5).all(|d| c[1] <= c[d]), "{c:?}");
        }
    }
}
