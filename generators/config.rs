//! The configuration of a dataset: distributions from which each sample's [`Recipe`](crate::recipe::Recipe) is drawn.
//!
//! The default is the commented file `generators/default.toml`; `qpgen dataset --print-config` prints it.

mod number;
mod readout;
mod sweep;
mod tolerances;
mod world;

pub use number::{Draw, Range, Scale};
pub use readout::ReadoutConfig;
pub use sweep::SweepConfig;
pub use tolerances::ToleranceConfig;
pub use world::{WorldConfig, WorldFileConfig};

use quadpixel::effects::{Choice, Tolerance};
use quadpixel::em::{Preset, ShiftGrid};
use quadpixel::sensor::ShiftRule;
use quadpixel::spectrum::Bands;
use quadpixel_datasets::MosaicPattern;
use serde::{Deserialize, Serialize};

use quadpixel::command::CommandError;

use crate::made_table::MadeTables;

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
    pub scene: SceneConfig,
    /// Exposure in stops; see the recipe.
    pub exposure_ev: Draw,
    /// Rays a microlens and colour channel.
    pub rays_per_pixel: usize,
    /// Effects that are simulated: `"auto"`, `"all"`, `"none"` or a list of names.
    #[serde(default, skip_serializing_if = "Choice::is_auto")]
    pub effects: Choice,
    /// Below which `"auto"` leaves an effect out.
    #[serde(default, skip_serializing_if = "Tolerance::is_default")]
    pub tolerance: Tolerance,
    /// Focus stacks; absent: a scene a sample.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweep: Option<SweepConfig>,
    /// Sensor electronics: noisy captures beside the clean ones; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<ReadoutConfig>,
}

/// Main lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensConfig {
    /// Names in the library or files; one is drawn a sample.
    pub names: Vec<String>,
    /// Focused depth, mm.
    pub focus_mm: Draw,
    /// F-number; absent: wide open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_number: Option<Draw>,
    /// How far the sensor stands behind (+) where it would be in focus, µm; absent: nowhere else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_error_um: Option<Draw>,
    /// Deviations of elements and surfaces; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerances: Option<ToleranceConfig>,
}

/// Sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorConfig {
    /// Columns × rows of sub-pixels, such as `2x2`.
    pub subpixels: String,
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

/// Angular response.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, tag = "model")]
pub enum ResponseConfig {
    /// Wave propagation through one of these pixels.
    Wave {
        /// Built-in names or `.toml` files; one is drawn a sample.
        pixels: Vec<String>,
        /// Thickness of the layers; absent: as the pixels have it.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        stack: Option<StackConfig>,
        /// Lens shifts a pitch of a table of all lens shifts; absent: the table of the centred lens, moved along with the lens.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shifts: Option<usize>,
        /// How finely its table is made.
        #[serde(default, alias = "grid", skip_serializing_if = "Preset::is_standard")]
        preset: Preset,
    },
    /// FDTD tables of one of these pixels: shipped ones, or those that `qpgen response --model fdtd` has made.
    Fdtd(MadeTables),
    /// Fourier modal tables of one of these pixels, that `qpgen response --model rcwa` has made.
    Rcwa(MadeTables),
    /// Corrected wave tables of one of these pixels, that `qpgen response --model corrected` has made.
    Corrected(MadeTables),
    /// The ideal box.
    Geometric,
    /// Tables from files, such as imported ones.
    Table {
        /// `.npz` files of `qpgen response`; one is drawn a sample.
        files: Vec<String>,
    },
}

/// Lens shifts that a table can have.
fn check_shifts(shifts: Option<usize>) -> Result<(), CommandError> {
    let checked = shifts.map(|n| ShiftGrid::new(1.0, n)).transpose();
    checked
        .map(|_| ())
        .map_err(|e| CommandError::input(format!("response.shifts: {e}")))
}

/// Thickness of a pixel's flat layers. Each value needs a table of its own, so few are made and shared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StackConfig {
    /// Factor on the thickness of all flat layers.
    pub scale: Draw,
    /// Number of values that are drawn for each pixel; one of them is drawn a sample.
    pub variants: usize,
}

/// Scenes of flat cards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneConfig {
    /// Kinds of chart, or image files; one is drawn for each card, the background's in turn.
    pub charts: Vec<String>,
    /// Depth of the background as a multiple of the focused depth.
    pub background_over_focus: Draw,
    /// Tilt of the background about each axis, deg.
    pub tilt_deg: Draw,
    /// Number of cards in front of the background (rounded down).
    pub cards: Draw,
    /// Depth of a card as a multiple of the focused depth (at most 0.95 of the background's).
    pub card_over_focus: Draw,
    /// Side of a card as a fraction of the window's width.
    pub card_size: Draw,
    /// Side of every chart's texture, texels.
    pub texture_px: usize,
    /// Worlds of meshes in the place of cards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldConfig>,
}

impl DatasetConfig {
    /// Reads a configuration; `file` names it in errors.
    ///
    /// # Errors
    /// The place of a TOML error, or the first field that is out of bounds.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, CommandError> {
        let config: Self =
            toml::from_str(text).map_err(|e| CommandError::input(format!("{file}: {e}")))?;
        config.check().map_err(|e| e.within(file))?;
        Ok(config)
    }

    /// Checks every field that a recipe does not check again.
    ///
    /// # Errors
    /// Names the field, its value and what is allowed.
    pub fn check(&self) -> Result<(), CommandError> {
        let inf = f64::INFINITY;
        let some = |field: &str, n: usize| {
            if n > 0 {
                Ok(())
            } else {
                Err(CommandError::input(format!(
                    "{field} is empty or 0; allowed: at least 1"
                )))
            }
        };
        some("count", self.count)?;
        some("lens.names", self.lens.names.len())?;
        some("sensor.width", self.sensor.width)?;
        some("sensor.height", self.sensor.height)?;
        some("rays_per_pixel", self.rays_per_pixel)?;
        some("scene.charts", self.scene.charts.len())?;
        some("scene.texture_px", self.scene.texture_px)?;
        match &self.response {
            ResponseConfig::Wave {
                pixels,
                stack,
                shifts,
                preset: _,
            } => {
                some("response.pixels", pixels.len())?;
                check_shifts(*shifts)?;
                if let Some(stack) = stack {
                    some("response.stack.variants", stack.variants)?;
                    stack.scale.check("response.stack.scale", (0.5, 2.0))?;
                }
            }
            ResponseConfig::Fdtd(tables)
            | ResponseConfig::Rcwa(tables)
            | ResponseConfig::Corrected(tables) => {
                some("response.pixels", tables.pixels.len())?;
                check_shifts(tables.shifts)?;
            }
            ResponseConfig::Table { files } => some("response.files", files.len())?,
            ResponseConfig::Geometric => {}
        }
        self.lens.focus_mm.check("lens.focus_mm", (1.0, inf))?;
        if let Some(f) = &self.lens.f_number {
            f.check("lens.f_number", (0.5, 64.0))?;
        }
        if let Some(error) = &self.lens.focus_error_um {
            error.check("lens.focus_error_um", (-1e4, 1e4))?;
        }
        if let Some(tolerances) = &self.lens.tolerances {
            tolerances.check()?;
        }
        if let Some(offset) = &self.sensor.microlens_offset_um {
            offset.check("sensor.microlens_offset_um", (-10.0, 10.0))?;
        }
        if let Some(sweep) = &self.sweep {
            sweep.check(&self.lens.focus_mm)?;
        }
        if let Some(bands) = &self.spectrum {
            bands.check().map_err(CommandError::input)?;
        }
        if let Some(p) = &self.sensor.pitch_um {
            p.check("sensor.pitch_um", (0.1, 100.0))?;
        }
        if let WindowConfig::Random { max_height_mm } = self.sensor.window {
            Draw::Fixed(max_height_mm).check("sensor.window.max_height_mm", (0.0, 100.0))?;
        }
        if let WindowConfig::ChiefRayAngle { theta_deg, phi_deg } = &self.sensor.window {
            theta_deg.check("sensor.window.theta_deg", (0.0, 89.0))?;
            phi_deg.check("sensor.window.phi_deg", (-360.0, 360.0))?;
        }
        crate::planned::checked(&self.tolerance)?;
        self.exposure_ev.check("exposure_ev", (-16.0, 16.0))?;
        if let Some(readout) = &self.readout {
            readout.check()?;
        }
        self.scene
            .background_over_focus
            .check("scene.background_over_focus", (0.05, 100.0))?;
        self.scene.tilt_deg.check("scene.tilt_deg", (-60.0, 60.0))?;
        self.scene.cards.check("scene.cards", (0.0, 64.0))?;
        self.scene
            .card_over_focus
            .check("scene.card_over_focus", (0.05, 100.0))?;
        self.scene.card_size.check("scene.card_size", (0.01, 4.0))?;
        if let Some(world) = &self.scene.world {
            world.check()?;
            if !self.lens.focus_mm.bounds().1.is_finite() {
                return Err(CommandError::input(
                    "lens.focus_mm is infinite; scene.world needs a finite one, its depths are multiples of it",
                ));
            }
        }
        let known =
            |c: &String| crate::charts::ChartSpec::KINDS.contains(&c.as_str()) && c != "image";
        match self
            .scene
            .charts
            .iter()
            .find(|c| !known(c) && !crate::draw::is_image(c))
        {
            None => Ok(()),
            Some(c) => {
                let kinds = crate::charts::ChartSpec::KINDS.join(", ");
                Err(CommandError::input(format!(
                    "scene.charts has `{c}`; allowed: {kinds} (image by the path of a PNG, JPEG or TIFF file)"
                )))
            }
        }
    }
}
