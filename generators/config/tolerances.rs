//! `[lens.tolerances]`: how far each element and surface may be from its prescription.

use serde::{Deserialize, Serialize};

use super::{Draw, number};
use crate::field_error::FieldError;

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
    pub(super) fn check(&self) -> Result<(), FieldError> {
        use quadpixel::lens::{LARGEST_INDEX_DEVIATION, LARGEST_RADIUS_PERCENT, LARGEST_TURN_DEG};
        let within = |most: f64| [-most, most];
        #[rustfmt::skip] // because it is a table
        let rows = [
            ("lens.tolerances.decentre_um", Some(self.decentre_um), within(1e3)),
            ("lens.tolerances.despace_um", Some(self.despace_um), within(1e3)),
            ("lens.tolerances.tilt_deg", Some(self.tilt_deg), within(LARGEST_TURN_DEG)),
            ("lens.tolerances.radius_percent", Some(self.radius_percent), within(LARGEST_RADIUS_PERCENT)),
            ("lens.tolerances.index", Some(self.index), within(LARGEST_INDEX_DEVIATION)),
        ];
        number::check(&rows)
    }
}
