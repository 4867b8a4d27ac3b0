//! A picture with depth in a recipe.

use std::path::{Path, PathBuf};

use quadpixel::file;
use quadpixel::rgbd::{DepthPicture, RgbdError};
use serde::{Deserialize, Serialize};

use super::files::Stored;
use super::meaning::{DepthKind, Meaning};
use super::{PictureError, depth, files, light, preset};

/// Middlebury's file of cameras.
const CALIBRATION: &str = "calib.txt";

/// Largest share of a pixel's light that may come from places that are made up, for the pixel to be valid.
const MADE_UP_SHARE: f32 = 0.05;

/// How a picture with depth is converted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// By kernels of every sub-pixel, scattered from layers of depth.
    #[default]
    Psf,
    /// By rays to surfaces, as many as the render settings say: exact, and slower.
    Rays,
}

impl Level {
    /// Whether it is the one that files leave out.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// A picture and its depth, and what their numbers mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RgbdRecipe {
    /// Linear or sRGB picture: PNG, JPEG, TIFF, EXR, PFM or NPY.
    pub image: String,
    /// Its depth, of the same size: PNG, TIFF, EXR, PFM or NPY.
    pub depth: String,
    /// What their numbers mean.
    #[serde(default)]
    pub meaning: Meaning,
    /// How it is converted.
    #[serde(default, skip_serializing_if = "Level::is_default")]
    pub level: Level,
    /// Focuses at the depth that this share (0 to 1) of the picture's pixels are nearer than; absent: as the lens says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_share: Option<f64>,
}

impl RgbdRecipe {
    /// Of two files: what `meaning` leaves open is taken from `STEM.json` beside the depth, or else beside the picture,
    /// where there is one; and what a disparity then leaves open from Middlebury's `calib.txt` beside it.
    ///
    /// # Errors
    /// A sidecar that cannot be read, or numbers that are none; a path that is no UTF-8, as recipes are.
    pub fn new(image: &Path, depth: &Path, meaning: &Meaning) -> Result<Self, PictureError> {
        let mut meaning = meaning.clone();
        for path in [depth, image].map(|p| p.with_extension("json")) {
            if path.is_file() {
                meaning = meaning.or(sidecar(&path)?);
                break;
            }
        }
        let calibrated = depth.with_file_name(CALIBRATION);
        let is_open = meaning.baseline_m.is_none() && meaning.intrinsics.is_none();
        if meaning.kind == Some(DepthKind::Disparity) && is_open && calibrated.is_file() {
            meaning = meaning.or(read_as(&calibrated, preset::calibration)?);
        }
        meaning.check().map_err(|what| PictureError::File {
            path: depth.to_owned(),
            what,
        })?;
        Ok(Self {
            image: text(image)?,
            depth: text(depth)?,
            meaning,
            level: Level::default(),
            focus_share: None,
        })
    }

    /// Of numbers in memory, and their picture; hashes of the numbers are in the place of names of files.
    ///
    /// # Errors
    /// As of [`Self::new`] and [`Self::read`].
    pub fn of_arrays(
        image: &Stored,
        depth: &Stored,
        meaning: &Meaning,
    ) -> Result<(Self, DepthPicture), PictureError> {
        meaning.check().map_err(|what| PictureError::File {
            path: "depth".into(),
            what,
        })?;
        let recipe = Self {
            image: image.name(),
            depth: depth.name(),
            meaning: meaning.clone(),
            level: Level::default(),
            focus_share: None,
        };
        let picture = recipe.picture(image, depth)?;
        Ok((recipe, picture))
    }

    /// Reads both.
    ///
    /// # Errors
    /// A file that cannot be read or whose numbers do not serve; sizes that differ; light that is none.
    pub fn read(&self) -> Result<DepthPicture, PictureError> {
        let image = files::read(Path::new(&self.image))?;
        let depth = files::read(Path::new(&self.depth))?;
        self.picture(&image, &depth)
    }

    fn picture(&self, image: &Stored, depth: &Stored) -> Result<DepthPicture, PictureError> {
        let light = light::of(image, Path::new(&self.image), &self.meaning)?;
        let depth_mm = depth::of(depth, Path::new(&self.depth), &self.meaning)?;
        DepthPicture::new(light, depth_mm).map_err(|cause| self.pair(cause))
    }

    /// Columns and rows of the picture, by its header where that says so.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn size(&self) -> Result<(usize, usize), PictureError> {
        files::size(Path::new(&self.image)).map_err(PictureError::from)
    }

    /// An error of the two together.
    pub fn pair(&self, cause: RgbdError) -> PictureError {
        PictureError::Pair {
            image: PathBuf::from(&self.image),
            depth: PathBuf::from(&self.depth),
            cause,
        }
    }

    /// A short name: the picture's stem.
    pub fn name(&self) -> &str {
        let stem = Path::new(&self.image).file_stem();
        stem.and_then(|s| s.to_str()).unwrap_or("picture")
    }

    /// Whether a pixel is valid of whose light this share comes from places that are made up.
    pub(crate) fn is_known(made_up: f32) -> bool {
        made_up <= MADE_UP_SHARE
    }
}

/// A path as a recipe writes it.
fn text(path: &Path) -> Result<String, PictureError> {
    let text = path.to_str().map(str::to_owned);
    text.ok_or_else(|| PictureError::File {
        path: path.to_owned(),
        what: "its path is no UTF-8, and recipes are; allowed: the same under another name".into(),
    })
}

fn sidecar(path: &Path) -> Result<Meaning, PictureError> {
    read_as(path, |text| {
        serde_json::from_str(text).map_err(|e| e.to_string())
    })
}

fn read_as(
    path: &Path,
    parse: impl Fn(&str) -> Result<Meaning, String>,
) -> Result<Meaning, PictureError> {
    let refused = |what: String| PictureError::File {
        path: path.to_owned(),
        what,
    };
    let text = file::read_text(path).map_err(|e| refused(e.cause.to_string()))?;
    parse(&text).map_err(refused)
}
