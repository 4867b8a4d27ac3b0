//! A complete map once more through the smoother, weighed by its own σ, whose surface bends at the picture's edges.
//!
//! Windows blur depth steps, coarse grids move them, and σ, which is not known before there is a surface, says where.

use quadpixel::image::Image;

use super::EDGE;
use super::directions::Direction;
use super::filters::{by_rows, enlarged_by_guide, row_of};
use super::minimum::median;
use super::smoother::{self, Edges};

/// λ of the surface, and the contrast across which it is e times less, parts of white.
const SMOOTHING: f64 = 20.0;
const SMOOTHING_EDGE: f64 = 0.01;

/// Least σ that counts, px of the level.
const LEAST_PX: f64 = 1e-3;

/// A disparity with its σ, both px of full resolution, as a surface at the resolution `level`: every pixel.
pub(super) fn refined(
    disparity: Image,
    sigma: &Image,
    direction: &Direction,
    level: usize,
) -> Image {
    let pyramid = direction.pyramid();
    let guide = &pyramid.guides[level];
    let unit = f64::from(1u32 << level);
    let disparity = direction.of_mean(disparity);
    // Pixel i of the level lies at pixel 2^level i.
    let at_level = |image: &Image| -> Vec<f64> {
        let rows = (0..guide.height()).map(|y| row_of(image, y << level));
        rows.flat_map(|row| (0..guide.width()).map(|x| f64::from(row[x << level]) / unit))
            .collect()
    };
    let numbers = at_level(&disparity);
    let of_sigma = |s: &f64| s.max(LEAST_PX).powi(-2);
    let mut weights: Vec<f64> = at_level(sigma).iter().map(of_sigma).collect();
    // A σ without bound counts as nothing.
    let typical = median(&weights).max(f64::MIN_POSITIVE);
    weights.iter_mut().for_each(|w| *w /= typical);
    let edges = Edges {
        guide,
        noise: pyramid.contrast_noise(level),
        weight: SMOOTHING,
        contrast: SMOOTHING_EDGE,
    };
    let surface = smoother::surface(&numbers, &weights, &edges);
    let coarse = by_rows(guide.width(), guide.height(), |y, to| {
        let row = &surface[y * guide.width()..];
        (to.iter_mut().zip(row)).for_each(|(to, u)| *to = (u * unit) as f32);
    });
    direction.scaled(enlarged_by_guide(
        &coarse,
        guide,
        level,
        &pyramid.guides[0],
        EDGE,
    ))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::dense::opposite::OppositePair;

    #[test]
    fn what_is_unsure_gives_in_and_a_step_moves_to_the_edge_of_the_picture() {
        let (width, height) = (64, 48);
        let picture = |edge: usize| {
            by_rows(width, height, |_, to| {
                let row = to.iter_mut().enumerate();
                row.for_each(|(x, to)| *to = if x < edge { 0.2 } else { 0.8 });
            })
        };
        let view = picture(32);
        let pair = OppositePair {
            views: [&view, &view],
            ratio: None,
        };
        let direction = Direction::first(&pair, false).unwrap();
        // The step lies three pixels beside that of the picture, where σ says that it is not known.
        let told = by_rows(width, height, |_, to| {
            let row = to.iter_mut().enumerate();
            row.for_each(|(x, to)| *to = if x < 35 { 0.0 } else { 1.0 });
        });
        let sigma = by_rows(width, height, |_, to| {
            let row = to.iter_mut().enumerate();
            row.for_each(|(x, to)| *to = if (28..40).contains(&x) { 0.5 } else { 0.02 });
        });
        let found = refined(told, &sigma, &direction, 0);
        for x in 0..width {
            let wanted = if x < 32 { 0.0 } else { 1.0 };
            let off = (found.pixel(x, 24)[0] - wanted).abs();
            assert!(off < 0.15, "column {x}: off by {off}");
        }
    }
}
