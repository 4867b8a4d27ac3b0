//! A depth map against the truth. Only here is a truth read, after the estimate is made.

use std::path::{Path, PathBuf};

use quadpixel::image::{Image, ImageError, raster};

use super::camera_curve::ParaxialCurve;

/// Estimate against `depth.exr`, over the pixels that have both and are not sky.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct DepthScore {
    /// Median of |Z/Z_true − 1|.
    pub median_relative: f64,
    /// Its 95th percentile.
    pub p95_relative: f64,
    /// Root mean square of the difference as disparities, px.
    pub disparity_rms_px: f64,
    /// Pixels compared.
    pub count: usize,
}

/// A truth that cannot be compared with.
#[derive(Debug, thiserror::Error)]
pub enum DepthScoreError {
    /// It cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Another size than the estimate's.
    #[error("{}: its size is not that of the views", .0.display())]
    Size(PathBuf),
    /// Nothing in common.
    #[error("{}: no pixel has both a depth and an estimate", .0.display())]
    NothingInCommon(PathBuf),
}

impl DepthScore {
    /// Compares a depth map, m, with the first channel of the file at `path`; `curve` turns depths into disparities.
    ///
    /// # Errors
    /// The file cannot be read, is of another size, or has no pixel in common with the estimate.
    pub fn read(
        path: &Path,
        depth_m: &Image,
        curve: &ParaxialCurve,
    ) -> Result<Self, DepthScoreError> {
        let truth = raster::read(path)?;
        let width = depth_m.width();
        if (truth.width(), truth.height()) != (width, depth_m.height()) {
            return Err(DepthScoreError::Size(path.to_path_buf()));
        }
        let truths = truth.data().iter().step_by(truth.channels());
        let (mut errors, mut squares) = (Vec::new(), 0.0);
        for (i, (estimate, truth)) in depth_m.data().iter().zip(truths).enumerate() {
            let (estimate, truth) = (f64::from(*estimate), f64::from(*truth));
            let curve = curve.at([i % width, i / width]);
            let (true, Some(curve)) = (estimate.is_finite() && truth.is_finite(), curve) else {
                continue;
            };
            errors.push((estimate / truth - 1.0).abs());
            squares += (curve.disparity_px(estimate) - curve.disparity_px(truth)).powi(2);
        }
        if errors.is_empty() {
            return Err(DepthScoreError::NothingInCommon(path.to_path_buf()));
        }
        errors.sort_by(f64::total_cmp);
        let at = |percent: usize| errors[(errors.len() - 1) * percent / 100];
        Ok(Self {
            median_relative: at(50),
            p95_relative: at(95),
            disparity_rms_px: (squares / errors.len() as f64).sqrt(),
            count: errors.len(),
        })
    }
}
