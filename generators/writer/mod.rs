//! Writes one sample into the native layout (datasets_spec, SPEC.md), and finishes a dataset of them.
//!
//! A sample is written into `samples/.tmp-NNNNNN` and renamed to `samples/NNNNNN` when it is whole, so a folder under
//! its final name is always complete and an interrupted run goes on where it stopped ([`found_sample`]).

mod dataset;
mod encode;
mod mosaic;
mod resume;
mod sound;
mod survey;
mod truth;

use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError};
use quadpixel::image::raster::Levels;
use quadpixel::image::{Image, ImageError};
use quadpixel_datasets as spec;
use quadpixel_datasets::paths;

pub use dataset::{Dataset, finish_dataset, rebuild_pages};
pub use resume::{Found, found_sample};

/// What a sample consists of. W × H pixels of m × n sub-pixels; every image has row 0 on top.
#[derive(Clone, Debug)]
pub struct SampleFiles<'a> {
    /// The sub-pixel mosaic, m·W × n·H, linear, one channel per colour: finite and not negative.
    pub raw: &'a Image,
    /// How the mosaic is stored.
    pub raw_encoding: RawEncoding,
    /// The all-in-focus image, W × H, linear, on the scale of the sum of all sub-pixels.
    pub target: &'a Image,
    /// z from the first lens vertex, m, one channel; +inf for the sky.
    pub depth_m: &'a Image,
    /// Distance from the first lens vertex, m, one channel; left out of the sample if `None`.
    pub distance_m: Option<&'a Image>,
    /// Traced disparity (dx, dy), px, two channels: one image a sub-pixel in stored order.
    pub traced_px: &'a [Image],
    /// The paraxial disparity, alike.
    pub paraxial_px: &'a [Image],
    /// Signed circle of confusion, px, one channel.
    pub coc_px: &'a Image,
    /// Fraction (0 to 1) of the pupil that sees another surface than the chief ray, one channel.
    pub occlusion: &'a Image,
    /// The capture as a sensor reads it, where that is asked for.
    pub noisy: Option<NoisyFiles<'a>>,
    /// Where the float maps apply. A pixel with NaN in any of them is invalid too, and NaN goes into all of them there.
    pub valid: &'a [bool],
    /// Objects and normals, of worlds of meshes; left out of the sample if `None`.
    pub seen: Option<Seen<'a>>,
    /// Everything else.
    pub description: Description,
}

/// What the chief rays see of a world of meshes.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Number of the object of each pixel; 65535 where none.
    pub objects: &'a [u16],
    /// Unit normal on the camera's side (X right, Y up, Z into the scene), three channels; 0 where nothing is met.
    pub normals: &'a Image,
}

/// A noisy capture.
#[derive(Clone, Copy, Debug)]
pub struct NoisyFiles<'a> {
    /// Digital numbers of the mosaic.
    pub codes: &'a Image,
    /// Their linear values.
    pub linear: &'a Image,
    /// What a white wall gives on each sub-pixel, in stored order: W × H, one channel per colour.
    pub shading: &'a [Image],
}

/// How the raw mosaic is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RawEncoding {
    /// 16-bit PNG with these levels.
    Png(Levels),
    /// Half-float EXR.
    Exr,
}

/// What only the renderer knows of a sample; the writer adds files, ranges and counts to make [`spec::SampleMeta`].
#[derive(Clone, Debug)]
pub struct Description {
    /// Number of the sample; its name has six digits.
    pub index: u32,
    /// [`configuration_hash`] of the run.
    pub configuration_blake3: String,
    /// The sample's own seed.
    pub seed: u64,
    /// The scene.
    pub scene: spec::Scene,
    /// The main lens.
    pub lens: spec::Lens,
    /// Focus.
    pub focus: spec::Focus,
    /// Sensor window and sub-pixels.
    pub sensor: spec::Sensor,
    /// Angular response.
    pub response: spec::Response,
    /// Colour channels of raw and target.
    pub channels: Vec<spec::Channel>,
    /// Exposure.
    pub exposure: spec::Exposure,
    /// Noise.
    pub noise: spec::Noise,
    /// Colours of the microlenses, where their mosaic is asked for; then the raw mosaic is a PNG of R, G, B.
    pub mosaic: Option<spec::MosaicPattern>,
    /// Pinhole camera.
    pub intrinsics: spec::Intrinsics,
    /// Ratio of disparity to circle of confusion, for `camera.json`.
    pub disparity_ratio: spec::DisparityRatio,
    /// Effects simulated and left out.
    pub effects: spec::Effects,
    /// Rays a pixel and channel.
    pub rays_per_pixel: u32,
    /// Rays in all.
    pub rays: u64,
    /// Lost rays.
    pub lost: spec::LostRays,
    /// Mean relative standard error of the sum.
    pub mean_relative_standard_error: Option<f64>,
}

/// Why a sample or dataset could not be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// A picture could not be stored.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A name or number that is not allowed.
    #[error(transparent)]
    Path(#[from] paths::PathError),
    /// An input does not have the shape that the sensor asks for.
    #[error("sample {sample}: {what}")]
    Input {
        /// Name of the sample.
        sample: String,
        /// What does not fit, and what would.
        what: String,
    },
    /// Something is there already that this run may not replace.
    #[error("{}: {what}", path.display())]
    Occupied {
        /// The file or folder.
        path: PathBuf,
        /// Why it is in the way.
        what: String,
    },
    /// A description cannot be written as JSON.
    #[error("{}: cannot be written as JSON: {cause}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// The reason.
        cause: serde_json::Error,
    },
}

impl WriteError {
    /// Whether the caller can mend it: another folder or another sample.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Occupied { .. } | Self::Input { .. } | Self::Path(_) => true,
            Self::File(_) | Self::Image(_) | Self::Json { .. } => false,
        }
    }
}

/// BLAKE3 hash of a configuration: of its JSON with sorted keys and no spaces.
pub fn configuration_hash(configuration: &serde_json::Value) -> String {
    blake3::hash(configuration.to_string().as_bytes())
        .to_hex()
        .to_string()
}

/// Writes a sample below `root` (created if missing), and waits for the disk.
///
/// Errors: an image of another size than the sensor's, light that is negative or not finite, a sample of that name, a
/// link in the place of a folder, the disk. Nothing is left under the final name then.
pub fn write_sample(root: &Path, sample: &SampleFiles<'_>) -> Result<spec::SampleMeta, WriteError> {
    let name = paths::sample_name(sample.description.index)?;
    let samples = root.join(paths::SAMPLES);
    let (meta, contents) = encode::encode(sample, &name)?;
    file::create_folder(root)?;
    file::own_folder(&samples)?;
    write_folder(&aside_of(&samples, &name), &samples.join(&name), &contents)?;
    Ok(meta)
}

/// Writes a sample of no dataset as the new folder `folder`; as [`write_sample`] otherwise.
pub fn write_alone(
    folder: &Path,
    sample: &SampleFiles<'_>,
) -> Result<spec::SampleMeta, WriteError> {
    let name = paths::sample_name(sample.description.index)?;
    let (meta, contents) = encode::encode(sample, &name)?;
    if let Some(parent) = folder.parent() {
        file::create_folder(parent)?;
    }
    write_folder(&file::aside(folder), folder, &contents)?;
    Ok(meta)
}

/// Where a sample is made before it gets its name; one that is not named again is the leftover of a killed run.
fn aside_of(samples: &Path, name: &str) -> PathBuf {
    samples.join(format!(".tmp-{name}"))
}

fn write_folder(
    aside: &Path,
    folder: &Path,
    contents: &[(String, Vec<u8>)],
) -> Result<(), WriteError> {
    if folder.symlink_metadata().is_ok() {
        return Err(WriteError::Occupied {
            path: folder.to_path_buf(),
            what: "is there already".into(),
        });
    }
    let write = || {
        file::remove(aside)?;
        file::own_folder(aside)?;
        for (name, bytes) in contents {
            file::write_synced(&aside.join(name), bytes)?;
        }
        file::rename_synced(aside, folder)
    };
    write().map_err(|error| {
        // The first error is the one to tell; a leftover that cannot be removed changes nothing about it.
        let _ = file::remove(aside);
        error.into()
    })
}

/// Version of this program, as written into the files.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Pretty JSON with a final line feed.
fn json<T: serde::Serialize>(path: &Path, value: &T) -> Result<Vec<u8>, WriteError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|cause| WriteError::Json {
        path: path.to_path_buf(),
        cause,
    })?;
    bytes.push(b'\n');
    Ok(bytes)
}
