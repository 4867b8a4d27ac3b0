//! A capture: the views of one exposure, and what its camera says of itself.
//!
//! It comes from a sample's folder (its raw mosaic and `camera.json`), from a mosaic, or from an EXR with a layer per
//! view. No truth can come with it: of a sample's folder only the raw mosaic and the camera's own description are read
//! (see [`crate::camera`]).

mod error;

use std::path::{Path, PathBuf};

use quadpixel::image::exr::NamedLayer;
use quadpixel::image::srgb::to_linear;
use quadpixel::image::{Image, channel};
use quadpixel::sensor::Subpixels;
use quadpixel_datasets::{CameraDescription, RawFormat, RawLevels, paths};

use crate::camera::{self, CameraError};
use crate::load;
use crate::sai::{Side, Views};
pub use error::CaptureError;

/// Views with what is known of their camera.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The views.
    pub views: Views,
    /// Names of the colour channels, in order.
    pub channels: Vec<String>,
    /// Linear value of a full code of the mosaic: 1 unless the description says otherwise.
    pub white: f64,
    /// What the camera says of itself, where there is such a file.
    pub camera: Option<CameraDescription>,
}

/// What the user says of a capture; what is absent is taken from the files beside it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CaptureOptions {
    /// Sub-pixels of a pixel.
    pub subpixels: Option<Subpixels>,
    /// A `camera.json`.
    pub camera: Option<PathBuf>,
    /// A `meta.json`, of which the camera's fields are read.
    pub meta: Option<PathBuf>,
}

/// One channel of a view, and of what it is compared with.
#[derive(Clone, Debug)]
pub struct ViewPair {
    /// `VIEW.CHANNEL`, or the channel alone.
    pub name: String,
    /// The view.
    pub view: Image,
    /// What it is compared with, of its size.
    pub reference: Image,
}

impl Capture {
    /// Reads `path`: a sample's folder, a mosaic, or an EXR with a layer per view. The description is that of the
    /// options, else the `camera.json` in the same folder, else the camera's fields of the `meta.json` there.
    ///
    /// # Errors
    /// A file that is missing or no picture, a description that is none or fits the views not, sub-pixels that nothing
    /// tells.
    pub fn read(path: &Path, options: &CaptureOptions) -> Result<Self, CaptureError> {
        let is_folder = path.is_dir();
        let folder = match is_folder {
            true => path,
            false => path.parent().unwrap_or(Path::new("")),
        };
        let description = description(folder, options)?;
        if let (true, None) = (is_folder, &description) {
            return Err(CaptureError::Missing {
                path: path.to_path_buf(),
                wanted: folder.join(paths::META),
            });
        }
        let mosaic = match (&description, is_folder) {
            (Some((_, camera)), true) => folder.join(match camera.raw.format {
                RawFormat::Png => "raw.png",
                RawFormat::Exr => "raw.exr",
            }),
            _ => path.to_path_buf(),
        };
        let layers = load::layers(&mosaic)?;
        let subpixels = subpixels(path, options, description.as_ref(), &layers)?;
        let mut white = 1.0;
        let (views, channels) = if let [layer] = layers.as_slice() {
            let mut image = layer.image.clone();
            let is_exr = (mosaic.extension()).is_some_and(|e| e.eq_ignore_ascii_case("exr"));
            if let (Some((file, camera)), false) = (&description, is_exr) {
                white = linearise(&mut image, &camera.raw, file)?;
            }
            (parted(&image, subpixels, &mosaic)?, layer.channels.clone())
        } else {
            views_of(&layers, subpixels, path)?
        };
        if let (Some((file, camera)), None) = (&description, options.subpixels) {
            same_size(&views, &mosaic, camera, file)?;
        }
        Ok(Self {
            views,
            channels,
            white,
            camera: description.map(|(_, camera)| camera),
        })
    }

    /// The left and right view of a camera of which nothing else is known; with `srgb`, the transfer function of the
    /// codes is undone.
    ///
    /// # Errors
    /// A file that is no picture, or two of unlike size.
    pub fn from_pair(left: &Path, right: &Path, srgb: bool) -> Result<Self, CaptureError> {
        let mut images = load::alike(&[left.to_path_buf(), right.to_path_buf()])?;
        if srgb {
            let values = images.iter_mut().flat_map(|image| image.data_mut());
            values.for_each(|v| *v = to_linear(*v));
        }
        let names: &[&str] = match images[0].channels() {
            3 => &["R", "G", "B"],
            _ => &["Y"],
        };
        let named = |error| CaptureError::Views {
            path: left.to_path_buf(),
            error,
        };
        Ok(Self {
            views: Views::new(Subpixels::DUAL_X, images).map_err(named)?,
            channels: names.iter().map(ToString::to_string).collect(),
            white: 1.0,
            camera: None,
        })
    }

    /// Columns and rows of a view, px.
    pub fn size_px(&self) -> [usize; 2] {
        // A set of views has at least one.
        let first = &self.views.images()[0];
        [first.width(), first.height()]
    }

    /// The channel that others are matched to: green, or the first where there is none.
    pub fn reference_channel(&self) -> usize {
        reference_channel(&self.channels)
    }

    /// Each view's channels with those of the sum of all views.
    pub fn views_and_sum(&self) -> Vec<ViewPair> {
        let Some(sum) = self.views.sum(Side::All) else {
            return Vec::new();
        };
        let mut pairs = Vec::new();
        for (index, view) in self.views.images().iter().enumerate() {
            for (c, name) in self.channels.iter().enumerate() {
                pairs.push(ViewPair {
                    name: format!("{}.{name}", self.views.subpixels().name(index)),
                    view: channel(view, c),
                    reference: channel(&sum, c),
                });
            }
        }
        pairs
    }
}

/// Index of green, or 0 where there is none.
pub fn reference_channel(channels: &[String]) -> usize {
    channels.iter().position(|c| c == "G").unwrap_or(0)
}

/// What describes the camera, with the file that says so.
type Description = (PathBuf, CameraDescription);

fn description(
    folder: &Path,
    options: &CaptureOptions,
) -> Result<Option<Description>, CameraError> {
    Ok(match (&options.camera, &options.meta) {
        (Some(path), _) => Some((path.clone(), camera::read_description(path)?)),
        (None, Some(path)) => Some((path.clone(), camera::read_meta(path)?)),
        (None, None) => camera::read_beside(folder)?,
    })
}

/// What the user says, else the description, else the names of the views.
fn subpixels(
    path: &Path,
    options: &CaptureOptions,
    description: Option<&Description>,
    layers: &[NamedLayer],
) -> Result<Subpixels, CaptureError> {
    if let Some(subpixels) = options.subpixels {
        return Ok(subpixels);
    }
    if let Some((_, camera)) = description {
        return Ok(camera.subpixels);
    }
    let names: Vec<&str> = layers.iter().map(|l| l.name.as_str()).collect();
    Subpixels::from_names(&names).ok_or_else(|| CaptureError::NoSubpixels {
        path: path.to_path_buf(),
    })
}

fn parted(mosaic: &Image, subpixels: Subpixels, path: &Path) -> Result<Views, CaptureError> {
    Views::from_mosaic(mosaic, subpixels).map_err(|error| CaptureError::Views {
        path: path.to_path_buf(),
        error,
    })
}

/// The views of an EXR with a layer each, and their channels.
fn views_of(
    layers: &[NamedLayer],
    subpixels: Subpixels,
    path: &Path,
) -> Result<(Views, Vec<String>), CaptureError> {
    let mut channels: Option<&Vec<String>> = None;
    let view = |index| {
        let (path, name) = (path.to_path_buf(), subpixels.name(index));
        let Some(layer) = layers.iter().find(|l| l.name == name) else {
            return Err(CaptureError::NoView { path, name });
        };
        if channels.get_or_insert(&layer.channels) != &&layer.channels {
            return Err(CaptureError::Channels { path, name });
        }
        Ok(layer.image.clone())
    };
    let images: Vec<Image> = (0..subpixels.count())
        .map(view)
        .collect::<Result<_, CaptureError>>()?;
    let views = Views::new(subpixels, images).map_err(|error| CaptureError::Views {
        path: path.to_path_buf(),
        error,
    })?;
    Ok((views, channels.cloned().unwrap_or_default()))
}

/// Turns parts of the full scale of 16 bits into linear values by the levels in `raw`; returns the linear value at
/// white. An EXR mosaic has no levels and is linear as it is.
fn linearise(mosaic: &mut Image, raw: &RawLevels, path: &Path) -> Result<f64, CaptureError> {
    let (Some(black), Some(white), Some(at_white)) =
        (raw.black_level, raw.white_level, raw.linear_at_white)
    else {
        return Ok(1.0);
    };
    if white <= black {
        return Err(CaptureError::Levels {
            path: path.to_path_buf(),
            white,
            black,
        });
    }
    let span = f64::from(white) - f64::from(black);
    for value in mosaic.data_mut() {
        *value = ((f64::from(*value) * 65535.0 - f64::from(black)) * at_white / span) as f32;
    }
    Ok(at_white)
}

fn same_size(
    views: &Views,
    mosaic: &Path,
    camera: &CameraDescription,
    description: &Path,
) -> Result<(), CaptureError> {
    let first = &views.images()[0];
    let found = [first.width(), first.height()];
    let expected = [camera.width_px, camera.height_px].map(|n| n as usize);
    if found != expected {
        return Err(CaptureError::Size {
            path: mosaic.to_path_buf(),
            found,
            description: description.to_path_buf(),
            expected,
        });
    }
    Ok(())
}
