//! Reading a response, ray by ray.
//!
//! ```text
//! AngularResponse, GeometricResponse ─▶ Response ─ at a wavelength ─▶ ResponseLookup: interpolators, boxes
//! ```

mod axes;
mod interpolator;
mod lookup;
mod shifted_interpolator;
mod table_lookup;

pub use interpolator::Interpolator;
pub use lookup::{Response, ResponseLookup};
pub use shifted_interpolator::ShiftedInterpolator;
