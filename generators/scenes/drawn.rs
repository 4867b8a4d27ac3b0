//! The numbers that a world is made from.

use serde::{Deserialize, Serialize};

use super::error::SceneError;
use crate::field_error::FieldError;

/// A kind of world.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WorldKind {
    /// A room with furniture, shelves, pictures and lamps.
    Room,
    /// A still life on a table.
    TableTop,
    /// Shapes in mid air before a backdrop.
    FlyingShapes,
}

/// The numbers of a world, drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawn {
    /// What it is.
    pub kind: WorldKind,
    /// Seed of shapes, places, pictures and finishes.
    pub seed: u64,
    /// Depth of the nearest objects, mm from the first lens vertex.
    pub near_mm: f64,
    /// Depth of the backdrop, mm.
    pub far_mm: f64,
    /// Number of objects (clutter), 0 to 400.
    pub objects: u32,
    /// Share of thin structures among them, 0 to 1.
    pub thin: f64,
    /// Share of glass, panes and veils among them, 0 to 1 (with `thin` at most 1).
    pub clear: f64,
    /// Number of small bright points, which blur to bokeh, 0 to 400.
    pub glints: u32,
}

impl WorldKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Room, Self::TableTop, Self::FlyingShapes];

    /// Its name, as in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Room => "room",
            Self::TableTop => "table-top",
            Self::FlyingShapes => "flying-shapes",
        }
    }
}

impl Drawn {
    pub(super) fn check(&self) -> Result<(), SceneError> {
        let bad = |field: &str, value: f64, allowed: &str| {
            let field = format!("world.{field}");
            Err(FieldError::new(field, value, allowed.to_owned()).into())
        };
        // Written so that NaN fails.
        if !(self.near_mm > 0.0 && self.near_mm.is_finite()) {
            return bad("near_mm", self.near_mm, "a positive length");
        }
        if !(self.far_mm > 1.05 * self.near_mm && self.far_mm.is_finite()) {
            return bad("far_mm", self.far_mm, "at least 1.05 near_mm");
        }
        if !(self.thin >= 0.0 && self.clear >= 0.0 && self.thin + self.clear <= 1.0) {
            let sum = self.thin + self.clear;
            return bad("thin + clear", sum, "0 to 1, neither negative");
        }
        for (field, n) in [("objects", self.objects), ("glints", self.glints)] {
            if n > 400 {
                return bad(field, f64::from(n), "0 to 400");
            }
        }
        Ok(())
    }

    /// A depth between `near_mm` and `far_mm`, even in its inverse (and so in disparity) at t ∈ [0, 1].
    pub(super) fn depth_mm(&self, t: f64) -> f64 {
        1.0 / (1.0 / self.near_mm + t * (1.0 / self.far_mm - 1.0 / self.near_mm))
    }
}
