//! A recipe: everything that makes one sample, fully drawn. `qpgen render` reads one from TOML; `qpgen dataset` draws
//! many from its configuration and records each in the sample's metadata, so that any sample can be rendered again
//! alone.

pub mod camera_pictures;
pub(crate) mod check;
mod error;
mod lens;
mod plane;
mod read;
pub mod response;
mod sensor;
mod short;
pub(crate) mod stored_response;
pub mod table_choice;

use quadpixel::effects::{Choice, Tolerance};
use quadpixel::render::{LensTracing, RenderSettings};
use quadpixel::sensor::readout::ReadoutSettings;
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use quadpixel_datasets::Registration;
use serde::{Deserialize, Serialize};

use crate::rgbd::{Level, RgbdRecipe};
use crate::scenes::WorldRecipe;

pub use camera_pictures::CameraPicturesRecipe;
pub use error::RecipeError;
pub use lens::LensRecipe;
pub use plane::{Cutout, ExtentRecipe, PlaneRecipe};
pub use read::{parse_json, parse_recipe, read_recipe};
pub use response::{ResponseSource, TableRecipe};
pub(crate) use sensor::is_no_law;
pub use sensor::{SensorRecipe, WindowRecipe};

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
    /// Whether a ray looks up a card's picture over the area that its pixel sees there, for less noise, and what
    /// diffraction takes far is smoothed over neighbouring pixels; else each ray stands for a point.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    pub footprints: bool,
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

/// Of fields that are on where they are absent.
pub(crate) fn yes() -> bool {
    true
}

#[allow(clippy::trivially_copy_pass_by_ref)] // because serde calls it so
pub(crate) fn is_yes(value: &bool) -> bool {
    *value
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
