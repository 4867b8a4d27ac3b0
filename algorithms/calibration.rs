//! Calibration of a lens's aberration: a smooth field of shifts for each sub-pixel view and colour channel.
//!
//! ```text
//! d_{v,c}(x) = argmax ZNCC( R(x), I_{v,c}(x + d) )      R = Σ_v I_{v,green}      d_{v,c} ≈ Σ_mn a_mn T_m(u) T_n(v)
//! ```
//!
//! The chart is flat, textured and in focus, so that an ideal lens would shift nothing: what is measured is the aberration's
//! disparity (section 3.3 of the quad-pixel paper). I_{v,c}: view v, channel c; R: the reference; d to the right and down, px;
//! T: see [`crate::field`]. [`Calibration`] is the JSON file, self-describing: a reader needs nothing but it.

use quadpixel::image::{Image, channel};
use serde::{Deserialize, Serialize};

use crate::capture::{Camera, Capture};
use crate::disparity::{MatchError, MatchSettings, match_images};
use crate::field::{FieldError, Loss, SmoothField};
use crate::sai::Side;

/// First line of the file; another one is another kind of file.
const FORMAT: &str = "quadpixel aberration calibration";

/// Version of the file's layout.
const VERSION: u32 = 1;

/// How to match and fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationSettings {
    /// Matching.
    pub matching: MatchSettings,
    /// Degree of the field.
    pub degree: usize,
}

impl Default for CalibrationSettings {
    /// Window 31 px: the field is smooth, so that noise and not detail limits it; degree 3.
    fn default() -> Self {
        Self {
            matching: MatchSettings {
                window_px: 31,
                ..MatchSettings::default()
            },
            degree: 3,
        }
    }
}

/// A calibration file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    format: String,
    version: u32,
    /// The camera it is for.
    pub camera: Camera,
    /// Window of the matching, px.
    pub window_px: usize,
    /// One a view and channel, views in index order, in each the channels in order.
    pub fields: Vec<CalibratedField>,
}

/// The field of one view and channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibratedField {
    /// Name of the sub-pixel.
    pub subpixel: String,
    /// Name of the channel.
    pub channel: String,
    /// Middle of the rectangle that −1..1 stands for, px.
    pub centre_px: [f64; 2],
    /// Half its sides, px.
    pub half_span_px: [f64; 2],
    /// Chebyshev coefficients of the right and the down component, px, by total degree: T0T0, T1T0, T0T1, T2T0, T1T1, …
    pub coefficients_px: [Vec<f64>; 2],
    /// Root mean square of what the fit leaves over, px an axis.
    pub residual_rms_px: f64,
    /// Share of the valid matches that the fit rejected, 0 to 1.
    pub rejected_share: f64,
    /// Share of the matches that were valid, 0 to 1.
    pub valid_share: f64,
}

/// A capture that gives no calibration, or a file that is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// It cannot be matched.
    #[error("view {view}, channel {channel}: {error}")]
    Match {
        /// Sub-pixel.
        view: String,
        /// Channel.
        channel: String,
        /// Why.
        error: MatchError,
    },
    /// No field fits.
    #[error("view {view}, channel {channel}: {error}: is the chart textured and in focus?")]
    Field {
        /// Sub-pixel.
        view: String,
        /// Channel.
        channel: String,
        /// Why.
        error: FieldError,
    },
    /// Not such a file.
    #[error("no calibration: {0}")]
    File(String),
}

impl Calibration {
    /// Matches each view and channel of `capture` against the green of the sum, and fits the fields.
    pub fn of_chart(
        capture: &Capture,
        settings: &CalibrationSettings,
    ) -> Result<Self, CalibrationError> {
        let camera = &capture.camera;
        let sum = capture.views.sum(Side::All);
        let sum = sum.ok_or_else(|| CalibrationError::File("a capture without views".into()))?;
        let reference = channel(&sum, camera.reference_channel());
        let mut fields = Vec::new();
        for (index, view) in capture.views.images().iter().enumerate() {
            let subpixel = capture.views.partition().name(index);
            for (c, name) in camera.channels.iter().enumerate() {
                let plane = channel(view, c);
                fields.push(field(&reference, &plane, &subpixel, name, settings)?);
            }
        }
        Ok(Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            camera: camera.clone(),
            window_px: settings.matching.window_px,
            fields,
        })
    }

    /// The file's text.
    pub fn to_json(&self) -> Result<String, CalibrationError> {
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|e| CalibrationError::File(e.to_string()))
    }

    /// Reads a file's bytes and checks that it has a field for each view and channel.
    pub fn from_json(bytes: &[u8]) -> Result<Self, CalibrationError> {
        let bad = CalibrationError::File;
        let read: Self = serde_json::from_slice(bytes).map_err(|e| bad(e.to_string()))?;
        if read.format != FORMAT || read.version != VERSION {
            return Err(bad(format!(
                "format {:?} version {}: allowed is {FORMAT:?} version {VERSION}",
                read.format, read.version
            )));
        }
        let partition: crate::sai::Partition = (read.camera.subpixels.parse())
            .map_err(|e: crate::sai::SaiError| bad(e.to_string()))?;
        let wanted = (0..partition.count())
            .flat_map(|v| (read.camera.channels.iter()).map(move |c| (partition.name(v), c)));
        let found = (read.fields.iter()).map(|f| (f.subpixel.clone(), &f.channel));
        if !wanted.eq(found) {
            return Err(bad(
                "fields: there must be one a view and channel, in order".into(),
            ));
        }
        read.smooth_fields()?;
        Ok(read)
    }

    /// The fields, in the order of [`Calibration::fields`].
    pub fn smooth_fields(&self) -> Result<Vec<SmoothField>, CalibrationError> {
        (self.fields.iter())
            .map(|f| {
                SmoothField::from_parts(f.centre_px, f.half_span_px, f.coefficients_px.clone())
                    .ok_or_else(|| {
                        CalibrationError::File(format!(
                            "field of {} {}: its numbers fit no degree, or a span is not above 0",
                            f.subpixel, f.channel
                        ))
                    })
            })
            .collect()
    }
}

fn field(
    reference: &Image,
    view: &Image,
    subpixel: &str,
    channel: &str,
    settings: &CalibrationSettings,
) -> Result<CalibratedField, CalibrationError> {
    let found = match_images(reference, view, &settings.matching).map_err(|error| {
        CalibrationError::Match {
            view: subpixel.to_owned(),
            channel: channel.to_owned(),
            error,
        }
    })?;
    let observations = found.observations();
    let fit = SmoothField::fit(&observations, settings.degree, Loss::Tukey).map_err(|error| {
        CalibrationError::Field {
            view: subpixel.to_owned(),
            channel: channel.to_owned(),
            error,
        }
    })?;
    Ok(CalibratedField {
        subpixel: subpixel.to_owned(),
        channel: channel.to_owned(),
        centre_px: fit.field.centre_px(),
        half_span_px: fit.field.half_span_px(),
        coefficients_px: fit.field.coefficients().clone(),
        residual_rms_px: fit.rms_px,
        rejected_share: fit.rejected_share(),
        valid_share: observations.len() as f64 / found.grid.len() as f64,
    })
}
