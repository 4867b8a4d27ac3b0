//! Metric depth from the shift between opposite views.
//!
//! ```text
//! views ─ halves ─▶ shifts D_h, D_v ─ calibration ─▶ without the lens's aberration ─ camera curve ─▶ depth
//! (with its deviation and confidence)
//!
//! D = (D_h/s_h² + D_v/s_v²)/(1/s_h² + 1/s_v²)       1/s_D² = 1/s_h² + 1/s_v²
//! 1/d = 1/d_f + D/(κ fx A)       Z = d − p       s_Z = d² s_D/(κ fx A)
//! ```
//!
//! - D_h = x_L − x_R and D_v = y_T − y_B, px: positive for points nearer than the focus; s their standard deviations;
//! - d: distance from the entrance pupil, d_f that in focus, p its depth behind the first vertex, A its diameter, m;
//!   fx: focal length, px; κ: disparity over circle of confusion, a property of lens and pixel. Source: "Metres from
//!   disparity" in the dataset's specification.
//!
//! Where the camera's κ differs in the two directions, D_v is brought to that of left and right before the mean. A
//! camera whose description has its disparity against distance ([`DescribedCurve`]) needs no κ: the aberrations of its
//! lens and what a matcher finds in the place of centroids are in it.

mod calibrate;
mod camera_curve;
mod curve;
mod curve_error;
mod described_curve;
mod field_curve;
mod halves;
mod maps;
mod score;
mod shifts;
mod slow_fields;

pub use calibrate::{
    CalibrateError, DepthCalibration, Part, PlaneShifts, REGIONS, calibrate, calibrate_by,
};
pub use camera_curve::{CameraCurve, ParaxialCurve};
pub use curve::{Depth, DepthCurve};
pub use curve_error::CurveError;
pub use described_curve::DescribedCurve;
pub use field_curve::{FieldCurve, FieldCurveError};
pub use halves::Measured;
pub(crate) use halves::{Pair, measure};
pub use maps::DepthMaps;
pub use score::{DepthScore, DepthScoreError};
pub use shifts::{ShiftError, Shifts};
