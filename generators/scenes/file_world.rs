//! A world from a glTF, GLB or OBJ file, placed before the camera.
//!
//! By one of the file's cameras: its place becomes the first lens vertex, its −z the axis. Otherwise the middle of the
//! box around everything is put on the axis at a distance, seen from its +z side (glTF's front) after the turns asked
//! for.

use super::error::SceneError;
use crate::field_error::FieldError;
use std::io::Read;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};
use quadpixel::file;
use quadpixel::scene::import::{
    ImportError, MAX_FILE_BYTES, bounds_mm, import, placed, read_panorama,
};
use quadpixel::scene::world::{Environment, Light, WorldDescription};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A file, and how it is placed and lit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileWorld {
    /// `.gltf`, `.glb` or `.obj`.
    pub path: String,
    /// BLAKE3 hash of the file itself, 64 hexadecimal digits: a file that has changed is refused; absent: any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blake3: Option<String>,
    /// Length of the file's unit, mm; absent: 1000.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit_mm: Option<f64>,
    /// Name of the file's camera; absent: the first, or placed by the numbers below where `distance_mm` is given or
    /// there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// Depth of the middle, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_mm: Option<f64>,
    /// Scales the world so that the longest side of its box has this length, mm; absent: as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_mm: Option<f64>,
    /// Turn about the upright axis, deg: positive shows more of its left (−x) side.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Turn about the horizontal axis, deg: positive shows it from above.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Equirectangular panorama, `.exr` or `.hdr`, that lights the world; absent: `sky`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub panorama: Option<String>,
    /// Even linear RGB radiance of the surroundings, or a factor of the panorama's; absent: 1 where nothing in the file
    /// shines (and for panoramas), else 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sky: Option<f32>,
}

/// A world, and what was said of it.
pub(crate) struct Placed {
    pub world: WorldDescription,
    pub warnings: Vec<String>,
}

impl FileWorld {
    /// As it is in the file, by its first camera if it has one.
    pub fn new(path: &str) -> Self {
        Self {
            path: path.to_string(),
            blake3: None,
            unit_mm: None,
            camera: None,
            distance_mm: None,
            size_mm: None,
            yaw_deg: 0.0,
            pitch_deg: 0.0,
            panorama: None,
            sky: None,
        }
    }

    /// Hash of the file.
    ///
    /// # Errors
    /// A file that cannot be read, or is larger than [`MAX_FILE_BYTES`]: it is refused unread.
    pub fn hash(&self) -> Result<String, SceneError> {
        let failed = |cause| SceneError::File {
            path: self.path.clone(),
            cause,
        };
        let file = file::open(Path::new(&self.path)).map_err(|e| failed(e.cause))?;
        let bytes = file.metadata().map_err(failed)?.len();
        if bytes > MAX_FILE_BYTES {
            let limit = MAX_FILE_BYTES;
            let file = self.path.clone();
            return Err(ImportError::TooLarge { file, bytes, limit }.into());
        }
        let mut hasher = blake3::Hasher::new();
        std::io::copy(&mut file.take(MAX_FILE_BYTES), &mut hasher).map_err(failed)?;
        Ok(hasher.finalize().to_hex().to_string())
    }

    /// Reads and places it; `focus_mm` is the distance where none is given.
    ///
    /// # Errors
    /// What is wrong with the file, or a number out of its range.
    pub(crate) fn load(&self, focus_mm: Option<f64>) -> Result<Placed, SceneError> {
        for (field, value) in [("distance_mm", self.distance_mm), ("size_mm", self.size_mm)] {
            if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
                return Err(FieldError::new(field, value, "a positive length").into());
            }
        }
        if let Some(expected) = &self.blake3 {
            let hash = self.hash()?;
            if *expected != hash {
                return Err(SceneError::Changed {
                    path: self.path.clone(),
                    hash,
                    expected: expected.clone(),
                });
            }
        }
        let scene = import(Path::new(&self.path), self.unit_mm)?;
        let mut warnings: Vec<String> = scene
            .warnings
            .iter()
            .map(|(what, n)| format!("{n} × {what}"))
            .collect();
        let by_camera = match (&self.camera, self.distance_mm) {
            (Some(name), _) => {
                let found = scene.cameras.iter().find(|c| c.name == *name);
                let names: Vec<&str> = scene.cameras.iter().map(|c| c.name.as_str()).collect();
                Some(found.ok_or_else(|| {
                    let names = if names.is_empty() {
                        "none".into()
                    } else {
                        names.join(", ")
                    };
                    FieldError::new("camera", format!("{name:?}"), names)
                })?)
            }
            (None, None) => scene.cameras.first(),
            (None, Some(_)) => None,
        };
        let camera_from_file = match by_camera {
            Some(camera) => camera.file_from_camera.inverse(),
            None => {
                let distance_mm = self
                    .distance_mm
                    .or(focus_mm)
                    .ok_or(SceneError::NoDistance)?;
                self.before_the_lens(&scene.world, distance_mm)?
            }
        };
        let mut world = placed(scene.world, camera_from_file);
        self.surround(&mut world, &mut warnings)?;
        Ok(Placed { world, warnings })
    }

    fn before_the_lens(
        &self,
        world: &WorldDescription,
        distance_mm: f64,
    ) -> Result<DAffine3, SceneError> {
        let (low, high) = bounds_mm(world).ok_or_else(|| SceneError::Empty {
            path: self.path.clone(),
        })?;
        let longest = (high - low).max_element();
        let scale = match self.size_mm {
            Some(size) if longest > 0.0 => size / longest,
            _ => 1.0,
        };
        let turn = DMat3::from_rotation_x(self.pitch_deg.to_radians())
            * DMat3::from_rotation_y(self.yaw_deg.to_radians());
        if !turn.is_finite() {
            return Err(SceneError::Angles);
        }
        Ok(DAffine3::from_translation(-distance_mm * DVec3::Z)
            * DAffine3::from_mat3(turn * scale)
            * DAffine3::from_translation(-0.5 * (low + high)))
    }

    fn surround(
        &self,
        world: &mut WorldDescription,
        warnings: &mut Vec<String>,
    ) -> Result<(), SceneError> {
        if let Some(path) = &self.panorama {
            world.environment = Environment::Map {
                image: Arc::new(read_panorama(Path::new(path))?),
                camera_from_map: DMat3::IDENTITY,
                scale: self.sky.unwrap_or(1.0),
            };
            return Ok(());
        }
        let strong = |rgb: &[f32; 3]| rgb.iter().any(|v| *v > 0.0);
        let lit = world.materials.iter().any(|m| strong(&m.emission))
            || world.lights.iter().any(|light| match light {
                Light::Sun { irradiance, .. } => strong(irradiance),
                Light::Point { intensity_m2, .. } | Light::Spot { intensity_m2, .. } => {
                    strong(intensity_m2)
                }
            });
        let radiance = self.sky.unwrap_or(if lit { 0.0 } else { 1.0 });
        if self.sky.is_none() && !lit {
            warnings.push("nothing in the file shines: an even sky of radiance 1 lights it".into());
        }
        world.environment = Environment::Even([radiance; 3]);
        Ok(())
    }
}
