//! The camera's part of `meta.json`: lens, focus, pixels, response, exposure, and the pinhole that it paraxially is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::subpixels::Subpixels;

/// The main lens as rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Its name.
    pub name: String,
    /// BLAKE3 hash of its surfaces, as canonical JSON (keys sorted, no spaces).
    pub hash: String,
    /// Effective focal length, mm, at the middle channel's wavelength.
    pub efl_mm: f64,
    /// F-number at infinity, stopped down as rendered.
    pub f_number: f64,
    /// Element misalignments; empty for the nominal lens.
    pub misalignments: Vec<Misalignment>,
}

/// By how much one element is out of place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Misalignment {
    /// Which element.
    pub element: Element,
    /// Decentre along x of the camera frame, µm.
    pub dx_um: f64,
    /// Decentre along y, µm.
    pub dy_um: f64,
    /// Despace along z, towards the sensor, µm.
    pub dz_um: f64,
    /// Turn about x, degrees.
    pub tip_deg: f64,
    /// Turn about y, degrees.
    pub tilt_deg: f64,
}

/// What of a lens is out of place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Element {
    /// A glass element, counted from 1 at the scene's side.
    Number(u32),
    /// Another part.
    Part(Part),
}

/// A part of a lens that is no glass element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Part {
    /// The fold mirror.
    Mirror,
}

/// Focus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Focus {
    /// Distance of the paraxial focus from the first lens vertex, m; `null` for infinity.
    pub distance_m: Option<f64>,
    /// What was moved.
    pub by: FocusBy,
}

/// What is moved to focus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FocusBy {
    /// The sensor.
    Sensor,
    /// The whole lens.
    Lens,
}

/// The sensor window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Side of a pixel (a microlens), µm.
    pub pitch_um: f64,
    /// Sub-pixels behind each microlens.
    pub subpixels: Subpixels,
    /// Width of the window, px.
    pub width_px: u32,
    /// Height of the window, px.
    pub height_px: u32,
    /// Centre of the window from the axis, mm, as stored: to the right, downwards.
    pub centre_mm: [f64; 2],
    /// The microlens shift.
    pub cra_shift: CraShift,
}

/// How the microlenses follow the chief ray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CraShift {
    /// The rule.
    pub rule: MicrolensRule,
    /// Largest shift within the window, µm.
    pub max_shift_um: f64,
}

/// The rule by which the microlenses are shifted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MicrolensRule {
    /// Every microlens over the middle of its pixel.
    Centred,
    /// In proportion to the distance from the axis, and towards it.
    Linear,
    /// So that the lens's chief ray meets the middle of each pixel.
    ChiefRay,
}

/// The colour of the microlens that a table is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum TableColour {
    /// Red.
    Red,
    /// The mean of both greens.
    Green,
    /// Blue.
    Blue,
    /// At each wavelength of a channel's band the microlens of its colour.
    Bands,
}

/// How finely a table was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TablePreset {
    /// Quick looks.
    Draft,
    /// The default.
    Standard,
    /// To compare others with.
    Reference,
}

/// The angular response.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// How it was found: a pixel model by its name, as of `qpgen response --model`, or `table`, a file.
    pub model: String,
    /// How finely it was computed; absent where it was not computed here.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<TablePreset>,
    /// The file of a `table`; absent for other models.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The pixel it was computed for.
    pub pixel: String,
    /// Focal length of the ideal microlens, µm; absent where there is a table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focal_length_um: Option<f64>,
    /// Key of the table: the same key means the same table; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// Lens shifts per pitch of a table of all lens shifts; absent for one of the centred lens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shifts: Option<u32>,
    /// Colour of the microlens that the table is of, of a pixel in a mosaic of colour filters; absent: as the pixel
    /// says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<TableColour>,
    /// Wavelengths of the table, nm; empty where there is none.
    pub wavelengths_nm: Vec<f64>,
}

impl Response {
    /// Model and file in words.
    pub fn label(&self) -> String {
        match &self.file {
            Some(file) => format!("{} {file}", self.model),
            None => self.model.clone(),
        }
    }
}

/// A colour channel: traced at one wavelength, or at those that stand for a band.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Channel {
    /// `R`, `G` or `B`.
    pub name: String,
    /// Wavelength at which its rays were traced, nm; the middle of its band where it has one.
    pub wavelength_nm: f64,
    /// Wavelength of the response table that weighted them, nm; of a band, the one read in its middle.
    pub response_wavelength_nm: f64,
    /// Its paraxial pinhole on this sensor.
    pub optics: ChannelOptics,
    /// The band; absent for a channel of one wavelength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band: Option<ChannelBand>,
}

/// The paraxial pinhole of a channel, on the plane where the depth in focus is imaged: with d = Z +
/// `pinhole_behind_vertex_m` and d_f that of the focus, its circle of confusion is fx · A · (1/d_f − 1/d) px (SPEC.md,
/// "Circle of confusion").
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelOptics {
    /// Focal length, px.
    pub fx_px: f64,
    /// Diameter of the entrance pupil (A), m.
    pub entrance_pupil_diameter_m: f64,
    /// How far the pinhole lies behind the first lens vertex, m.
    pub pinhole_behind_vertex_m: f64,
    /// Depth Z_f in focus, m; `null` for infinity or beyond.
    pub focus_distance_m: Option<f64>,
}

/// A band of a colour channel: a raised cosine of wavelength (SPEC.md, "Light").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelBand {
    /// Full width at half maximum, nm.
    pub width_nm: f64,
    /// Wavelengths that stand for it, nm: each had an equal share of the channel's rays.
    pub wavelengths_nm: Vec<f64>,
    /// Wavelengths at which the response was read for them, nm; empty where it depends on none.
    pub response_wavelengths_nm: Vec<f64>,
    /// Linear value that a white wall gives in the sum in the middle of the window: what a white balance divides by.
    pub white: f64,
}

/// Exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exposure {
    /// Linear value of the sum = gain × irradiance that the pixel absorbs, where the scene's white has radiance 1.
    pub gain: f64,
    /// The same in stops from the gain at which the scene's white gives 1 in the sum on the axis.
    pub ev: f64,
}

/// The pinhole camera that the lens paraxially is: a point at (X, Y, Z) m in the camera frame of SPEC.md, Z its depth,
/// falls on column cx + fx X / d and row cy − fy Y / d with d = Z + `pinhole_behind_vertex_m`. It is that of the sensor
/// where it stands; the circle of confusion has a focal length of its own ([`ChannelOptics`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
    /// Focal length along x, px.
    pub fx_px: f64,
    /// Focal length along y, px.
    pub fy_px: f64,
    /// Column of the axis, px (pixel centres have integer coordinates).
    pub cx_px: f64,
    /// Row of the axis, px.
    pub cy_px: f64,
    /// The pinhole is the centre of the entrance pupil: how far it lies behind the first lens vertex, m.
    pub pinhole_behind_vertex_m: f64,
    /// Diameter of the entrance pupil, m.
    pub entrance_pupil_diameter_m: f64,
    /// The exit pupil.
    pub exit_pupil: ExitPupil,
}

/// The paraxial exit pupil.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExitPupil {
    /// Its distance in front of the sensor, mm.
    pub distance_mm: f64,
    /// Its diameter, mm.
    pub diameter_mm: f64,
}
