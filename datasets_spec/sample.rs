//! `meta.json`: everything about one sample that is not a pixel.
//!
//! Lengths carry their unit in the field's name. JSON knows no infinity: where a quantity may be infinite its `null`
//! says so.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::camera::{Channel, Exposure, Focus, Intrinsics, Lens, Response, Sensor};
use crate::camera_curves::CameraCurves;
use crate::camera_description::{CameraDescription, RawFormat, RawLevels};
use crate::camera_pictures::CameraPictures;
use crate::effects::Effects;
use crate::lens_tracing::LensTracing;
use crate::manifest::FileEntry;
use crate::mosaic::Mosaic;
use crate::paths::{PathError, checked_name, checked_sample_name};
use crate::readout::Readout;
use crate::version::{Description, SCHEMA_VERSION};

/// The whole of `meta.json`. No date, host name, run time or thread count: the same seed gives the same bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleMeta {
    /// Version of the layout, [`crate::SCHEMA_VERSION`].
    pub schema_version: u32,
    /// Version of the program that wrote it.
    pub tool_version: String,
    /// BLAKE3 hash of the configuration it was made with, 64 hexadecimal digits: samples of one dataset share it.
    pub configuration_blake3: String,
    /// Six-digit name, also the folder's.
    pub id: String,
    /// The sample's own seed.
    pub seed: u64,
    /// What is in front of the camera.
    pub scene: Scene,
    /// The main lens.
    pub lens: Lens,
    /// Where it is focused.
    pub focus: Focus,
    /// The pixels.
    pub sensor: Sensor,
    /// What an angle of incidence does to each sub-pixel.
    pub response: Response,
    /// The colour channels of raw, views and target, in order.
    pub channels: Vec<Channel>,
    /// From scene radiance to linear values.
    pub exposure: Exposure,
    /// How the raw mosaic is stored.
    pub raw: Raw,
    /// Noise that was added.
    pub noise: Noise,
    /// The colour-filter mosaic; absent where none was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mosaic: Option<Mosaic>,
    /// Camera-like pictures; absent where none were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_pictures: Option<CameraPictures>,
    /// The paraxial pinhole camera of the stored images.
    pub intrinsics: Intrinsics,
    /// What was simulated, and what was not.
    pub effects: Effects,
    /// How well the render converged.
    pub statistics: RenderStatistics,
    /// What the truth maps are the truth of.
    pub truth: Truth,
    /// Ranges of the truth maps over the valid pixels.
    pub ranges: Ranges,
    /// Truth, for scoring: the tie between left-right disparity and circle of confusion, fitted to the maps of this
    /// sample; `null` where nothing is out of focus or the pixel has one column. The camera's own ratio is in
    /// `camera.json`.
    pub coc_disparity: Option<CocDisparity>,
    /// The sample's files but `meta.json`, in the order of their names.
    pub files: Vec<SampleFile>,
    /// Length and hash of each of them and of `camera.json`, in the order of their names; a path is the file's name.
    pub contents: Vec<FileEntry>,
}

impl SampleMeta {
    /// The sample's `camera.json`: what of all this the camera knows itself, and its ratio of disparity to circle of
    /// confusion.
    pub fn camera(&self, curves: CameraCurves) -> CameraDescription {
        CameraDescription {
            schema_version: SCHEMA_VERSION,
            pitch_um: self.sensor.pitch_um,
            subpixels: self.sensor.subpixels,
            width_px: self.sensor.width_px,
            height_px: self.sensor.height_px,
            centre_mm: self.sensor.centre_mm,
            channels: self.channels.iter().map(|c| c.name.clone()).collect(),
            raw: RawLevels {
                format: self.raw.format,
                black_level: self.raw.black_level,
                white_level: self.raw.white_level,
                linear_at_white: self.raw.linear_at_white,
            },
            lens: self.lens.name.clone(),
            efl_mm: self.lens.efl_mm,
            f_number: self.lens.f_number,
            focus: self.focus.clone(),
            intrinsics: self.intrinsics.clone(),
            response: self.response.clone(),
            disparity_ratio: curves.disparity_ratio,
            disparity: curves.disparity,
            matching: curves.matching,
            blur: curves.blur,
        }
    }
}

/// The scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Identity for the splits: samples that show the same scene share it.
    pub id: String,
    /// The charts in it, nearest first, e.g. `dead_leaves`.
    pub charts: Vec<String>,
    /// Everything that was drawn for it: distances, tilts, sizes, chart parameters.
    pub parameters: serde_json::Value,
}

/// The raw mosaic's encoding.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Raw {
    /// Of `raw.png` or `raw.exr`.
    pub format: RawFormat,
    /// PNG code of the linear value 0; `null` for EXR.
    pub black_level: Option<u16>,
    /// PNG code of `linear_at_white`; `null` for EXR.
    pub white_level: Option<u16>,
    /// Linear value at the white level: linear = (code − black) / (white − black) × `linear_at_white`; `null` for EXR.
    pub linear_at_white: Option<f64>,
    /// Number of values that fell outside 0..=65535 and were clipped.
    pub clipped: u64,
}

/// Noise that was added, in files of its own: `raw`, `views` and `target` are clean always.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Noise {
    /// None; what noise there is, is the render's own (see the statistics).
    None,
    /// `noisy` and `noisyviews` are a sensor's readout of the clean mosaic.
    Readout(Readout),
}

impl Noise {
    /// The readout, where there is one.
    pub fn readout(&self) -> Option<&Readout> {
        match self {
            Self::None => None,
            Self::Readout(readout) => Some(readout),
        }
    }
}

/// Convergence of the render.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RenderStatistics {
    /// Rays a pixel and channel.
    pub rays_per_pixel: u32,
    /// Rays traced in all.
    pub rays: u64,
    /// Rays that did not reach the scene.
    pub lost: LostRays,
    /// Root mean square of the error that sampling leaves in a sub-pixel's value, over the mean value; `null` if not
    /// measured, as in all of these.
    pub rms_error_over_mean: Option<f64>,
    /// Median over the values of error over value.
    pub median_relative_error: Option<f64>,
    /// Part of the values of which a second render differs by more than half.
    pub speckle_share: Option<f64>,
    /// Pixels without truth (0 in `valid.png`).
    pub invalid_pixels: u64,
    /// How the rays went through the lens; absent in samples of earlier builds, which traced each surface by surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lens_tracing: Option<LensTracing>,
}

/// What the truth maps are the truth of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// The surface that a pixel of the maps and of the target refers to.
    pub registration: Registration,
    /// Colour channel of disparity, circle of confusion and depth.
    pub channel: String,
    /// Whether the channels see different places: `shifts.exr` then holds what the others' disparity is.
    pub channels_differ: bool,
}

/// The surface that a pixel of the maps and of the target refers to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Registration {
    /// What the sum of the sub-pixels sees there on average: the maps stand where the picture stands.
    #[default]
    Centroid,
    /// What the chief ray meets.
    ChiefRay,
}

/// Lost rays by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LostRays {
    /// Did not meet a surface.
    pub missed: u64,
    /// Met a surface outside its clear aperture, or the stop.
    pub vignetted: u64,
    /// Were totally reflected.
    pub total_internal_reflection: u64,
}

/// Smallest and largest finite value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

/// Ranges of the truth; `null` where no pixel has a finite value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ranges {
    /// Depth, m.
    pub depth_m: Option<Range>,
    /// Pixels at infinite depth.
    pub sky_pixels: u64,
    /// Traced disparity dx over all sub-pixels, px.
    pub dx_px: Option<Range>,
    /// Traced disparity dy over all sub-pixels, px.
    pub dy_px: Option<Range>,
    /// Circle of confusion, px.
    pub coc_px: Option<Range>,
}

/// Least-squares ratio, through the origin, of x_L − x_R to the circle of confusion over the valid pixels:
/// x_L − x_R ≈ −ratio × coc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CocDisparity {
    /// Of the traced disparity.
    pub traced_ratio: f64,
    /// Of the paraxial one.
    pub paraxial_ratio: f64,
}

/// One file of the sample.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleFile {
    /// Its name in the sample's folder.
    pub name: String,
    /// What it holds.
    pub kind: FileKind,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Channel names as in the file, in the file's order for EXR (sorted).
    pub channels: Vec<String>,
    /// How a number is stored.
    pub storage: Storage,
}

/// What a file holds.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum FileKind {
    /// The sub-pixel mosaic.
    Raw,
    /// A layer per sub-pixel, and their sum.
    Views,
    /// The all-in-focus image.
    Target,
    /// z, m.
    Depth,
    /// Ray distance, m.
    Distance,
    /// Shift of each sub-pixel's view, px.
    Disparity,
    /// Signed circle of confusion, px.
    Coc,
    /// Small shifts beside the disparity: of the registration and of the colour channels, px.
    Shifts,
    /// Part of the pupil that sees another surface.
    Occlusion,
    /// Number of the object that is seen; of worlds of meshes.
    Objects,
    /// Normal of the surface that is seen; of worlds of meshes.
    Normal,
    /// 255 where the float maps apply, else 0.
    Valid,
    /// The contact sheet.
    Preview,
    /// The mosaic as a sensor reads it: digital numbers.
    Noisy,
    /// The views of the noisy mosaic and their sum, linear.
    NoisyViews,
    /// What a white wall gives on each sub-pixel.
    Shading,
    /// Of the sub-pixel mosaic, each microlens's own colour.
    Mosaic,
    /// The same of the noisy one.
    NoisyMosaic,
    /// The sum as a camera writes it, 8-bit sRGB, as a JPEG.
    CameraJpeg,
    /// The views alike, side by side.
    CameraViewsJpeg,
    /// As `camerajpeg`, without loss.
    CameraPng,
    /// As `cameraviewsjpeg`, without loss.
    CameraViewsPng,
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Storage {
    /// 8-bit integer.
    Uint8,
    /// 16-bit integer.
    Uint16,
    /// 16-bit float.
    Half,
    /// 32-bit float.
    Float,
}

impl Description for SampleMeta {
    fn check_names(&self) -> Result<(), PathError> {
        checked_sample_name(&self.id)?;
        let names = self.files.iter().map(|file| &file.name);
        for name in names.chain(self.contents.iter().map(|entry| &entry.path)) {
            checked_name(name)?;
        }
        Ok(())
    }
}
