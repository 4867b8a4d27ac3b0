//! The disparity that a network tells, at the resolutions it was trained for.
//!
//! The network knows disparities of a few px. So the pair is reduced until its range is that wide, and once more; of
//! both answers each pixel takes what its own σ makes them worth. Where the pupil is parted in both directions, both
//! pairs are asked.

use quadpixel::image::Image;

use super::directions::Direction;
use super::error::DenseError;
use super::filters::{enlarged_by_guide, halved, transposed};
use super::network::Network;
use super::{DenseMap, EDGE, range};

/// Largest disparity at the finest resolution that is asked about, px.
const REACH_PX: f64 = 2.5;
/// Most pixels of it.
const MOST_PX: usize = 1 << 22;
/// σ over the mean absolute error that the network expects. Of Laplace's density, by which it was trained, 68 % would
/// lie within 1.14; on its validation pairs (learn/README.md) more errors are small and more are large, and 1 holds.
const SIGMA_OF_ERROR: f32 = 1.0;

/// What noise does not exceed, in its standard deviations.
const NOISE_DEVIATIONS: f64 = 6.0;

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
    while fine < top && pyramid.guides[fine].data().len() > MOST_PX {
        fine += 1;
    }
    let fine = fine.min(top);
    let mut answers = Vec::new();
    for level in fine..=(fine + 1).min(top) {
        for direction in directions {
            answers.push(answer(direction, level, network)?);
        }
    }
    let mut map = DenseMap {
        disparity_px: weighted(&answers, |a| &a.disparity),
        sigma_px: weighted(&answers, |a| &a.sigma),
        range_px,
        halvings: fine,
    };
    // σ is never beyond what was looked for; it is that of a picture without texture, of which a network may say
    // anything.
    let widest = (range_px[1] - range_px[0]) as f32;
    let is_flat = directions.iter().all(|d| is_flat(d, fine));
    (map.sigma_px.data_mut().iter_mut())
        .for_each(|s| *s = if is_flat { widest } else { s.min(widest) });
    Ok(map)
}

/// Whether no pixel of the sum differs from its surroundings by more than noise.
fn is_flat(direction: &Direction, level: usize) -> bool {
    let level = direction.pyramid().level(level);
    let most = (NOISE_DEVIATIONS * NOISE_DEVIATIONS * level.noise) as f32;
    level.sum.data().iter().all(|v| v * v <= most)
}

/// At every pixel, px of full resolution.
fn answer(direction: &Direction, level: usize, network: &Network) -> Result<Answer, DenseError> {
    let pyramid = direction.pyramid();
    let outcome = network.outcome(pyramid.views(level))?;
    // The network's pixels are those of the next level.
    let guide = halved(&pyramid.guides[level]);
    let unit = (1u32 << level) as f32 / direction.scale() as f32;
    let full = |coarse: &Image| {
        let image = enlarged_by_guide(coarse, &guide, level + 1, &pyramid.guides[0], EDGE);
        if direction.is_turned() {
            transposed(&image)
        } else {
            image
        }
    };
    let mut disparity = full(&outcome.disparity);
    let mut sigma = full(&outcome.log_error);
    (disparity.data_mut().iter_mut()).for_each(|d| *d *= unit);
    (sigma.data_mut().iter_mut()).for_each(|s| *s = SIGMA_OF_ERROR * unit * s.exp());
    Ok(Answer { disparity, sigma })
}

/// Mean of the answers by 1/σ². Their errors are alike, so that more answers do not make σ smaller.
fn weighted(answers: &[Answer], of: impl Fn(&Answer) -> &Image) -> Image {
    let mut mean = Image::zeros(of(&answers[0]).width(), of(&answers[0]).height(), 1);
    for (i, to) in mean.data_mut().iter_mut().enumerate() {
        let (mut sum, mut weights) = (0.0, 0.0);
        for answer in answers {
            let weight = answer.sigma.data()[i].max(1e-6).powi(-2);
            sum += weight * of(answer).data()[i];
            weights += weight;
        }
        *to = sum / weights;
    }
    mean
}
