//! The shifts of a capture's halves, in both directions.

use quadpixel::image::channel;

use super::halves::{MOST_NOISE, Measured, Pair, measure};
use crate::calibration::{Calibration, CalibrationError};
use crate::capture::Capture;
use crate::dense::{DenseError, DenseMap, DenseSettings, Halves, Network};
use crate::disparity::{Axes, MatchError, MatchSettings};
use crate::sai::Side;

/// Shifts at each pixel of the sum, row-major; `None` in a direction in which the pixel is not parted.
#[derive(Clone, Debug, PartialEq)]
pub struct Shifts {
    /// Columns and rows, px.
    pub size_px: [usize; 2],
    /// x_L − x_R.
    pub left_right: Option<Vec<Option<Measured>>>,
    /// y_T − y_B.
    pub top_bottom: Option<Vec<Option<Measured>>>,
}

/// A capture whose halves tell no shift.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ShiftError {
    /// The halves cannot be matched.
    #[error(transparent)]
    Match(#[from] MatchError),
    /// The halves cannot be matched at every pixel.
    #[error(transparent)]
    Dense(#[from] DenseError),
    /// A calibration whose fields are none.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// One sub-pixel.
    #[error("sub-pixels {0}: depth needs two columns or two rows")]
    NotParted(String),
}

/// The sides that are matched, A before B, and the component of the shift.
fn sides(axes: Axes) -> ([Side; 2], usize) {
    match axes {
        Axes::Vertical => ([Side::Bottom, Side::Top], 1),
        _ => ([Side::Right, Side::Left], 0),
    }
}

/// What is known of the camera otherwise serves where the capture does not bring the rays of its own pixel, which tell
/// more.
fn halves_of(capture: &Capture, known: &DenseSettings) -> Halves {
    let mut halves = Halves::new(capture);
    if halves.has_rays() {
        return halves;
    }
    if let Some(ratio) = &known.ratio {
        halves = halves.with_ratio(ratio);
    }
    match known.matching_error_px {
        Some(error_px) => halves.with_matching_error(error_px),
        None => halves,
    }
}

impl Shifts {
    /// Matches left with right and top with bottom, in the reference channel; `begins` is told each direction before it
    /// is matched.
    ///
    /// # Errors
    /// Settings out of their range, a picture that is too small, a pixel of one sub-pixel.
    pub fn measure(
        capture: &Capture,
        settings: &MatchSettings,
        begins: &dyn Fn(Axes),
    ) -> Result<Self, ShiftError> {
        let direction = |axes| {
            begins(axes);
            let views = &capture.views;
            let [Some(a), Some(b)] = sides(axes).0.map(|side| views.sum(side)) else {
                return Ok(None);
            };
            let c = capture.reference_channel();
            let (a, b) = (channel(&a, c), channel(&b, c));
            measure(Pair { a: &a, b: &b, axes }, settings, MOST_NOISE).map(Some)
        };
        let (left_right, top_bottom) = (direction(Axes::Horizontal)?, direction(Axes::Vertical)?);
        if left_right.is_none() && top_bottom.is_none() {
            let subpixels = capture.views.subpixels().to_string();
            return Err(ShiftError::NotParted(subpixels));
        }
        Ok(Self {
            size_px: capture.size_px(),
            left_right,
            top_bottom,
        })
    }

    /// A number at every pixel, of left and right where the pixel is parted so, else of top and bottom; both pairs tell
    /// it where there are both. These are shifts of centroids, whatever the texture. `known`: in the place of what the
    /// capture's camera says.
    ///
    /// # Errors
    /// Views that cannot be matched, a pixel of one sub-pixel.
    pub fn dense(capture: &Capture, known: &DenseSettings) -> Result<Self, ShiftError> {
        let halves = halves_of(capture, known);
        let map = halves.disparity()?;
        Ok(Self::at_every_pixel(capture, &halves, &map))
    }

    /// As [`Self::dense`], by a network and matching together.
    ///
    /// # Errors
    /// As of [`Self::dense`]; a network that does not fit.
    pub fn learned(
        capture: &Capture,
        known: &DenseSettings,
        network: &Network,
    ) -> Result<Self, ShiftError> {
        let halves = halves_of(capture, known);
        let map = halves.learned_disparity(network)?;
        Ok(Self::at_every_pixel(capture, &halves, &map))
    }

    fn at_every_pixel(capture: &Capture, halves: &Halves, map: &DenseMap) -> Self {
        let pixels = map.disparity_px.data().iter().zip(map.sigma_px.data());
        let shifts = pixels.map(|(disparity, sigma)| {
            Some(Measured {
                disparity_px: f64::from(*disparity),
                sigma_px: f64::from(*sigma),
            })
        });
        let shifts = Some(shifts.collect());
        let (left_right, top_bottom) = match halves.is_vertical() {
            false => (shifts, None),
            true => (None, shifts),
        };
        Self {
            size_px: capture.size_px(),
            left_right,
            top_bottom,
        }
    }

    /// Takes out the shift that the lens's aberration makes of itself. The calibration must be of `capture`'s camera.
    ///
    /// # Errors
    /// A calibration whose fields are none.
    pub fn without_aberration(
        mut self,
        capture: &Capture,
        calibration: &Calibration,
    ) -> Result<Self, ShiftError> {
        let fields = calibration.smooth_fields()?;
        let (c, channels) = (capture.reference_channel(), capture.channels.len());
        let width = self.size_px[0];
        for (shifts, axes) in [
            (&mut self.left_right, Axes::Horizontal),
            (&mut self.top_bottom, Axes::Vertical),
        ] {
            let ([a, b], axis) = sides(axes);
            let mean = |side: Side, at: [f64; 2]| {
                let members = side.members(capture.views.subpixels());
                let shifts = members
                    .iter()
                    .map(|v| fields[v * channels + c].at(at)[axis]);
                shifts.sum::<f64>() / members.len() as f64
            };
            for (i, shift) in shifts.iter_mut().flatten().enumerate() {
                if let Some(shift) = shift {
                    let at = [(i % width) as f64, (i / width) as f64];
                    shift.disparity_px -= mean(b, at) - mean(a, at);
                }
            }
        }
        Ok(self)
    }
}
