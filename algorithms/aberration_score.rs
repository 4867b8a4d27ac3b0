//! How well a calibration knows the aberration's disparity: only here, after the estimate is made, is a sample's truth
//! read.
//!
//! ```text
//! e_v(x) = d_{v,green}(x) − (traced_v(x) − paraxial_v(x))        over all views v and valid pixels x
//! ```

use std::path::{Path, PathBuf};

use quadpixel::image::ImageError;
use quadpixel::image::exr::read_layers;

use crate::calibration::{Calibration, CalibrationError};

/// Lengths of a set of vectors, px.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Lengths {
    /// Root mean square.
    pub rms_px: f64,
    /// 95th percentile.
    pub p95_px: f64,
}

/// Estimate against truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct AberrationScore {
    /// Length of the aberration's true disparity: what is left when nothing is corrected.
    pub truth: Lengths,
    /// Length of estimated minus true.
    pub residual: Lengths,
    /// Vectors compared.
    pub count: usize,
}

/// A truth that cannot be compared with.
#[derive(Debug, thiserror::Error)]
pub enum AberrationScoreError {
    /// It cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The calibration's fields are none.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// It lacks what is compared.
    #[error("{}: {lack}", path.display())]
    Lack {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        lack: String,
    },
}

impl AberrationScore {
    /// Compares the reference channel's fields with the sample's `disparity.exr`.
    ///
    /// # Errors
    /// The file cannot be read, lacks a view or channel, is of another size, or has no valid pixel.
    pub fn read(calibration: &Calibration, sample: &Path) -> Result<Self, AberrationScoreError> {
        let path = sample.join("disparity.exr");
        let bad = |lack: String| AberrationScoreError::Lack {
            path: path.clone(),
            lack,
        };
        let layers = read_layers(&path)?;
        let fields = calibration.smooth_fields()?;
        let camera = &calibration.camera;
        let green = &camera.channels[camera.reference_channel()];
        let (mut truth, mut residual) = (Vec::new(), Vec::new());
        for (named, field) in calibration.fields.iter().zip(&fields) {
            if &named.channel != green {
                continue;
            }
            let layer = (layers.iter().find(|l| l.name == named.subpixel))
                .ok_or_else(|| bad(format!("it has no layer {}", named.subpixel)))?;
            let index = |name: &str| {
                let found = layer.channels.iter().position(|c| c == name);
                found.ok_or_else(|| bad(format!("{} has no {name}", named.subpixel)))
            };
            let traced = [index("dx")?, index("dy")?];
            let paraxial = [index("paraxial_dx")?, index("paraxial_dy")?];
            let image = &layer.image;
            if (image.width(), image.height()) != (camera.width_px, camera.height_px) {
                return Err(bad("its size is not that of the views".to_owned()));
            }
            for y in 0..image.height() {
                for x in 0..image.width() {
                    let pixel = image.pixel(x, y);
                    let real = [0, 1].map(|a| f64::from(pixel[traced[a]] - pixel[paraxial[a]]));
                    if real.iter().all(|v| v.is_finite()) {
                        let found = field.at([x as f64, y as f64]);
                        truth.push(real[0].hypot(real[1]));
                        residual.push((found[0] - real[0]).hypot(found[1] - real[1]));
                    }
                }
            }
        }
        let count = truth.len();
        if count == 0 {
            return Err(bad("it has no valid pixel".to_owned()));
        }
        Ok(Self {
            truth: lengths(truth),
            residual: lengths(residual),
            count,
        })
    }
}

/// `values` is not empty.
fn lengths(mut values: Vec<f64>) -> Lengths {
    values.sort_by(f64::total_cmp);
    let squares: f64 = values.iter().map(|v| v * v).sum();
    Lengths {
        rms_px: (squares / values.len() as f64).sqrt(),
        p95_px: values[(values.len() - 1) * 95 / 100],
    }
}
