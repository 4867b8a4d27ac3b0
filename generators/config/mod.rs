//! The configuration of a dataset: distributions from which each sample's [`Recipe`](crate::recipe::Recipe) is drawn.
//!
//! The default is the commented file `generators/config/default.toml`; `qpgen dataset --print-config` prints it.

mod error;
mod lens_folder;
mod number;
pub mod preset;
mod readout;
mod response;
mod rgbd;
mod scene;
mod sweep;
mod tolerances;
mod world;

pub use error::ConfigError;
use error::check_filled;
pub use lens_folder::LensFilter;
pub use number::{Draw, Range, Scale};
pub use readout::ReadoutConfig;
pub use response::{ResponseConfig, StackConfig, TableConfig};
pub use rgbd::RgbdConfig;
pub use scene::SceneConfig;
pub use sweep::SweepConfig;
pub use tolerances::ToleranceConfig;
pub use world::{WorldConfig, WorldFileConfig};

use quadpixel::effects::{Choice, Tolerance};
use quadpixel::em::Preset;
use quadpixel::lens::ReflectionSettings;
use quadpixel::render::LensTracing;
use quadpixel::sensor::{MicrolensLaw, ShiftRule, Subpixels, check_simulated};
use quadpixel::spectrum::Bands;
use quadpixel_datasets::{MosaicPattern, Registration};
use serde::{Deserialize, Serialize};

use crate::field_error::FieldError;
use crate::lens_tracing;
use crate::recipe::check::F_NUMBERS;
use crate::recipe::{CameraPicturesRecipe, is_no_law, is_yes, yes};

/// The default configuration, with comments.
pub const DEFAULT_TOML: &str = include_str!("default.toml");

/// A dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DatasetConfig {
    /// Number of samples.
    pub count: usize,
    /// Seed of everything.
    pub seed: u64,
    /// Main lens.
    pub lens: LensConfig,
    /// Sensor.
    pub sensor: SensorConfig,
    /// Angular response.
    pub response: ResponseConfig,
    /// The colour channels' bands; absent: each is traced at one wavelength, and all have the response at 550 nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Bands>,
    /// Scenes.
    #[serde(default)]
    pub scene: SceneConfig,
    /// Exposure in stops; see the recipe.
    pub exposure_ev: Draw,
    /// The surface that a pixel of the maps and of the target refers to; see the recipe.
    #[serde(default)]
    pub registration: Registration,
    /// Rays a microlens and colour channel; absent: as of [`preset`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rays_per_pixel: Option<usize>,
    /// Whether a ray looks up a card's picture over the area that its pixel sees; see the recipe.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub footprints: bool,
    /// How rays go through the lens: `"map"` (the default), `"exact"` or the bound of its maps.
    #[serde(default, skip_serializing_if = "LensTracing::is_default")]
    pub lens_tracing: LensTracing,
    /// Effects that are simulated: `"auto"`, `"all"`, `"none"` or a list of names.
    #[serde(default, skip_serializing_if = "Choice::is_auto")]
    pub effects: Choice,
    /// Below which `"auto"` leaves an effect out.
    #[serde(default, skip_serializing_if = "Tolerance::is_default")]
    pub tolerance: Tolerance,
    /// Focus stacks; absent: a scene per sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep: Option<SweepConfig>,
    /// Sensor electronics: noisy captures beside the clean ones; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<ReadoutConfig>,
    /// 8-bit sRGB pictures of the sum and of the views, as a camera writes them; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_pictures: Option<CameraPicturesRecipe>,
}

/// Main lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensConfig {
    /// Names in the library or files; one is drawn for each sample.
    #[serde(default)]
    pub names: Vec<String>,
    /// Folder of lens files, each of which is drawn like a name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Which of them; absent: all that load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<LensFilter>,
    /// Scales all lengths of the lens to this focal length, mm; absent: as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length_mm: Option<f64>,
    /// Focused depth, mm.
    pub focus_mm: Draw,
    /// F-number; absent: wide open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_number: Option<Draw>,
    /// How far the sensor stands behind (+) where it would be in focus, µm; absent: nowhere else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_error_um: Option<Draw>,
    /// What its surfaces and the sensor reflect.
    #[serde(default, skip_serializing_if = "ReflectionSettings::is_default")]
    pub reflections: ReflectionSettings,
    /// Deviations of elements and surfaces; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerances: Option<ToleranceConfig>,
}

/// Sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorConfig {
    /// Sub-pixels below each microlens.
    pub subpixels: Subpixels,
    /// Microlenses in a row.
    pub width: usize,
    /// Rows of microlenses.
    pub height: usize,
    /// The window's place.
    pub window: WindowConfig,
    /// How microlenses follow the chief ray.
    pub microlens_shift: ShiftRule,
    /// By how much all microlenses are out of place, µm, along x and along y; absent: not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub microlens_offset_um: Option<Draw>,
    /// How far microlenses stand beside where the rule puts them; absent: nowhere else.
    #[serde(default, skip_serializing_if = "is_no_law")]
    pub microlens_law: MicrolensLaw,
    /// Pitch of the microlenses, µm; absent: that of the response's pixel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pitch_um: Option<Draw>,
    /// Colours of the filters over the microlenses: what such a sensor reads, beside all channels; absent: not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mosaic: Option<MosaicPattern>,
}

/// Where windows lie on the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, tag = "at")]
pub enum WindowConfig {
    /// Around the axis.
    Centre,
    /// Anywhere (even density) with the centre at most this far from the axis.
    Random {
        /// Largest image height of the window's centre, mm.
        max_height_mm: f64,
    },
    /// Around the place of a chief-ray angle.
    ChiefRayAngle {
        /// Angle to the axis, deg.
        theta_deg: Draw,
        /// Azimuth in the sensor frame, deg.
        phi_deg: Draw,
    },
}

impl DatasetConfig {
    /// Reads a configuration; `file` names it in errors.
    ///
    /// # Errors
    /// The place of a TOML error, or the first field that is out of bounds.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text).map_err(|cause| ConfigError::Toml {
            file: file.to_owned(),
            cause: Box::new(cause),
        })?;
        config.check().map_err(|cause| ConfigError::File {
            file: file.to_owned(),
            cause: Box::new(cause),
        })?;
        Ok(config)
    }

    /// Rays a microlens and colour channel.
    pub fn rays(&self) -> usize {
        (self.rays_per_pixel).unwrap_or_else(|| preset::rays(Preset::Standard, self))
    }

    /// Checks every field that a recipe does not check again.
    ///
    /// # Errors
    /// Names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), ConfigError> {
        check_filled(&[
            ("count", self.count),
            ("sensor.width", self.sensor.width),
            ("sensor.height", self.sensor.height),
            ("rays_per_pixel", self.rays()),
            ("scene.charts", self.scene.charts.len()),
            ("scene.texture_px", self.scene.texture_px),
        ])?;
        self.lens.check_names()?;
        check_simulated("sensor", self.sensor.subpixels)?;
        self.response.check()?;
        self.check_draws()?;
        if let Some(tolerances) = &self.lens.tolerances {
            tolerances.check()?;
        }
        if let Some(sweep) = &self.sweep {
            sweep.check(&self.lens.focus_mm)?;
        }
        if let Some(bands) = &self.spectrum {
            bands.check()?;
        }
        self.tolerance.check().map_err(ConfigError::Tolerance)?;
        lens_tracing::check(&self.lens_tracing)?;
        if let Some(readout) = &self.readout {
            readout.check()?;
        }
        if let Some(pictures) = &self.camera_pictures {
            pictures.check(self.readout.is_some())?;
        }
        if let Some(world) = &self.scene.world {
            world.check()?;
            if !self.lens.focus_mm.bounds().1.is_finite() {
                return Err(ConfigError::Together(
                    "lens.focus_mm is infinite; scene.world needs a finite one, its depths are multiples of it".into(),
                ));
            }
        }
        if let Some(rgbd) = &self.scene.rgbd {
            rgbd.check()?;
            if self.scene.world.is_some() || self.sweep.is_some() && rgbd.focus_share.is_some() {
                return Err(ConfigError::Together(
                    "scene.rgbd beside scene.world, or its focus_share beside [sweep]; allowed: one of them".into(),
                ));
            }
        }
        self.scene.check_charts()
    }

    fn check_draws(&self) -> Result<(), FieldError> {
        let (lens, sensor, scene) = (&self.lens, &self.sensor, &self.scene);
        let (height_mm, theta_deg, phi_deg) = match sensor.window {
            WindowConfig::Centre => (None, None, None),
            WindowConfig::Random { max_height_mm } => {
                (Some(Draw::Fixed(max_height_mm)), None, None)
            }
            WindowConfig::ChiefRayAngle { theta_deg, phi_deg } => {
                (None, Some(theta_deg), Some(phi_deg))
            }
        };
        #[rustfmt::skip] // because it is a table
        let rows = [
            ("lens.focus_mm", Some(lens.focus_mm), [1.0, f64::INFINITY]),
            ("lens.f_number", lens.f_number, [*F_NUMBERS.start(), *F_NUMBERS.end()]),
            ("lens.focus_error_um", lens.focus_error_um, [-1e4, 1e4]),
            ("sensor.microlens_offset_um", sensor.microlens_offset_um, [-10.0, 10.0]),
            ("sensor.pitch_um", sensor.pitch_um, [0.1, 100.0]),
            ("sensor.window.max_height_mm", height_mm, [0.0, 100.0]),
            ("sensor.window.theta_deg", theta_deg, [0.0, 89.0]),
            ("sensor.window.phi_deg", phi_deg, [-360.0, 360.0]),
            ("exposure_ev", Some(self.exposure_ev), [-16.0, 16.0]),
            ("scene.background_over_focus", Some(scene.background_over_focus), [0.05, 100.0]),
            ("scene.tilt_deg", Some(scene.tilt_deg), [-60.0, 60.0]),
            ("scene.cards", Some(scene.cards), [0.0, 64.0]),
            ("scene.card_over_focus", Some(scene.card_over_focus), [0.05, 100.0]),
            ("scene.card_size", Some(scene.card_size), [0.01, 4.0]),
        ];
        number::check(&rows)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_scene_that_is_left_out_is_that_of_the_default_file() {
        let whole = DatasetConfig::from_toml(DEFAULT_TOML, "default.toml").unwrap();
        assert_eq!(whole.scene, SceneConfig::default());
        let mut table: toml::Table = DEFAULT_TOML.parse().unwrap();
        table.remove("scene");
        let without =
            DatasetConfig::from_toml(&toml::to_string(&table).unwrap(), "c.toml").unwrap();
        assert_eq!(without, whole);
    }

    #[test]
    fn where_charge_is_collected_needs_charge_that_wanders() {
        let with = |fields: &str| {
            let text =
                DEFAULT_TOML.replace("model = \"wave\" ", &format!("{fields}\nmodel = \"wave\" "));
            assert_ne!(text, DEFAULT_TOML);
            DatasetConfig::from_toml(&text, "c.toml").map_err(|e| e.to_string())
        };
        let why = with("collected_at = \"lit-side\"").unwrap_err();
        assert!(
            why.contains("collected_at") && why.contains("diffusion_um"),
            "{why}"
        );
        let why = with("collected_at = \"below\"").unwrap_err();
        assert!(why.contains("below") && why.contains("far-side"), "{why}");
        let whole = with("shifts = 8\ndiffusion_um = 0.2\ncollected_at = \"far-side\"").unwrap();
        let again = toml::to_string(&whole).unwrap();
        assert!(again.contains("collected_at = \"far-side\""), "{again}");
        assert_eq!(DatasetConfig::from_toml(&again, "c.toml").unwrap(), whole);
    }
}
