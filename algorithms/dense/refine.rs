//! A complete map once more through the smoother, weighed by its own σ, whose surface bends at the picture's edges.
//!
//! Windows blur depth steps, coarse grids move them, and σ, which is not known before there is a surface, says where.

use quadpixel::image::Image;

use super::directions::Direction;
use super::filters::{by_rows, enlarged_by_guide, row_of};
use super::minimum::median;
use super::smoother::{self, Stiffness};
use super::{DenseMap, EDGE};

/// Of the surface.
const STIFFNESS: Stiffness = Stiffness {
    weight: 20.0,
    contrast: 0.01,
};
/// Least σ that counts, px of the level.
const LEAST_PX: f64 = 1e-3;

/// The map with its disparity smoothed at the resolution that it was found at. σ stays: it is that of what is smoothed.
pub(super) fn refined(map: DenseMap, direction: &Direction) -> DenseMap {
    let (pyramid, level) = (direction.pyramid(), map.halvings);
    let guide = &pyramid.guides[level];
    let unit = f64::from(1u32 << level);
    // Pixel i of the level lies at pixel 2^level i.
    let at_level = |image: &Image| -> Vec<f64> {
        let rows = (0..guide.height()).map(|y| row_of(image, y << level));
        rows.flat_map(|row| (0..guide.width()).map(|x| f64::from(row[x << level]) / unit))
            .collect()
    };
    let numbers = at_level(&direction.of_mean(map.disparity_px));
    let of_sigma = |s: &f64| s.max(LEAST_PX).powi(-2);
    let mut weights: Vec<f64> = at_level(&map.sigma_px).iter().map(of_sigma).collect();
    // A σ without bound counts as nothing.
    let typical = median(&weights).max(f64::MIN_POSITIVE);
    weights.iter_mut().for_each(|w| *w /= typical);
    let surface = smoother::surface(&numbers, &weights, &pyramid.edges(level, STIFFNESS));
    let coarse = by_rows(guide.width(), guide.height(), |y, to| {
        let row = &surface[y * guide.width()..];
        (to.iter_mut().zip(row)).for_each(|(to, u)| *to = (u * unit) as f32);
    });
    let full = enlarged_by_guide(&coarse, guide, level, &pyramid.guides[0], EDGE);
    DenseMap {
        disparity_px: direction.scaled(full),
        ..map
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::dense::opposite::{OppositePair, OppositeViews};

    #[test]
    fn what_is_unsure_gives_in_and_a_step_moves_to_the_edge_of_the_picture() {
        let (width, height) = (64, 48);
        let columns = |value: &(dyn Fn(usize) -> f32 + Sync)| {
            by_rows(width, height, |_, to| {
                let row = to.iter_mut().enumerate();
                row.for_each(|(x, to)| *to = value(x));
            })
        };
        // The step lies three pixels beside that of the picture, where σ says that it is not known.
        let told = DenseMap {
            disparity_px: columns(&|x| if x < 35 { 0.0 } else { 1.0 }),
            sigma_px: columns(&|x| if (28..40).contains(&x) { 0.5 } else { 0.02 }),
            range_px: [0.0, 1.0],
            halvings: 0,
        };
        let largest_error = |view: &Image, picture: Option<&Image>| {
            let pair = OppositePair {
                views: [view, view],
                ratio: None,
            };
            let views = OppositeViews {
                picture,
                ..OppositeViews::default()
            };
            let direction = Direction::first(&pair, false, &views).unwrap();
            let found = refined(told.clone(), &direction).disparity_px;
            let off = |x: usize| (found.pixel(x, 24)[0] - if x < 32 { 0.0 } else { 1.0 }).abs();
            (0..width).map(off).fold(0.0, f32::max)
        };
        let edge = columns(&|x| if x < 32 { 0.2 } else { 0.8 });
        let off = largest_error(&edge, None);
        assert!(off < 0.15, "{off}");
        // An edge in blue alone.
        let even = columns(&|_| 0.5);
        let pixels = even.data().iter().zip(edge.data());
        let colours = pixels
            .flat_map(|(even, edge)| [*even, *even, *edge])
            .collect();
        let picture = Image::from_vec(width, height, 3, colours).unwrap();
        assert!(largest_error(&even, None) > 0.5);
        let off = largest_error(&even, Some(&picture));
        assert!(off < 0.15, "{off}");
    }
}
