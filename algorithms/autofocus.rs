//! Focus stacks: sharpness and phase difference against the focus of the camera, and where each says that the scene is
//! in focus.
//!
//! Focus is counted in dioptres from the entrance pupil, 1/d_f in 1/m: there the phase difference of a plane at d is a
//! straight line,
//!
//! ```text
//! D = x_L − x_R = κ fx A (1/d − 1/d_f)
//! ```
//!
//! (the dataset's specification, "Metres from disparity"), and its zero is the focus. Contrast detection takes the
//! maximum of a sharpness, here the vertex of the parabola through the three samples about the largest one.

use quadpixel::image::views::Side;
use quadpixel::image::{Image, channel};

use crate::capture::Capture;
use crate::depth::{Pair, measure};
use crate::disparity::{Axes, MatchError, MatchSettings};
use crate::metrics::sharpness::{Plane, Sharpness, SharpnessError, SharpnessSettings, sharpness};

/// Ratio of the standard deviation of a normal law to its median absolute deviation.
const DEVIATION_OVER_MAD: f64 = 1.4826;

/// The part of the picture that is to be in focus, px.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Region {
    /// First column.
    pub x: usize,
    /// First row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Region {
    /// The middle half, in width and height, of a picture.
    pub fn middle(width: usize, height: usize) -> Self {
        Self {
            x: width / 4,
            y: height / 4,
            width: (width / 2).max(1),
            height: (height / 2).max(1),
        }
    }

    /// Whether it has a pixel and lies inside a picture.
    pub fn fits(&self, width: usize, height: usize) -> bool {
        let inside = |first: usize, length: usize, of: usize| {
            length > 0 && first.checked_add(length).is_some_and(|end| end <= of)
        };
        inside(self.x, self.width, width) && inside(self.y, self.height, height)
    }

    /// Indices of its pixels in a picture `width` wide.
    pub fn pixels(self, width: usize) -> impl Iterator<Item = usize> {
        let rows = self.y..self.y + self.height;
        rows.flat_map(move |y| (self.x..self.x + self.width).map(move |x| y * width + x))
    }
}

/// A shift over the region.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Phase {
    /// Median of x_L − x_R over the trusted matches, px.
    pub shift_px: f64,
    /// Robust spread of them about it, px.
    pub spread_px: f64,
    /// Part of the region that has a trusted match.
    pub trusted: f64,
}

/// One sample of a stack.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Step {
    /// 1/d_f, 1/m; 0: focused at infinity.
    pub focus_per_m: f64,
    /// Sharpness of the sum of all views.
    pub sharpness: Sharpness,
    /// Phase difference; `None` where nothing could be matched.
    pub phase: Option<Phase>,
}

/// What can be wrong with a sample.
#[derive(Debug, thiserror::Error)]
pub enum AutofocusError {
    /// The sharpness cannot be taken.
    #[error(transparent)]
    Sharpness(#[from] SharpnessError),
    /// The halves cannot be matched.
    #[error(transparent)]
    Match(#[from] MatchError),
    /// One column of sub-pixels.
    #[error("a pixel of one column has no left and right half: no phase difference")]
    NoHalves,
    /// Nothing tells the focus.
    #[error("it has no description of its camera, which tells the focus")]
    NoCamera,
}

/// Measures one sample in `region`, which must lie inside its views, of the reference channel.
///
/// # Errors
/// The focus is not known, the pixel has one column, or the region cannot be matched or measured.
pub fn measure_step(
    capture: &Capture,
    region: Region,
    settings: &MatchSettings,
    sharpness_settings: &SharpnessSettings,
) -> Result<Step, AutofocusError> {
    let camera = capture.camera.as_ref().ok_or(AutofocusError::NoCamera)?;
    let behind = camera.intrinsics.pinhole_behind_vertex_m;
    let focus_per_m = (camera.focus.distance_m).map_or(0.0, |z| 1.0 / (z + behind));
    let c = capture.reference_channel();
    let half = |side| capture.views.sum(side).map(|image| channel(&image, c));
    let (Some(all), Some(left), Some(right)) =
        (half(Side::All), half(Side::Left), half(Side::Right))
    else {
        return Err(AutofocusError::NoHalves);
    };
    let cut = crop(&all, region);
    let sharp = sharpness(&Plane::from_image(&cut, 0)?, sharpness_settings)?;
    let pair = Pair {
        a: &right,
        b: &left,
        axes: Axes::Horizontal,
    };
    let found = measure(pair, settings, f64::INFINITY)?;
    let shifts: Vec<f64> = (region.pixels(all.width()))
        .filter_map(|i| found[i].map(|m| m.disparity_px))
        .collect();
    let trusted = shifts.len() as f64 / (region.width * region.height) as f64;
    let phase = median(shifts.clone()).map(|shift_px| {
        let away = shifts.iter().map(|s| (s - shift_px).abs()).collect();
        Phase {
            shift_px,
            spread_px: DEVIATION_OVER_MAD * median(away).unwrap_or(0.0),
            trusted,
        }
    });
    Ok(Step {
        focus_per_m,
        sharpness: sharp,
        phase,
    })
}

fn crop(image: &Image, region: Region) -> Image {
    let mut cut = Image::zeros(region.width, region.height, 1);
    for (to, from) in cut.data_mut().iter_mut().zip(region.pixels(image.width())) {
        *to = image.data()[from];
    }
    cut
}

/// The middle value; `None` of nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

/// Where y, linear between points in order of x, is zero; of several places the one between the smallest values.
pub fn zero_crossing(points: &[(f64, f64)]) -> Option<f64> {
    let pairs = points
        .windows(2)
        .filter(|p| (p[0].1 > 0.0) != (p[1].1 > 0.0));
    let nearest = pairs.min_by(|p, q| {
        let size = |p: &[(f64, f64)]| p[0].1.abs() + p[1].1.abs();
        size(p).total_cmp(&size(q))
    })?;
    let [(x0, y0), (x1, y1)] = [nearest[0], nearest[1]];
    Some(x0 + (x1 - x0) * y0 / (y0 - y1))
}

/// The vertex of the parabola through the largest value and its neighbours; `None` where the largest is at an end.
pub fn peak(points: &[(f64, f64)]) -> Option<f64> {
    let top = (0..points.len()).max_by(|&i, &j| points[i].1.total_cmp(&points[j].1))?;
    if top == 0 || top + 1 >= points.len() {
        return None;
    }
    let [(x0, y0), (x1, y1), (x2, y2)] = [points[top - 1], points[top], points[top + 1]];
    // Newton's form: slopes of the chords and their difference.
    let (first, second) = ((y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1));
    let curvature = (second - first) / (x2 - x0);
    (curvature < 0.0).then(|| 0.5 * (x0 + x1) - first / (2.0 * curvature))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn parabolas_give_their_vertex_and_lines_their_zero_on_uneven_steps() {
        let xs = [0.3, 1.0, 1.4, 2.5, 3.1];
        let of = |f: &dyn Fn(f64) -> f64| xs.map(|x| (x, f(x))).to_vec();
        let vertex = peak(&of(&|x| 3.0 - 2.0 * (x - 1.7) * (x - 1.7))).unwrap();
        assert!((vertex - 1.7).abs() < 1e-12);
        let zero = zero_crossing(&of(&|x| 0.4 * (2.2 - x))).unwrap();
        assert!((zero - 2.2).abs() < 1e-12);
        assert_eq!(peak(&of(&|x| x)), None);
        assert_eq!(zero_crossing(&of(&|x| x)), None);
        assert_eq!((peak(&[]), zero_crossing(&[])), (None, None));
        // A stray sign far from the focus does not count.
        let stray = [(0.0, -3.0), (1.0, 4.0), (2.0, 0.5), (3.0, -0.5)];
        assert_eq!(zero_crossing(&stray), Some(2.5));
    }

    #[test]
    fn regions_are_checked_and_medians_are_the_middle() {
        let region = Region::middle(40, 30);
        assert_eq!(region.pixels(40).count(), 300);
        assert!(region.fits(40, 30) && !region.fits(20, 30));
        let beyond = Region {
            x: usize::MAX,
            ..region
        };
        assert!(!beyond.fits(40, 30));
        assert_eq!(median(vec![3.0, 1.0, 2.0, 10.0]), Some(2.5));
        assert_eq!(median(Vec::new()), None);
    }
}
