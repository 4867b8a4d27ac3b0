//! The disparity that a network tells, at the resolutions it was trained for.
//!
//! The network knows disparities of a few px. So the pair is reduced until its range is that wide, and once more; of
//! both answers each pixel takes what its own σ makes them worth. Where the pupil is parted in both directions, both
//! pairs are asked.
//!
//! Matching by kernels errs elsewhere than the network does, and is asked, too: the network's answer and that of
//! matching are joined in the same way. A network that builds on matching is told what that found, at its own
//! resolution, and answers for both. The map goes once more through the smoother.

use quadpixel::image::Image;

use super::directions::Direction;
use super::error::DenseError;
use super::filters::{by_rows, enlarged_by_guide, row_of, transposed};
use super::network::{Network, Told};
use super::refine::refined;
use super::{DenseMap, EDGE, matched, range};

/// Largest disparity at the finest resolution that is asked about, px.
const REACH_PX: f64 = 2.5;
/// Most pixels of it.
const MOST_PX: usize = 1 << 22;
/// σ over the mean absolute error that the network expects. Of Laplace's density, by which it was trained, 68 % would
/// lie within 1.14; chosen on scenes that it was not trained on (benches/runs/2026-11-26/sigma.md).
const SIGMA_OF_ERROR: f32 = 1.4;
/// κ of pixels like those that it was trained behind, 0.22 to 0.26. It is not told κ.
const KNOWN_RATIO: f64 = 0.24;
/// Part of a disparity by which an estimate for one κ errs at another, over the logarithm of their ratio: so much did
/// matching (benches/runs/2026-11-23/dense.md: 0.83 px for κ = 0.10, 1.09 px for 0.25).
const ERROR_OF_RATIO: f64 = 0.3;
/// Correlation of the network's errors with those of matching, 0.25 to 0.36 on four sets of samples
/// (benches/runs/2026-11-27/more-scenes.md): at depth steps both err. Measured by the camera's own rays, taken for the
/// family of blurs, too (benches/runs/2026-11-29/free-scale.md).
const CORRELATION_WITH_MATCHING: f32 = 0.3;
/// Logarithms of the least and largest σ that the network is told, as in training, px.
const LOG_SIGMA: [f32; 2] = [-5.0, 3.0];

/// A disparity and its σ, on one grid.
struct Answer {
    disparity: Image,
    sigma: Image,
}

/// The map of one or two directions, as the first one sees it.
pub(super) fn learned(directions: &[Direction], network: &Network) -> Result<DenseMap, DenseError> {
    let pyramid = directions[0].pyramid();
    let range_px = range::range(directions);
    let most = range_px[0].abs().max(range_px[1].abs());
    let mut fine = (most / REACH_PX).log2().ceil().max(0.0) as usize;
    let top = pyramid.depth() - 1;
    while fine < top && pyramid.guides[fine].width() * pyramid.guides[fine].height() > MOST_PX {
        fine += 1;
    }
    let fine = fine.min(top);
    let found = matched(directions);
    let mut answers = Vec::new();
    for level in fine..=(fine + 1).min(top) {
        for direction in directions {
            answers.push(answer(direction, level, network, &found)?);
        }
    }
    let mut answer = joined(&answers, 1.0);
    if !network.takes_matched() {
        let matched = Answer {
            disparity: found.disparity_px,
            sigma: found.sigma_px,
        };
        answer = joined(&[answer, matched], CORRELATION_WITH_MATCHING);
    }
    let told = DenseMap {
        disparity_px: answer.disparity,
        sigma_px: answer.sigma,
        range_px,
        halvings: fine,
    };
    let mut map = refined(told, &directions[0]);
    // σ is never beyond what was looked for.
    let widest = (range_px[1] - range_px[0]) as f32;
    (map.sigma_px.data_mut().iter_mut()).for_each(|s| *s = s.min(widest));
    Ok(map)
}

/// At every pixel, px of full resolution.
fn answer(
    direction: &Direction,
    level: usize,
    network: &Network,
    found: &DenseMap,
) -> Result<Answer, DenseError> {
    let pyramid = direction.pyramid();
    let views = pyramid.views(level);
    let unit = (1u32 << level) as f32 / direction.scale() as f32;
    // Pixel i of the level lies at pixel 2^level i.
    let at_level = |of: &Image, told: &(dyn Fn(f32) -> f32 + Sync)| {
        let size = [views[0].width(), views[0].height()].map(|n| n.div_ceil(2));
        by_rows(size[0], size[1], |y, to| {
            let row = to.iter_mut().enumerate();
            row.for_each(|(x, to)| {
                let [x, y] = [x, y].map(|i| i << (level + 1));
                let [x, y] = if direction.is_turned() {
                    [y, x]
                } else {
                    [x, y]
                };
                *to = told(row_of(of, y)[x]);
            });
        })
    };
    let matched = Told {
        disparity: at_level(&found.disparity_px, &|d| d / unit),
        log_spread: at_level(&found.sigma_px, &|s| {
            (s / unit).ln().clamp(LOG_SIGMA[0], LOG_SIGMA[1])
        }),
    };
    let told = network.told(views, &matched)?;
    // The network's pixels are those of the next level.
    let guide = pyramid.guides[level].halved();
    let full = |coarse: &Image| {
        let image = enlarged_by_guide(coarse, &guide, level + 1, &pyramid.guides[0], EDGE);
        if direction.is_turned() {
            transposed(&image)
        } else {
            image
        }
    };
    let mut disparity = full(&told.disparity);
    let mut sigma = full(&told.log_spread);
    (disparity.data_mut().iter_mut()).for_each(|d| *d *= unit);
    let ratio = direction.ratio();
    let numbers = sigma.data_mut().iter_mut().zip(disparity.data());
    for (i, (s, d)) in numbers.enumerate() {
        let unknown = ERROR_OF_RATIO * (ratio.at(i) / KNOWN_RATIO).ln();
        *s = (SIGMA_OF_ERROR * unit * s.exp()).hypot(unknown as f32 * d);
    }
    Ok(Answer { disparity, sigma })
}

/// Means of the answers by 1/σ², whose errors have one correlation. At 1 more answers do not make σ smaller.
fn joined(answers: &[Answer], correlation: f32) -> Answer {
    let first = &answers[0].disparity;
    let [mut disparity, mut sigma] =
        [(); 2].map(|()| Image::zeros(first.width(), first.height(), 1));
    let to = disparity.data_mut().iter_mut().zip(sigma.data_mut());
    for (i, (disparity, sigma)) in to.enumerate() {
        let (mut sums, mut weights) = ([0.0; 2], 0.0);
        for answer in answers {
            let (d, s) = (answer.disparity.data()[i], answer.sigma.data()[i]);
            let weight = s.max(1e-6).powi(-2);
            sums = [sums[0] + weight * d, sums[1] + weight * s];
            weights += weight;
        }
        let [mean, deviation] = sums.map(|sum| sum / weights);
        let variance = correlation * deviation * deviation + (1.0 - correlation) / weights;
        (*disparity, *sigma) = (mean, variance.sqrt());
    }
    Answer { disparity, sigma }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(disparity: f32, sigma: f32) -> Answer {
        let of = |value| {
            let mut image = Image::zeros(1, 1, 1);
            image.data_mut()[0] = value;
            image
        };
        Answer {
            disparity: of(disparity),
            sigma: of(sigma),
        }
    }

    #[test]
    fn the_surer_answer_counts_by_its_variance() {
        let answers = [answer(1.0, 0.1), answer(2.0, 0.2)];
        let both = joined(&answers, 1.0);
        assert!((both.disparity.data()[0] - 1.2).abs() < 1e-5);
        assert!((both.sigma.data()[0] - 0.12).abs() < 1e-6);
        let both = joined(&answers, 0.0);
        assert!((both.sigma.data()[0] - 0.2 / 5f32.sqrt()).abs() < 1e-6);
        // The sum of w² σ² and 2 ρ w₁ σ₁ w₂ σ₂, w = 0.8 and 0.2.
        let both = joined(&answers, 0.3);
        let variance = 0.08f32.powi(2) + 0.04f32.powi(2) + 0.6 * 0.08 * 0.04;
        assert!((both.sigma.data()[0] - variance.sqrt()).abs() < 1e-6);
    }
}
