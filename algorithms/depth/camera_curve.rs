//! The camera's relation of disparity and depth at each place of the picture, by its description or by a measured
//! curve.

use quadpixel_datasets::{CameraDescription, RatioField};

use super::curve::{Depth, DepthCurve};
use super::curve_error::CurveError;
use super::described_curve::DescribedCurve;
use super::field_curve::FieldCurve;
use super::halves::{Measured, combine};

/// Where depth comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraCurve {
    /// By the camera's description, aberrations included.
    Described(DescribedCurve),
    /// The paraxial camera with the pixel's κ.
    Paraxial(ParaxialCurve),
    /// A measured curve over the field.
    Field(FieldCurve),
}

/// The paraxial camera: fx A, the focus, and κ over the window.
#[derive(Clone, Debug, PartialEq)]
pub struct ParaxialCurve {
    inverse_focus_per_m: f64,
    fx_a_px_m: f64,
    pupil_behind_vertex_m: f64,
    kappa: Kappa,
}

/// κ, the ratio of disparity to circle of confusion.
#[derive(Clone, Debug, PartialEq)]
enum Kappa {
    /// One for the whole window and both directions.
    Constant(f64),
    /// Over the window.
    Fields {
        /// Of left and right; of top and bottom where the pixel has one column.
        main: RatioField,
        /// Of top and bottom, where the pixel is parted in both directions.
        top_bottom: Option<RatioField>,
        size_px: [u32; 2],
    },
}

impl ParaxialCurve {
    /// By a camera's description; `kappa` takes the place of its ratio.
    ///
    /// # Errors
    /// Neither tells κ, or κ fx A is not above 0.
    pub fn new(camera: &CameraDescription, kappa: Option<f64>) -> Result<Self, CurveError> {
        let (lens, p) = (
            &camera.intrinsics,
            camera.intrinsics.pinhole_behind_vertex_m,
        );
        let ratio = &camera.disparity_ratio;
        let kappa = match (kappa, &ratio.left_right, &ratio.top_bottom) {
            (Some(kappa), ..) => Kappa::Constant(kappa),
            (None, None, None) => return Err(CurveError::NoRatio),
            (None, Some(main), other) | (None, None, other @ Some(main)) => Kappa::Fields {
                main: main.clone(),
                top_bottom: other.clone().filter(|_| ratio.left_right.is_some()),
                size_px: [camera.width_px, camera.height_px],
            },
        };
        if let Kappa::Fields {
            main, top_bottom, ..
        } = &kappa
            && !(main.is_sound() && top_bottom.as_ref().is_none_or(RatioField::is_sound))
        {
            return Err(CurveError::Nodes);
        }
        let curve = Self {
            inverse_focus_per_m: camera.focus.distance_m.map_or(0.0, |z| 1.0 / (z + p)),
            fx_a_px_m: lens.fx_px * lens.entrance_pupil_diameter_m,
            pupil_behind_vertex_m: p,
            kappa,
        };
        match curve.mean_gain_px_m() {
            gain if gain > 0.0 && gain.is_finite() => Ok(curve),
            _ => Err(CurveError::Gain),
        }
    }

    /// κ fx A, px·m, with the mean of κ over the window.
    pub fn mean_gain_px_m(&self) -> f64 {
        match &self.kappa {
            Kappa::Constant(kappa) => kappa * self.fx_a_px_m,
            Kappa::Fields { main, .. } => main.mean * self.fx_a_px_m,
        }
    }

    /// The curve at column x and row y; `None` where κ is not above 0 there: the halves see the same part of the pupil.
    pub fn at(&self, [x, y]: [usize; 2]) -> Option<DepthCurve> {
        let kappa = match &self.kappa {
            Kappa::Constant(kappa) => *kappa,
            Kappa::Fields { main, size_px, .. } => main.at([x as f64, y as f64], *size_px),
        };
        let gain_px_m = kappa * self.fx_a_px_m;
        (gain_px_m > 0.0 && gain_px_m.is_finite()).then_some(DepthCurve {
            inverse_focus_per_m: self.inverse_focus_per_m,
            gain_px_m,
            pupil_behind_vertex_m: self.pupil_behind_vertex_m,
        })
    }

    /// What a shift of top and bottom would be of left and right; `None` where κ is not above 0 there.
    pub fn as_left_right(&self, [x, y]: [usize; 2], vertical: Measured) -> Option<Measured> {
        let Kappa::Fields {
            main,
            top_bottom: Some(top_bottom),
            size_px,
        } = &self.kappa
        else {
            return Some(vertical);
        };
        let at = [x as f64, y as f64];
        let (across, down) = (main.at(at, *size_px), top_bottom.at(at, *size_px));
        (across > 0.0 && down > 0.0).then(|| Measured {
            disparity_px: vertical.disparity_px * (across / down),
            sigma_px: vertical.sigma_px * (across / down),
        })
    }
}

impl CameraCurve {
    /// Depth of the disparities measured at column x and row y: x_L − x_R, y_T − y_B; `None` where nothing is measured
    /// or the camera tells none.
    pub fn depth(
        &self,
        at: [usize; 2],
        left_right: Option<Measured>,
        top_bottom: Option<Measured>,
    ) -> Option<Depth> {
        match self {
            Self::Described(curve) => curve.depth(at, left_right, top_bottom),
            Self::Paraxial(curve) => {
                let vertical = top_bottom.and_then(|v| curve.as_left_right(at, v));
                let measured = combine(left_right, vertical)?;
                let curve = curve.at(at)?;
                Some(curve.depth(measured.disparity_px, measured.sigma_px))
            }
            Self::Field(curve) => {
                let measured = combine(left_right, top_bottom)?;
                Some(curve.depth(at.map(|v| v as f64), measured))
            }
        }
    }
}
