//! `[lens.tolerances]`: how far each element and surface may be from its prescription.

use quadpixel::command::CommandError;
use serde::{Deserialize, Serialize};

use super::Draw;

/// Ranges from which the deviations of every element and surface are drawn, each its own; 0 where left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ToleranceConfig {
    /// Decentre of each element along x and along y, µm.
    pub decentre_um: Draw,
    /// Despace of each element along the axis, µm.
    pub despace_um: Draw,
    /// Tip and tilt of each element, deg.
    pub tilt_deg: Draw,
    /// Radius of each curved surface, %.
    pub radius_percent: Draw,
    /// Index of each glass.
    pub index: Draw,
}

impl Default for ToleranceConfig {
    fn default() -> Self {
        let none = Draw::Fixed(0.0);
        Self {
            decentre_um: none,
            despace_um: none,
            tilt_deg: none,
            radius_percent: none,
            index: none,
        }
    }
}

impl ToleranceConfig {
    pub(super) fn check(&self) -> Result<(), CommandError> {
        use quadpixel::lens::LARGEST_TURN_DEG;
        use quadpixel::lens::{LARGEST_INDEX_DEVIATION, LARGEST_RADIUS_PERCENT};
        let within = |draw: &Draw, field: &str, most: f64| {
            draw.check(&format!("lens.tolerances.{field}"), (-most, most))
        };
        within(&self.decentre_um, "decentre_um", 1e3)?;
        within(&self.despace_um, "despace_um", 1e3)?;
        within(&self.tilt_deg, "tilt_deg", LARGEST_TURN_DEG)?;
        within(
            &self.radius_percent,
            "radius_percent",
            LARGEST_RADIUS_PERCENT,
        )?;
        within(&self.index, "index", LARGEST_INDEX_DEVIATION)
    }
}
