//! Worlds of meshes in a dataset: generated ones, or scene files.

use quadpixel::scene::world::PathSettings;
use serde::{Deserialize, Serialize};

use super::{ConfigError, Draw, Range, Scale, number};
use crate::scenes::WorldKind;

/// Worlds of meshes. What is absent is as in the commented section of the default configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorldConfig {
    /// Kinds of world; the samples take them in turn.
    pub kinds: Vec<WorldKind>,
    /// Depth of the nearest objects as a multiple of the focused depth.
    pub near_over_focus: Draw,
    /// Depth of the backdrop as a multiple of the focused depth.
    pub far_over_focus: Draw,
    /// Number of objects (rounded down): the clutter.
    pub objects: Draw,
    /// Share of wires, leaves and gratings among them, at difficulty 1.
    pub thin: Draw,
    /// Share of glass, panes and veils among them, at difficulty 1.
    pub clear: Draw,
    /// Number of small bright points, at difficulty 1 (rounded down).
    pub glints: Draw,
    /// Factor of the three, 0 to 1: 0 has solid, opaque things only.
    pub difficulty: Draw,
    /// How paths of light are followed.
    pub paths: PathSettings,
    /// Scene files in the place of all that; absent: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<WorldFileConfig>,
}

/// Scene files, and how each sample sees its one. Each recipe records the file's name and hash.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldFileConfig {
    /// `.gltf`, `.glb` or `.obj` files; the samples take them in turn.
    pub names: Vec<String>,
    /// Length of the files' unit, mm; absent: 1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_mm: Option<f64>,
    /// Names of cameras in the files: one is drawn a sample, and its place is the lens's; empty: the middle of
    /// everything stands on the axis, as the numbers below say.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<String>,
    /// Depth of the middle as a multiple of the focused depth.
    #[serde(default = "one")]
    pub distance_over_focus: Draw,
    /// Longest side of the box around everything as a multiple of the focused depth; absent: as it is in the file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_over_focus: Option<Draw>,
    /// Turn about the upright axis, deg: positive shows more of the left (−x) side.
    #[serde(default = "zero")]
    pub yaw_deg: Draw,
    /// Turn about the horizontal axis, deg: positive shows it from above.
    #[serde(default = "zero")]
    pub pitch_deg: Draw,
    /// Equirectangular panoramas (`.exr`, `.hdr`) that light it: one is drawn a sample; empty: an even sky.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub panoramas: Vec<String>,
    /// Radiance of the even sky, or factor of the panorama; absent: 1 where nothing in the file shines (and for
    /// panoramas), else 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<Draw>,
}

fn one() -> Draw {
    Draw::Fixed(1.0)
}

fn zero() -> Draw {
    Draw::Fixed(0.0)
}

impl Default for WorldConfig {
    fn default() -> Self {
        let range = |min, max, scale| Draw::Range(Range { min, max, scale });
        Self {
            kinds: WorldKind::ALL.to_vec(),
            near_over_focus: range(0.4, 0.8, Scale::Linear),
            far_over_focus: range(1.5, 4.0, Scale::Inverse),
            objects: range(8.0, 40.0, Scale::Linear),
            thin: range(0.1, 0.4, Scale::Linear),
            clear: range(0.0, 0.3, Scale::Linear),
            glints: range(0.0, 40.0, Scale::Linear),
            difficulty: range(0.0, 1.0, Scale::Linear),
            paths: PathSettings::default(),
            file: None,
        }
    }
}

impl WorldConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        if let Some(file) = &self.file {
            file.check()?;
        }
        if self.kinds.is_empty() {
            return Err(ConfigError::Together(
                "scene.world.kinds is empty; allowed: at least one of room, table-top, flying-shapes".into(),
            ));
        }
        #[rustfmt::skip] // because it is a table
        let rows = [
            ("scene.world.near_over_focus", Some(self.near_over_focus), [0.02, 50.0]),
            ("scene.world.far_over_focus", Some(self.far_over_focus), [0.05, 100.0]),
            ("scene.world.objects", Some(self.objects), [0.0, 400.99]),
            ("scene.world.thin", Some(self.thin), [0.0, 0.5]),
            ("scene.world.clear", Some(self.clear), [0.0, 0.5]),
            ("scene.world.glints", Some(self.glints), [0.0, 400.99]),
            ("scene.world.difficulty", Some(self.difficulty), [0.0, 1.0]),
        ];
        number::check(&rows)?;
        let nearest = self.near_over_focus.bounds().1;
        let farthest = self.far_over_focus.bounds().0;
        if farthest < 1.05 * nearest {
            return Err(ConfigError::Together(format!(
                "scene.world.far_over_focus begins at {farthest}; allowed: at least 1.05 times the largest near_over_focus, {nearest}"
            )));
        }
        Ok(())
    }
}

impl WorldFileConfig {
    fn check(&self) -> Result<(), ConfigError> {
        if self.names.is_empty() {
            return Err(ConfigError::Together(
                "scene.world.file.names is empty; allowed: at least one .gltf, .glb or .obj file"
                    .into(),
            ));
        }
        #[rustfmt::skip] // because it is a table
        let rows = [
            ("scene.world.file.distance_over_focus", Some(self.distance_over_focus), [0.02, 100.0]),
            ("scene.world.file.size_over_focus", self.size_over_focus, [0.001, 1000.0]),
            ("scene.world.file.yaw_deg", Some(self.yaw_deg), [-360.0, 360.0]),
            ("scene.world.file.pitch_deg", Some(self.pitch_deg), [-90.0, 90.0]),
            ("scene.world.file.sky", self.sky, [0.0, 1e6]),
        ];
        Ok(number::check(&rows)?)
    }
}
