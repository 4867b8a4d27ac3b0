//! Semi-global matching (Hirschmüller, PAMI 30, 328 (2008)): costs summed along eight paths to each pixel, on which a
//! step of one candidate costs P₁ and a farther one P₂, less across edges of the picture.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::cost::Volume;

/// P₁, in units of the cost.
const NEAR: f32 = 0.5;
/// P₂ where the picture is flat.
const FAR: f32 = 5.0;
/// Contrast across which P₂ is e times less, parts of white.
const EDGE: f32 = 0.05;

/// Directions of the paths: steps of x and y.
const STEPS: [[isize; 2]; 8] = [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
    [1, 1],
    [-1, -1],
    [1, -1],
    [-1, 1],
];

/// The summed costs.
pub(super) fn aggregated(volume: &Volume, guide: &Image) -> Volume {
    let paths: Vec<Vec<f32>> = (STEPS.par_iter())
        .map(|&step| along(volume, guide, step))
        .collect();
    let mut sum = volume.clone();
    let line = volume.width * volume.candidates.count;
    (sum.costs.par_chunks_mut(line).enumerate()).for_each(|(y, to)| {
        to.fill(0.0);
        for path in &paths {
            to.iter_mut()
                .zip(&path[y * line..])
                .for_each(|(to, v)| *to += v);
        }
    });
    sum
}

/// One direction.
fn along(volume: &Volume, guide: &Image, [dx, dy]: [isize; 2]) -> Vec<f32> {
    let (width, height, n) = (volume.width, volume.height, volume.candidates.count);
    let mut path = vec![0.0f32; volume.costs.len()];
    let mut before = vec![f32::INFINITY; n + 2];
    let rows: Box<dyn Iterator<Item = usize>> = if dy < 0 {
        Box::new((0..height).rev())
    } else {
        Box::new(0..height)
    };
    for y in rows {
        for i in 0..width {
            let x = if dx < 0 { width - 1 - i } else { i };
            let at = y * width + x;
            let from = (x.checked_add_signed(-dx).filter(|x| *x < width))
                .zip(y.checked_add_signed(-dy).filter(|y| *y < height));
            let cost = &volume.costs[at * n..][..n];
            let Some((fx, fy)) = from else {
                path[at * n..][..n].copy_from_slice(cost);
                continue;
            };
            let from = fy * width + fx;
            before[1..=n].copy_from_slice(&path[from * n..][..n]);
            let contrast = (guide.data()[at] - guide.data()[from]).abs();
            let far = (FAR * (-contrast / EDGE).exp()).max(NEAR);
            step(cost, &before, NEAR, far, &mut path[at * n..][..n]);
        }
    }
    path
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
        let summed = aggregated(&volume, &Image::zeros(width, height, 1));
        for c in summed.costs.chunks_exact(5) {
            assert!((0..5).all(|d| c[1] <= c[d]), "{c:?}");
        }
    }
}
