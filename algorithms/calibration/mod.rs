//! Calibration of a lens's aberration: a smooth field of shifts for each sub-pixel view and colour channel.
//!
//! ```text
//! d_{v,c}(x) = argmax ZNCC( R(x), I_{v,c}(x + d) )      R = Σ_v I_{v,green}      d_{v,c} ≈ Σ_mn a_mn T_m(u) T_n(v)
//! ```
//!
//! That is the shift that lines up this chart best ([`Align::Texture`]). A skewed spot shifts fine texture less than
//! coarse; its centroid, which depth needs, is what [`crate::centroid`] makes of it ([`Align::Centroid`]).
//!
//! The chart is flat, textured and in focus, so that an ideal lens would shift nothing: what is measured is the
//! aberration's disparity (section 3.3 of the quad-pixel paper). I_{v,c}: view v, channel c; R: the reference; d to the
//! right and down, px; T: see [`crate::field`]. [`Calibration`] is the JSON file, self-describing: a reader needs
//! nothing but it.

mod error;

use quadpixel::image::{Image, channel};
use serde::{Deserialize, Serialize};

use crate::calibrated_camera::CalibratedCamera;
use crate::centroid::Reference;
use crate::disparity::{MatchSettings, match_images};
use crate::field::{FieldFit, Loss, SmoothField};
use crate::sai::{Side, Views};
pub use error::CalibrationError;

/// First line of the file; another one is another kind of file.
const FORMAT: &str = "quadpixel aberration calibration";

/// Version of the file's layout.
const VERSION: u32 = 2;

/// What the fields line up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Align {
    /// Centroids of the spots: the disparity as datasets define it, whatever the chart.
    Centroid,
    /// The chart's texture, by block matching: sharpest at that chart's frequencies.
    Texture,
}

/// How to match and fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationSettings {
    /// Matching.
    pub matching: MatchSettings,
    /// Degree of the field.
    pub degree: usize,
    /// What to line up.
    pub align: Align,
    /// Smoothing for centroids (σ of a Gaussian), px, at least 1.5; `None`: what the views ask for.
    pub smoothing_px: Option<f64>,
}

impl Default for CalibrationSettings {
    /// Window 31 px: the field is smooth, so that noise and not detail limits it; centroids; degree 2, enough for a
    /// window of a few hundred pixels (a whole sensor wants 4 to 6).
    fn default() -> Self {
        Self {
            matching: MatchSettings {
                window_px: 31,
                ..MatchSettings::default()
            },
            degree: 2,
            align: Align::Centroid,
            smoothing_px: None,
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
    pub camera: CalibratedCamera,
    /// What the fields line up.
    pub align: Align,
    /// Window of the matching, px.
    pub window_px: usize,
    /// Smoothing (σ of a Gaussian) before the centroids were fitted, px; null for texture.
    pub smoothing_px: Option<f64>,
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
    /// Root mean square of what the fit leaves over, px per axis (for centroids: the shift that would make such a
    /// difference).
    pub residual_rms_px: f64,
    /// Share of the valid matches (for centroids: of the samples) that the fit rejected, 0 to 1.
    pub rejected_share: f64,
    /// Share of the matches that were valid, 0 to 1.
    pub valid_share: f64,
}

impl Calibration {
    /// Matches each view and channel of a chart's capture against the green of the sum, and fits the fields.
    ///
    /// # Errors
    /// Settings out of their range, views that are too small, or too little texture for the fields.
    pub fn from_chart(
        views: &Views,
        camera: &CalibratedCamera,
        settings: &CalibrationSettings,
    ) -> Result<Self, CalibrationError> {
        let sum = views.sum(Side::All);
        let sum = sum.ok_or_else(|| CalibrationError::File("a capture without views".into()))?;
        let reference = channel(&sum, camera.reference_channel());
        let mut matched = Vec::new();
        for (index, view) in views.images().iter().enumerate() {
            let subpixel = views.subpixels().name(index);
            for (c, name) in camera.channels.iter().enumerate() {
                matched.push(Matched::new(
                    &reference,
                    channel(view, c),
                    &subpixel,
                    name,
                    settings,
                )?);
            }
        }
        let centroids = match settings.align {
            Align::Texture => None,
            Align::Centroid => {
                let green = matched.iter().skip(camera.reference_channel());
                let views: Vec<_> = (green.step_by(camera.channels.len()))
                    .map(|m| (&m.view, &m.fit.field))
                    .collect();
                let made = match settings.smoothing_px {
                    None => Reference::for_views(&reference, settings.degree, &views),
                    Some(px) => Reference::new(&reference, settings.degree, px),
                };
                Some(made.map_err(|error| CalibrationError::Reference { error })?)
            }
        };
        let fields = (matched.iter())
            .map(|m| m.field(centroids.as_ref()))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            camera: camera.clone(),
            align: settings.align,
            window_px: settings.matching.window_px,
            smoothing_px: centroids.map(|c| c.sigma_px()),
            fields,
        })
    }

    /// The file's text.
    ///
    /// # Errors
    /// A number that JSON cannot hold.
    pub fn to_json(&self) -> Result<String, CalibrationError> {
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|e| CalibrationError::File(e.to_string()))
    }

    /// Reads a file's bytes and checks that it has a field for each view and channel.
    ///
    /// # Errors
    /// Bytes that are no such file, of this version, with a field per view and channel.
    pub fn from_json(bytes: &[u8]) -> Result<Self, CalibrationError> {
        let bad = CalibrationError::File;
        let file: Self = serde_json::from_slice(bytes).map_err(|e| bad(e.to_string()))?;
        if file.format != FORMAT || file.version != VERSION {
            return Err(bad(format!(
                "format {:?} version {}: allowed is {FORMAT:?} version {VERSION}",
                file.format, file.version
            )));
        }
        let subpixels = file.camera.subpixels;
        let wanted = (0..subpixels.count())
            .flat_map(|v| (file.camera.channels.iter()).map(move |c| (subpixels.name(v), c)));
        let found = (file.fields.iter()).map(|f| (f.subpixel.clone(), &f.channel));
        if !wanted.eq(found) {
            return Err(bad(
                "fields: there must be one a view and channel, in order".into(),
            ));
        }
        file.smooth_fields()?;
        Ok(file)
    }

    /// The fields, in the order of [`Calibration::fields`].
    ///
    /// # Errors
    /// A field whose numbers fit no degree.
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

/// A view's channel, matched.
struct Matched {
    view: Image,
    subpixel: String,
    channel: String,
    fit: FieldFit,
    valid_share: f64,
}

impl Matched {
    fn new(
        reference: &Image,
        view: Image,
        subpixel: &str,
        channel: &str,
        settings: &CalibrationSettings,
    ) -> Result<Self, CalibrationError> {
        let (subpixel, channel) = (subpixel.to_owned(), channel.to_owned());
        let found = match match_images(reference, &view, &settings.matching) {
            Ok(found) => found,
            Err(error) => {
                let view = subpixel;
                return Err(CalibrationError::Match {
                    view,
                    channel,
                    error,
                });
            }
        };
        let observations = found.observations();
        match SmoothField::fit(&observations, settings.degree, Loss::Tukey) {
            Ok(fit) => Ok(Self {
                view,
                subpixel,
                channel,
                fit,
                valid_share: observations.len() as f64 / found.grid.len() as f64,
            }),
            Err(error) => Err(CalibrationError::Field {
                view: subpixel,
                channel,
                error,
            }),
        }
    }

    /// The field of the texture, or of the centroids.
    fn field(&self, centroids: Option<&Reference>) -> Result<CalibratedField, CalibrationError> {
        let fit = centroids.map(|reference| reference.fit(&self.view, &self.fit.field));
        let fit = fit.transpose().map_err(|error| CalibrationError::Field {
            view: self.subpixel.clone(),
            channel: self.channel.clone(),
            error,
        })?;
        let (field, residual_rms_px, rejected_share) = match &fit {
            None => (&self.fit.field, self.fit.rms_px, self.fit.rejected_share()),
            Some(fit) => (&fit.field, fit.rms_px, fit.rejected_share),
        };
        Ok(CalibratedField {
            subpixel: self.subpixel.clone(),
            channel: self.channel.clone(),
            centre_px: field.centre_px(),
            half_span_px: field.half_span_px(),
            coefficients_px: field.coefficients().clone(),
            residual_rms_px,
            rejected_share,
            valid_share: self.valid_share,
        })
    }
}
