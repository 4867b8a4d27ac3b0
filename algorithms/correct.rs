//! Correction: each view and channel is warped back by its calibrated field, then the views are added.
//!
//! ```text
//! I'_{v,c}(x) = Lanczos₄ I_{v,c}(x + d_{v,c}(x))        S_c = Σ_v I'_{v,c}
//! ```
//!
//! I, d: see [`crate::calibration`]; S: the corrected image. Where x + d leaves a view in any channel the pixel is not
//! valid.

use quadpixel::image::{Image, channel};
use quadpixel::simd::SimdLevel;

use crate::calibrated_camera::CalibratedCamera;
use crate::calibration::{Calibration, CalibrationError};
use crate::field::SmoothField;
use crate::metrics::sharpness::{Plane, Sharpness, SharpnessError, SharpnessSettings, sharpness};
use crate::sai::{Side, Views};
use crate::warp::{Border, Lobes, Map, warp};

/// Views put right.
#[derive(Clone, Debug)]
pub struct Corrected {
    /// The warped views.
    pub views: Views,
    /// Their sum.
    pub sum: Image,
    /// Per pixel, row-major: all views and channels have it.
    pub valid: Vec<bool>,
}

/// Views that cannot be corrected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorrectError {
    /// A calibration of another camera.
    #[error("it is of another camera: {0}")]
    OtherCamera(String),
    /// A calibration that does not fit the views, or is none.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Warps the views of `camera` by the fields of `calibration`.
///
/// # Errors
/// The calibration is of another camera, or its fields do not fit the views.
pub fn correct(
    views: &Views,
    camera: &CalibratedCamera,
    calibration: &Calibration,
) -> Result<Corrected, CorrectError> {
    match calibration.camera.difference(camera) {
        Some(difference) => Err(CorrectError::OtherCamera(difference)),
        None => Ok(warped(views, calibration)?),
    }
}

fn warped(views: &Views, calibration: &Calibration) -> Result<Corrected, CalibrationError> {
    let fields = calibration.smooth_fields()?;
    let bad = |text: &str| CalibrationError::File(text.to_owned());
    let first = views
        .images()
        .first()
        .ok_or_else(|| bad("a capture without views"))?;
    let (width, height, channels) = (first.width(), first.height(), first.channels());
    if fields.len() != views.images().len() * channels {
        return Err(bad(
            "the capture has another number of views and channels than the fields",
        ));
    }
    let mut valid = vec![true; width * height];
    let mut images = Vec::with_capacity(views.images().len());
    for (image, fields) in views.images().iter().zip(fields.chunks(channels)) {
        let mut out = Image::zeros(width, height, channels);
        for (c, field) in fields.iter().enumerate() {
            let map = map_of(field, width, height).ok_or_else(|| bad("a view without pixels"))?;
            let plane = channel(image, c);
            let done = warp(
                &plane,
                &map,
                Lobes::Four,
                Border::Reflect101,
                SimdLevel::detect(),
            );
            let to = out.data_mut().iter_mut().skip(c).step_by(channels);
            to.zip(done.image.data()).for_each(|(to, v)| *to = *v);
            (valid.iter_mut().zip(done.valid)).for_each(|(all, this)| *all &= this);
        }
        images.push(out);
    }
    let views = Views::new(views.subpixels(), images).map_err(|e| bad(&e.to_string()))?;
    let sum = (views.sum(Side::All)).ok_or_else(|| bad("a capture without views"))?;
    Ok(Corrected { views, sum, valid })
}

fn map_of(field: &SmoothField, width: usize, height: usize) -> Option<Map> {
    let position = |x: usize, y: usize| {
        let at = [x as f64, y as f64];
        let [dx, dy] = field.at(at);
        (at[0] + dx, at[1] + dy)
    };
    Map::from_fn(width, height, position).ok()
}

/// Sharpness of one channel of the sum before and after, on the common valid area.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct BeforeAfter {
    /// Of the sum of the views as they are.
    pub raw: Sharpness,
    /// Of the sum of the warped views.
    pub corrected: Sharpness,
    /// Pixels left out on each side.
    pub margin_px: usize,
}

impl BeforeAfter {
    /// Measures channel `c` of both, on the largest centred rectangle in which all pixels of `corrected` are valid.
    ///
    /// # Errors
    /// No pixel is valid, or there is no such channel.
    pub fn measure(
        raw: &Views,
        corrected: &Corrected,
        c: usize,
        settings: &SharpnessSettings,
    ) -> Result<Self, SharpnessError> {
        let before = raw.sum(Side::All).ok_or(SharpnessError::Empty)?;
        let (width, height) = (before.width(), before.height());
        let margin_px = margin(&corrected.valid, width, height);
        if 2 * margin_px >= width.min(height) {
            return Err(SharpnessError::NoneValid { width, height });
        }
        let measured = |image: &Image| sharpness(&crop(image, c, margin_px)?, settings);
        Ok(Self {
            raw: measured(&before)?,
            corrected: measured(&corrected.sum)?,
            margin_px,
        })
    }
}

/// Smallest margin that leaves out all pixels that are not valid.
fn margin(valid: &[bool], width: usize, height: usize) -> usize {
    (valid.iter().enumerate())
        .filter(|(_, valid)| !**valid)
        .map(|(i, _)| {
            let (x, y) = (i % width, i / width);
            x.min(y).min(width - 1 - x).min(height - 1 - y) + 1
        })
        .max()
        .unwrap_or(0)
}

fn crop(image: &Image, c: usize, margin: usize) -> Result<Plane, SharpnessError> {
    let (width, height) = (
        image.width().saturating_sub(2 * margin),
        image.height().saturating_sub(2 * margin),
    );
    let values = (0..height)
        .flat_map(|y| (0..width).map(move |x| (x, y)))
        .map(|(x, y)| f64::from(image.pixel(x + margin, y + margin)[c]))
        .collect();
    Plane::new(width, height, values)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::sensor::Subpixels;

    #[test]
    fn views_without_a_valid_middle_are_refused_by_their_size() {
        let view = Image::from_vec(8, 6, 1, vec![0.5; 48]).unwrap();
        let views = Views::new(Subpixels::DUAL_X, vec![view.clone(), view.clone()]).unwrap();
        let measure = |hole: Option<usize>| {
            let mut valid = vec![true; 48];
            if let Some(at) = hole {
                valid[at] = false;
            }
            let corrected = Corrected {
                views: views.clone(),
                sum: view.clone(),
                valid,
            };
            let settings = SharpnessSettings::wee_abstract();
            BeforeAfter::measure(&views, &corrected, 0, &settings).map(|found| found.margin_px)
        };
        assert_eq!(measure(None), Ok(0));
        assert_eq!(measure(Some(8 + 3)), Ok(2));
        let middle = measure(Some(3 * 8 + 4)).unwrap_err();
        assert!(middle.to_string().starts_with("of 8 x 6 px"), "{middle}");
    }
}
