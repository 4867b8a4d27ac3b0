//! The camera's part of `meta.json`: lens, focus, pixels, response, exposure, and the pinhole that it paraxially is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The main lens as rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Lens {
    /// Its name.
    pub name: String,
    /// BLAKE3 hash of its prescription file.
    pub hash: String,
    /// Effective focal length, mm, at the middle channel's wavelength.
    pub efl_mm: f64,
    /// F-number at infinity, stopped down as rendered.
    pub f_number: f64,
    /// Element misalignments, each in words; empty for the nominal lens.
    pub misalignments: Vec<String>,
}

/// Focus.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Focus {
    /// Distance of the paraxial focus from the first lens vertex, m; `null` for infinity.
    pub distance_m: Option<f64>,
    /// What was moved: `sensor` or `lens`.
    pub by: String,
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

/// Sub-pixels of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Subpixels {
    /// m, along x.
    pub columns: u32,
    /// n, along y.
    pub rows: u32,
}

/// How the microlenses follow the chief ray.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CraShift {
    /// `centred`, `linear` or `chief_ray`.
    pub rule: String,
    /// Largest shift within the window, µm.
    pub max_shift_um: f64,
}

/// The angular response.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Response {
    /// The pixel model, e.g. `geometric`, `wave`.
    pub model: String,
    /// The pixel it was computed for.
    pub pixel: String,
    /// Hash of the table.
    pub hash: String,
    /// Wavelengths of the table, nm.
    pub wavelengths_nm: Vec<f64>,
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
    /// The band; absent for a channel of one wavelength.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub band: Option<ChannelBand>,
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
/// falls on column cx + fx X / d and row cy − fy Y / d with d = Z + `pinhole_behind_vertex_m`.
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
