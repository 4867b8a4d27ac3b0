//! Pictures of a lens as SVG: its section with fans of rays, and its spot diagrams.

mod layout;
mod spots;

pub use layout::layout_svg;
pub use spots::spots_svg;

use super::aim::Field;
use super::error::LensError;
use super::placed::Lens;

/// Largest field angle looked for, degrees.
const WIDEST_FIELD_DEG: f64 = 89.0;
/// Steps in which it is looked for.
const FIELD_STEPS: usize = 200;

impl Lens {
    /// Half the field of view, degrees: what the source states, or else the last field verified, or else the widest; and in any case
    /// no wider than where the chief ray still passes.
    ///
    /// # Errors
    /// None for a lens that [`Lens::new`] made.
    pub fn half_field_deg(&self) -> Result<f64, LensError> {
        let prescription = self.prescription();
        let verified = prescription.verification.rms_spot_um.last();
        let given = prescription
            .stated
            .half_fov_deg
            .or(verified.map(|f| f.field_deg))
            .unwrap_or(WIDEST_FIELD_DEG)
            .clamp(0.0, WIDEST_FIELD_DEG);
        for step in (1..=FIELD_STEPS).rev() {
            let angle = given * step as f64 / FIELD_STEPS as f64;
            if self.chief_ray(Field::up(angle))?.is_some() {
                return Ok(angle);
            }
        }
        Ok(0.0)
    }
}
