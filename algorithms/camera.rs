//! What the camera of a capture says of itself: `camera.json`, or the same fields of a sample's `meta.json`.
//!
//! A [`CameraDescription`] holds nothing that depends on the scene. Of a `meta.json` only the camera's own fields are
//! read; whatever else it holds (the scene, ranges of the truth, statistics of the render) may be missing or be
//! anything.

use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError};
use quadpixel_datasets::{
    CameraDescription, Channel, DisparityCurves, DisparityRatio, Focus, Intrinsics, MatchingCurves,
    ParseError, RawFormat, RawLevels, Response, SCHEMA_VERSION, Sensor, check_version, paths,
};
use serde::Deserialize;

/// A file that describes no camera.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// It cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It is no JSON, or a field is missing or wrong.
    #[error("{}: {cause}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Where and what.
        cause: String,
    },
}

/// The camera's own fields of a `meta.json`; all others are passed over.
#[derive(Deserialize)]
struct MetaCamera {
    lens: MetaLens,
    focus: Focus,
    sensor: Sensor,
    response: Response,
    channels: Vec<Channel>,
    raw: MetaRaw,
    intrinsics: Intrinsics,
}

/// Of the lens what its maker says.
#[derive(Deserialize)]
struct MetaLens {
    name: String,
    efl_mm: f64,
    f_number: f64,
}

/// How the raw mosaic is stored.
#[derive(Deserialize)]
struct MetaRaw {
    format: RawFormat,
    black_level: Option<u16>,
    white_level: Option<u16>,
    linear_at_white: Option<f64>,
}

impl From<MetaCamera> for CameraDescription {
    fn from(meta: MetaCamera) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            pitch_um: meta.sensor.pitch_um,
            subpixels: meta.sensor.subpixels,
            width_px: meta.sensor.width_px,
            height_px: meta.sensor.height_px,
            centre_mm: meta.sensor.centre_mm,
            channels: meta.channels.into_iter().map(|c| c.name).collect(),
            raw: RawLevels {
                format: meta.raw.format,
                black_level: meta.raw.black_level,
                white_level: meta.raw.white_level,
                linear_at_white: meta.raw.linear_at_white,
            },
            lens: meta.lens.name,
            efl_mm: meta.lens.efl_mm,
            f_number: meta.lens.f_number,
            focus: meta.focus,
            intrinsics: meta.intrinsics,
            response: meta.response,
            // Only `camera.json` holds it.
            disparity_ratio: DisparityRatio {
                left_right: None,
                top_bottom: None,
            },
            disparity: DisparityCurves::default(),
            matching: MatchingCurves::default(),
            blur: None,
        }
    }
}

/// Reads a `camera.json`.
///
/// # Errors
/// The file cannot be read, is no JSON, or a field is missing, unknown or of another kind.
pub fn read_description(path: &Path) -> Result<CameraDescription, CameraError> {
    parsed(path, &file::read(path)?)
}

/// Reads the camera's own fields of a `meta.json`; they do not tell the ratio of disparity to circle of confusion.
///
/// # Errors
/// The file cannot be read, is no JSON, or one of these fields is missing or of another kind.
pub fn read_meta(path: &Path) -> Result<CameraDescription, CameraError> {
    let meta: MetaCamera = parsed(path, &file::read(path)?)?;
    Ok(meta.into())
}

/// The description in a folder, with its file: its `camera.json`, else its `meta.json`; `None` where it has neither. A
/// `camera.json` without a version of the layout is a file of another kind (a calibration may be called so) and passed
/// over.
///
/// # Errors
/// As of [`read_description`] and [`read_meta`]; a `camera.json` or `meta.json` that is no plain file.
pub fn read_beside(folder: &Path) -> Result<Option<(PathBuf, CameraDescription)>, CameraError> {
    let (camera, meta) = (folder.join(paths::CAMERA), folder.join(paths::META));
    if camera.exists() {
        let bytes = file::read(&camera)?;
        let value: serde_json::Value = parsed(&camera, &bytes)?;
        if value.get("schema_version").is_some() {
            return Ok(Some((camera.clone(), parsed(&camera, &bytes)?)));
        }
    }
    if meta.exists() {
        let description = read_meta(&meta)?;
        return Ok(Some((meta, description)));
    }
    Ok(None)
}

fn parsed<T: for<'a> Deserialize<'a>>(path: &Path, bytes: &[u8]) -> Result<T, CameraError> {
    let error = |cause: String| CameraError::Json {
        path: path.to_path_buf(),
        cause,
    };
    let value: serde_json::Value =
        serde_json::from_slice(bytes).map_err(|e| error(e.to_string()))?;
    // A file without a version may be of another kind, and its fields say what is wrong.
    match check_version(&value) {
        Ok(()) | Err(ParseError::NoVersion) => {}
        Err(version) => return Err(error(version.to_string())),
    }
    serde_json::from_slice(bytes).map_err(|e| error(e.to_string()))
}
