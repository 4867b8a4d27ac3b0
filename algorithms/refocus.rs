//! Refocusing after the fact: shift each view onto the plane wanted, and add.
//!
//! ```text
//! out(x, y) = Σ_v w_v view_v(x + dx_v, y + dy_v),     dx_v = −D u_v / (ū_R − ū_L),   dy_v = −D v_v / (v̄_B − v̄_T)
//! ```
//!
//! - D: left-right disparity x_L − x_R (and y_T − y_B) in px of the points to be sharp; above 0 for points nearer than
//!   the focus.
//! - (u_v, v_v): centre of the sub-pixel in the pixel, −½ to ½, to the right and downwards; ū, v̄ its means over the
//!   halves.
//! - w_v: weights of the views. Equal ones are the full pupil; others move and shape the bokeh.
//!
//! Source: R. Ng et al., "Light field photography with a hand-held plenoptic camera", Stanford Tech Report CTSR
//! 2005-02.

use quadpixel::image::Image;
use quadpixel::range::{self, OutOfRange};
use quadpixel::sensor::Subpixels;

use crate::sai::{Side, Views};
use crate::warp::{Border, Lobes, Map, MapError, Warped, warp};
use quadpixel::simd::SimdLevel;

/// Settings that have no refocused image.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefocusError {
    /// D is beyond the views' longer side.
    #[error(transparent)]
    Disparity(#[from] OutOfRange),
    /// Not one weight per view.
    #[error("weights: {found} given, {expected} views")]
    Count {
        /// Weights given.
        found: usize,
        /// Views there are.
        expected: usize,
    },
    /// A weight that is none.
    #[error("weights: {0} must be 0 or more and finite, and not all 0")]
    Weight(f64),
    /// Views without pixels.
    #[error(transparent)]
    Map(#[from] MapError),
}

/// (dx, dy) in px by which each view is shifted at the disparity `d_px`, in index order.
pub fn shifts_px(subpixels: Subpixels, d_px: f64) -> Vec<(f64, f64)> {
    let centre = |index: usize| subpixels.centre(index);
    let mean = |side: Side, of: fn((f64, f64)) -> f64| {
        let members = side.members(subpixels);
        let sum: f64 = members.iter().map(|i| of(centre(*i))).sum();
        sum / members.len().max(1) as f64 // no members: one column or row, all centres 0
    };
    let across = mean(Side::Right, |c| c.0) - mean(Side::Left, |c| c.0);
    let down = mean(Side::Bottom, |c| c.1) - mean(Side::Top, |c| c.1);
    let shift = |centre: f64, base: f64| {
        if base > 0.0 {
            -d_px * centre / base
        } else {
            0.0
        }
    };
    (0..subpixels.count())
        .map(|index| (shift(centre(index).0, across), shift(centre(index).1, down)))
        .collect()
}

/// Adds the views, shifted to be sharp at the disparity `d_px`; `weights`: one per view, scaled to the mean 1, or none
/// for equal ones. A pixel is valid where all weighted views are; beyond their edge views are replicated.
///
/// # Errors
/// A disparity beyond the views' longer side; weights that are not one per view, negative, or all 0.
pub fn refocus(
    views: &Views,
    d_px: f64,
    weights: Option<&[f64]>,
    lobes: Lobes,
) -> Result<Warped, RefocusError> {
    let first = &views.images()[0];
    let (width, height) = (first.width(), first.height());
    let most = width.max(height) as f64;
    range::within("disparity", "px", d_px, -most..=most)?;
    let count = views.images().len();
    let weights = weights.map_or_else(|| vec![1.0; count], <[f64]>::to_vec);
    if weights.len() != count {
        return Err(RefocusError::Count {
            found: weights.len(),
            expected: count,
        });
    }
    if let Some(bad) = weights.iter().find(|w| !(**w >= 0.0 && w.is_finite())) {
        return Err(RefocusError::Weight(*bad));
    }
    let total: f64 = weights.iter().sum();
    if !(total > 0.0 && total.is_finite()) {
        return Err(RefocusError::Weight(total));
    }
    let mut sums = vec![0.0f64; first.data().len()];
    let mut valid = vec![true; width * height];
    let shifted = views
        .images()
        .iter()
        .zip(shifts_px(views.subpixels(), d_px));
    for ((view, (dx, dy)), weight) in shifted.zip(weights) {
        if weight == 0.0 {
            continue;
        }
        let map = Map::shift(width, height, dx, dy)?;
        let warped = warp(view, &map, lobes, Border::Replicate, SimdLevel::detect());
        let scale = weight * count as f64 / total;
        let values = warped.image.data().iter();
        sums.iter_mut()
            .zip(values)
            .for_each(|(sum, v)| *sum += scale * f64::from(*v));
        valid
            .iter_mut()
            .zip(warped.valid)
            .for_each(|(all, one)| *all &= one);
    }
    let mut image = Image::zeros(width, height, first.channels());
    image
        .data_mut()
        .iter_mut()
        .zip(sums)
        .for_each(|(to, sum)| *to = sum as f32);
    Ok(Warped { image, valid })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// Views of a plane at the disparity `d_px`: each sees the pattern where the specification says.
    fn plane_at(d_px: f64, m: usize, n: usize) -> Views {
        let subpixels = Subpixels::new(m, n).unwrap();
        let view = |(dx, dy): (f64, f64)| {
            let mut image = Image::zeros(40, 32, 1);
            for y in 0..32 {
                for x in 0..40 {
                    let (u, v) = (x as f64 - dx, y as f64 - dy);
                    image.pixel_mut(x, y)[0] = (0.4 * u + 0.3 * v).sin() as f32;
                }
            }
            image
        };
        let images = shifts_px(subpixels, d_px).into_iter().map(view).collect();
        Views::new(subpixels, images).unwrap()
    }

    #[test]
    fn a_shift_beyond_the_views_is_refused() {
        let views = plane_at(1.0, 2, 2);
        let of = |d_px| refocus(&views, d_px, None, Lobes::Four).err();
        assert_eq!(of(40.0), None);
        for d_px in [41.0, -1e300, f64::INFINITY, f64::NAN] {
            let told = of(d_px).map(|e| e.to_string()).unwrap_or_default();
            assert!(told.contains("allowed: -40 to 40"), "{d_px}: {told}");
        }
    }

    #[test]
    fn a_near_point_stands_further_right_and_lower_in_the_left_and_upper_view() {
        let shifts = |m, n| shifts_px(Subpixels::new(m, n).unwrap(), 1.0);
        let wanted = [(0.5, 0.5), (-0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)]; // B, A, D, C
        assert_eq!(shifts(2, 2), wanted);
        assert_eq!(shifts(2, 1), [(0.5, 0.0), (-0.5, 0.0)]);
        // Four columns: the mean of the left two less that of the right two is D.
        let four: Vec<f64> = shifts(4, 1).iter().map(|s| s.0).collect();
        assert_eq!(four, [0.75, 0.25, -0.25, -0.75]);
    }

    #[test]
    fn a_plane_at_the_disparity_is_sharp_and_at_another_is_not() {
        for (m, n) in [(2, 2), (2, 1), (3, 3)] {
            let views = plane_at(1.4, m, n);
            let worst = |d_px: f64| {
                let out = refocus(&views, d_px, None, Lobes::Four).unwrap();
                let mut worst: f64 = 0.0;
                for y in 6..26 {
                    for x in 6..34 {
                        let truth = (m * n) as f64 * (0.4 * x as f64 + 0.3 * y as f64).sin();
                        worst = worst.max((f64::from(out.image.pixel(x, y)[0]) - truth).abs());
                        assert!(out.valid[y * 40 + x]);
                    }
                }
                worst / (m * n) as f64
            };
            assert!(worst(1.4) < 5e-3, "{m}x{n}: {}", worst(1.4));
            assert!(worst(-1.4) > 0.1, "{m}x{n}: {}", worst(-1.4));
        }
    }

    #[test]
    fn no_disparity_is_the_sum_and_a_single_weight_is_its_view() {
        let views = plane_at(2.0, 2, 2);
        let sum = views.sum(Side::All).unwrap();
        assert_eq!(refocus(&views, 0.0, None, Lobes::Three).unwrap().image, sum);
        let one = refocus(&views, 0.0, Some(&[0.0, 0.0, 5.0, 0.0]), Lobes::Three).unwrap();
        for (found, wanted) in one.image.data().iter().zip(views.images()[2].data()) {
            assert_eq!(*found, 4.0 * wanted);
        }
    }

    #[test]
    fn settings_without_meaning_are_refused() {
        let views = plane_at(0.0, 2, 1);
        assert!(refocus(&views, f64::NAN, None, Lobes::Four).is_err());
        for weights in [&[1.0][..], &[1.0, -1.0], &[0.0, 0.0], &[f64::NAN, 1.0]] {
            assert!(refocus(&views, 0.0, Some(weights), Lobes::Four).is_err());
        }
        // Half of it from beyond the edge: replicated, finite, not valid.
        let far = refocus(&views, 40.0, None, Lobes::Four).unwrap();
        assert!(far.valid.iter().all(|v| !v));
        assert!(far.image.data().iter().all(|v| v.is_finite()));
    }
}
