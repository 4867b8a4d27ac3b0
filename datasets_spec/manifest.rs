//! `dataset.json`: what the dataset is, how it was made, and the hash of every file in it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::split::Split;

/// The whole of `dataset.json`. It holds no date, host name, run time or thread count: the same seed and configuration
/// give the same bytes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DatasetManifest {
    /// Version of the layout, [`crate::SCHEMA_VERSION`].
    pub schema_version: u32,
    /// What wrote it.
    pub tool: Tool,
    /// Seed from which every sample's own seed follows.
    pub seed: u64,
    /// The whole configuration of the run.
    pub configuration: serde_json::Value,
    /// BLAKE3 hash of each file that the configuration names (lenses, pixels, tables, pictures), by the name it has
    /// there.
    pub inputs: BTreeMap<String, String>,
    /// Unit of each quantity in the files.
    pub units: BTreeMap<String, String>,
    /// Frames, signs and names in words; SPEC.md has them in full.
    pub conventions: BTreeMap<String, String>,
    /// Licence of the data (SPDX expression).
    pub licence: String,
    /// The samples, in the order of their names.
    pub samples: Vec<SampleEntry>,
    /// Every file of the dataset but `dataset.json`, in the order of their paths.
    pub files: Vec<FileEntry>,
}

/// The program that wrote the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tool {
    /// Its name.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// One sample of the list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleEntry {
    /// Six-digit name, also the folder's.
    pub id: String,
    /// The scene it shows; all samples of a scene are in one split.
    pub scene: String,
    /// The split of the scene.
    pub split: Split,
}

/// One file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Path below the dataset's folder, parted by `/`.
    pub path: String,
    /// Length, bytes.
    pub bytes: u64,
    /// BLAKE3 hash of the content, 64 hexadecimal digits.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub blake3: String,
}

impl FileEntry {
    /// The entry of a file with this content.
    pub fn new(path: &str, content: &[u8]) -> Self {
        Self {
            path: path.to_string(),
            bytes: content.len() as u64,
            blake3: blake3::hash(content).to_hex().to_string(),
        }
    }

    /// The entry of a file with the content that is read here.
    ///
    /// # Errors
    /// What `content` says.
    pub fn read(path: &str, content: impl std::io::Read) -> std::io::Result<Self> {
        let mut hash = blake3::Hasher::new();
        hash.update_reader(content)?;
        Ok(Self {
            path: path.to_string(),
            bytes: hash.count(),
            blake3: hash.finalize().to_hex().to_string(),
        })
    }
}

/// The units of this schema version.
pub fn units() -> BTreeMap<String, String> {
    table(&[
        ("raw, views, target", "linear, 1 = the sensor's white"),
        ("depth", "m along the axis from the first lens vertex"),
        ("distance", "m from the first lens vertex"),
        ("disparity", "px, 1 px = 1 microlens"),
        ("coc", "px, signed diameter"),
        (
            "occlusion",
            "fraction of the pupil that sees another surface than the chief ray",
        ),
        ("wavelength", "nm"),
        ("pitch, microlens shift", "um"),
        ("lens", "mm"),
    ])
}

/// The conventions of this schema version.
pub fn conventions() -> BTreeMap<String, String> {
    table(&[
        (
            "image",
            "row 0 on top, upright, not mirrored: columns grow to the photographer's right, rows downwards; pixel centres \
             have integer coordinates",
        ),
        (
            "sub-pixels",
            "index = row * columns + column within the pixel as stored; 2x2: B A over D C; 2x1: L R; 1x2: T over B; \
             else r{row}c{column}",
        ),
        (
            "raw",
            "the sub-pixel (column i, row j) of pixel (x, y) is at (x * columns + i, y * rows + j)",
        ),
        (
            "views",
            "L = B + D sees the left half of the pupil as the photographer does, R = A + C the right, T = B + A the \
             upper, bottom = D + C the lower",
        ),
        (
            "disparity",
            "position in the view minus position in the sum of all sub-pixels; dx to the right, dy downwards",
        ),
        (
            "left-right disparity",
            "x_L - x_R > 0 for points nearer than the focus",
        ),
        ("coc", "positive behind the focus (farther than the focus)"),
        ("sky", "depth and distance are +inf"),
        (
            "valid",
            "0 where no float map applies; depth, distance, disparity and coc are NaN exactly there",
        ),
    ])
}

fn table(rows: &[(&str, &str)]) -> BTreeMap<String, String> {
    let texts = |&(key, value): &(&str, &str)| (key.to_string(), value.to_string());
    rows.iter().map(texts).collect()
}
