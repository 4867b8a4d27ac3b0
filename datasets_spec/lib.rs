//! The on-disk contract of quadpixel datasets, for writers, readers and checkers: see `SPEC.md` beside this file.
//!
//! - [`DatasetManifest`] is `dataset.json`, [`SampleMeta`] is a sample's `meta.json`,
//!   [`CameraDescription`] the `camera.json` beside it; their JSON Schemas lie in `schema/`.
//! - [`paths`] names the files; [`split_of_scene`] puts a scene into train, val or test.
//! - [`check_dataset`] reads a whole dataset back and lists what is wrong with it (feature `check`, on by default).
//!
//! # Reading a dataset
//!
//! `dataset.json` lists samples and files; a sample's `meta.json` and `camera.json` are read the same way, and pictures
//! with any reader of EXR and PNG.
//!
//! ```
//! use quadpixel_datasets::{DatasetManifest, Split, paths};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = std::env::temp_dir().join(format!("quadpixel-read-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let version = quadpixel_datasets::SCHEMA_VERSION;
//! # std::fs::write(folder.join(paths::DATASET), format!(r#"{{"schema_version": {version},
//! #     "tool": {{"name": "t", "version": "1"}},
//! #     "seed": 1, "configuration": null, "inputs": {{}}, "units": {{}}, "conventions": {{}}, "licence": "CC-BY-4.0",
//! #     "samples": [{{"id": "000001", "scene": "0001", "split": "train"}}], "files": []}}"#))?;
//! let text = std::fs::read_to_string(folder.join(paths::DATASET))?;
//! let manifest: DatasetManifest = serde_json::from_str(&text)?;
//! assert_eq!(manifest.schema_version, quadpixel_datasets::SCHEMA_VERSION);
//! let train = manifest.samples.iter().filter(|sample| sample.split == Split::Train);
//! let names: Vec<&str> = train.map(|sample| sample.id.as_str()).collect();
//! assert_eq!(names, ["000001"]);
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok(())
//! # }
//! ```

mod blur_rays;
mod camera;
mod camera_curves;
mod camera_description;
mod camera_pictures;
#[cfg(feature = "check")]
mod check;
mod effects;
pub mod file;
mod layout;
mod lens_tracing;
#[cfg(feature = "check")]
mod load;
mod manifest;
mod matching_curve;
pub mod memory;
mod mosaic;
pub mod paths;
mod ratio_field;
mod readout;
mod sample;
mod split;
mod subpixels;
mod version;

pub use blur_rays::BlurRays;
pub use camera::{
    Channel, ChannelBand, ChannelOptics, CraShift, Element, ExitPupil, Exposure, Focus, FocusBy,
    Intrinsics, Lens, MicrolensRule, Misalignment, Part, Response, Sensor, TableColour,
    TablePreset,
};
pub use camera_curves::{CameraCurves, DisparityCurve, DisparityCurves, DisparityRatio};
pub use camera_description::{CameraDescription, RawFormat, RawLevels};
pub use camera_pictures::{CameraPictures, Development, DevelopmentError};
#[cfg(feature = "check")]
pub use check::{Finding, Progress, Report, check_dataset, check_hashes};
pub use effects::{Effect, Effects, EstimatedError, LeftOut, Reason};
pub use layout::{COLOUR_SHIFTS, Optional, SUM_LAYER, is_sample_file, sample_files};
pub use lens_tracing::{LensMap, LensMethod, LensTracing, MapError};
pub use manifest::{DatasetManifest, FileEntry, SampleEntry, Tool, conventions, units};
pub use matching_curve::{MatchingCurve, MatchingCurves};
pub use mosaic::{CodeLevels, Mosaic, MosaicPattern};
pub use ratio_field::RatioField;
pub use readout::Readout;
pub use sample::{
    CocDisparity, FileKind, LostRays, Noise, Range, Ranges, Raw, Registration, RenderStatistics,
    SampleFile, SampleMeta, Scene, Storage, Truth,
};
pub use split::{Split, split_of_scene, split_scenes};
pub use subpixels::{Subpixels, SubpixelsError};
pub use version::{
    Description, ParseError, SCHEMA_VERSION, check_version, parse, read_description,
};

/// The contract in words.
pub const SPEC: &str = include_str!("SPEC.md");

/// The JSON Schema of `dataset.json`.
pub fn dataset_schema() -> serde_json::Value {
    schemars::schema_for!(DatasetManifest).to_value()
}

/// The JSON Schema of `camera.json`.
pub fn camera_schema() -> serde_json::Value {
    schemars::schema_for!(CameraDescription).to_value()
}

/// The JSON Schema of `meta.json`.
pub fn sample_schema() -> serde_json::Value {
    schemars::schema_for!(SampleMeta).to_value()
}
