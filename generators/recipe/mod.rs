//! A recipe: everything that makes one sample, fully drawn. `qpgen render` reads one from TOML; `qpgen dataset` draws
//! many from its configuration and records each in the sample's metadata, so that any sample can be rendered again
//! alone.

pub mod camera_pictures;
pub(crate) mod check;
mod error;
pub mod response;
mod short;
pub(crate) mod stored_response;
pub mod table_choice;

use std::path::Path;

use quadpixel::effects::{Choice, Tolerance};
use quadpixel::file;
use quadpixel::lens::{Coating, Deviation, Misalignment, ReflectionSettings};
use quadpixel::render::{LensTracing, RenderSettings};
use quadpixel::sensor::readout::ReadoutSettings;
use quadpixel::sensor::{MicrolensLaw, ShiftRule, Subpixels};
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use quadpixel_datasets::{MosaicPattern, Registration};
use serde::{Deserialize, Serialize};

use crate::charts::ChartSpec;
use crate::charts::Mask;
use crate::rgbd::{Level, RgbdRecipe};
use crate::scenes::WorldRecipe;

pub use camera_pictures::CameraPicturesRecipe;
pub use error::RecipeError;
pub use response::{ResponseSource, TableRecipe};

/// One sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Main lens and its focus.
    pub lens: LensRecipe,
    /// Sensor window.
    pub sensor: SensorRecipe,
    /// The pixel's angular response.
    pub response: ResponseSource,
    /// The colour channels' bands; absent: each is traced at one wavelength, and all have the response at 550 nm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Bands>,
    /// Flat cards; the nearest one that a ray meets is seen. None where there is a world.
    #[serde(default)]
    pub planes: Vec<PlaneRecipe>,
    /// A world of meshes in the place of cards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<WorldRecipe>,
    /// A picture with depth in the place of cards.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rgbd: Option<RgbdRecipe>,
    /// Depth in focus at which the cards that fill the window, or lie in parts of it, are laid out, mm; absent: the
    /// lens's own. All of a focus stack share one, so that they see one scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub framing_focus_mm: Option<f64>,
    /// Linear RGB radiance of everything beside the cards.
    #[serde(default)]
    pub environment: [f32; 3],
    /// Exposure in stops: at 0, a white wall (radiance 1) gives a sum of 1 in the middle of the window.
    #[serde(default)]
    pub exposure_ev: f64,
    /// The surface that a pixel of the maps and of the target refers to: `"centroid"` (what the sum of its sub-pixels
    /// sees on average) or `"chief-ray"`.
    #[serde(default)]
    pub registration: Registration,
    /// Rays and the seed of their samples.
    pub render: RenderSettings,
    /// How rays go through the lens: `"map"` (polynomials over the pupil, fitted to the lens), `"exact"` (surface by
    /// surface) or the bound of its maps, `{ rms_px = 0.01, worst_px = 0.1 }`.
    #[serde(default, skip_serializing_if = "LensTracing::is_default")]
    pub lens_tracing: LensTracing,
    /// Effects that are simulated: `"auto"`, `"all"`, `"none"` or a list of names.
    #[serde(default, skip_serializing_if = "Choice::is_auto")]
    pub effects: Choice,
    /// Below which `"auto"` leaves an effect out.
    #[serde(default, skip_serializing_if = "Tolerance::is_default")]
    pub tolerance: Tolerance,
    /// The sensor's electronics: a noisy capture beside the clean one; absent: none. Its fields that are absent have
    /// the defaults of datasets.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "short::readout"
    )]
    pub readout: Option<ReadoutSettings>,
    /// 8-bit sRGB pictures of the sum and of the views, as a camera writes them; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_pictures: Option<CameraPicturesRecipe>,
}

impl Recipe {
    /// Rays that it asks for, all channels; of a picture with depth, whose rays are its camera's alone, its values.
    pub fn rays(&self) -> u64 {
        let values = 3 * self.sensor.width as u64 * self.sensor.height as u64;
        match &self.rgbd {
            Some(rgbd) if rgbd.level == Level::Psf => values,
            _ => values * self.render.rays_per_pixel as u64,
        }
    }

    /// With what a file may leave to the other fields.
    fn completed(mut self) -> Self {
        if let Some(readout) = &mut self.readout {
            short::complete(readout, self.sensor.pitch_um, self.sensor.subpixels);
        }
        self
    }

    /// Wavelengths of the rays and of the response.
    ///
    /// # Errors
    /// Bands out of their range.
    pub fn wavelengths(&self) -> Result<ChannelWavelengths, RecipeError> {
        let default = || Ok(ChannelWavelengths::default());
        let wavelengths = self
            .spectrum
            .map_or_else(default, ChannelWavelengths::from_bands);
        Ok(wavelengths?)
    }
}

/// What a sample is part of.
#[derive(Clone, Debug)]
pub struct SampleId {
    /// Its number.
    pub index: u32,
    /// Hash of the configuration that it was drawn from.
    pub configuration_blake3: String,
}

/// Main lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensRecipe {
    /// Name in the lens library, or a `.json`, `.zmx` or `.seq` file.
    pub name: String,
    /// Scales all its lengths to this focal length, mm; absent: as it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length_mm: Option<f64>,
    /// Depth that is in focus, mm from the first lens vertex; absent (or `inf`): infinity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_mm: Option<f64>,
    /// Stops the lens down to this F-number; absent: wide open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub f_number: Option<f64>,
    /// Misplaced elements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misalignments: Vec<Misalignment>,
    /// Surfaces whose radius or glass is not as prescribed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub deviations: Vec<Deviation>,
    /// What its surfaces and the sensor reflect; absent: a usual coating, and a sensor under microlenses.
    #[serde(default, skip_serializing_if = "ReflectionSettings::is_default")]
    pub reflections: ReflectionSettings,
    /// How far the sensor stands behind (+) where `focus_mm` is in focus, µm; it comes no nearer than where infinity is
    /// in focus.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub focus_error_um: f64,
}

impl LensRecipe {
    /// Whether anything in the lens reflects by its settings.
    pub(crate) fn reflects(&self) -> bool {
        self.reflections.sensor > 0.0 || self.reflections.coating != Coating::Reflectance(0.0)
    }
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// Sensor window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SensorRecipe {
    /// Pitch of the microlenses, µm.
    pub pitch_um: f64,
    /// Sub-pixels below each microlens.
    pub subpixels: Subpixels,
    /// Microlenses in a row of the window.
    pub width: usize,
    /// Rows of microlenses in the window.
    pub height: usize,
    /// Where on the sensor the window is.
    #[serde(default)]
    pub window: WindowRecipe,
    /// How microlenses follow the chief ray.
    #[serde(default = "chief_ray")]
    pub microlens_shift: ShiftRule,
    /// By how much all microlenses are out of place besides, (x, y) µm, sensor frame.
    #[serde(default, skip_serializing_if = "is_origin")]
    pub microlens_offset_um: [f64; 2],
    /// How far microlenses stand beside where the rule puts them.
    #[serde(default, skip_serializing_if = "is_no_law")]
    pub microlens_law: MicrolensLaw,
    /// Colours of the filters over the microlenses: what such a sensor reads, beside all channels; absent: not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mosaic: Option<MosaicPattern>,
}

fn is_origin(offset: &[f64; 2]) -> bool {
    *offset == [0.0; 2]
}

pub(crate) fn is_no_law(law: &MicrolensLaw) -> bool {
    *law == MicrolensLaw::default()
}

fn chief_ray() -> ShiftRule {
    ShiftRule::ChiefRay
}

/// Where the window is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, tag = "at")]
pub enum WindowRecipe {
    /// Around the optical axis.
    #[default]
    Centre,
    /// Around a place on the sensor.
    Position {
        /// Sensor frame, mm: grows with the stored columns.
        x_mm: f64,
        /// Sensor frame, mm: grows with the stored rows.
        y_mm: f64,
    },
    /// Around the place where the main lens's chief ray arrives at this angle.
    ChiefRayAngle {
        /// Angle to the axis, deg.
        theta_deg: f64,
        /// Azimuth in the sensor frame, deg.
        phi_deg: f64,
    },
}

/// A flat card.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaneRecipe {
    /// What is printed on it; in a file also the name of its kind, or the path of an image.
    #[serde(deserialize_with = "short::chart")]
    pub chart: ChartSpec,
    /// Seed of the chart.
    #[serde(default)]
    pub chart_seed: u64,
    /// Side of the chart's texture, texels.
    #[serde(default = "texture_px")]
    pub texture_px: usize,
    /// Depth of its middle, mm from the first lens vertex.
    pub distance_mm: f64,
    /// Its place and size.
    #[serde(default)]
    pub extent: ExtentRecipe,
    /// Tilt about the horizontal axis, deg; positive: the upper edge goes away.
    #[serde(default)]
    pub tilt_x_deg: f64,
    /// Tilt about the vertical axis, deg; positive: the right edge goes away.
    #[serde(default)]
    pub tilt_y_deg: f64,
    /// Turn in its own plane, deg.
    #[serde(default)]
    pub roll_deg: f64,
    /// Shape that is cut from it; absent: the whole rectangle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cutout: Option<Cutout>,
}

/// A shape cut from a card.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cutout {
    /// Family of outlines.
    pub shape: Mask,
    /// Seed of its proportions.
    #[serde(default)]
    pub seed: u64,
}

fn texture_px() -> usize {
    1024
}

/// Place and size of a card.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, tag = "of")]
pub enum ExtentRecipe {
    /// Fills the window's field of view, with a margin for blur.
    #[default]
    Fill,
    /// In parts of the window: (0, 0) is its upper left corner as stored, (1, 1) its lower right one.
    Window {
        /// Centre, fraction of the window's width.
        x: f64,
        /// Centre, fraction of the window's height.
        y: f64,
        /// Side, as a fraction of the window's width.
        size: f64,
    },
    /// In mm in the camera frame.
    Mm {
        /// Centre: to the photographer's right.
        x_mm: f64,
        /// Centre: up.
        y_mm: f64,
        /// Width.
        width_mm: f64,
        /// Height.
        height_mm: f64,
    },
}

/// A recipe in TOML; `name` names the text in errors.
///
/// # Errors
/// No recipe: names the place.
pub fn parse_recipe(text: &str, name: &str) -> Result<Recipe, RecipeError> {
    toml::from_str(text)
        .map(Recipe::completed)
        .map_err(|cause| RecipeError::Toml {
            name: name.to_owned(),
            cause: Box::new(cause),
        })
}

/// Reads a recipe: TOML, or the `scene.parameters` of a sample's `meta.json`.
///
/// # Errors
/// A file that cannot be read, or is no recipe: names the file and the place.
pub fn read_recipe(path: &Path) -> Result<Recipe, RecipeError> {
    let text = file::read_text(path).map_err(|e| RecipeError::File {
        path: e.path,
        cause: e.cause,
    })?;
    let name = path.display().to_string();
    if path.extension().is_some_and(|e| e == "json") {
        return parse_json(&text, &name);
    }
    parse_recipe(&text, &name)
}

/// A recipe in JSON, or the `scene.parameters` of a sample's `meta.json`; `name` names the text in errors.
///
/// # Errors
/// No recipe: names the place.
pub fn parse_json(text: &str, name: &str) -> Result<Recipe, RecipeError> {
    let read = || {
        let meta: serde_json::Value = serde_json::from_str(text)?;
        let parameters = meta.pointer("/scene/parameters").unwrap_or(&meta).clone();
        serde_json::from_value(parameters)
    };
    let name = name.to_owned();
    read()
        .map(Recipe::completed)
        .map_err(|cause| RecipeError::Json { name, cause })
}
