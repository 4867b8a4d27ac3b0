//! What the user says of a capture, of kinds of files and of an alignment, as flags; and what a bad input is called.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::exit::CommandError;
use crate::number::number;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel::image::Image;
use quadpixel_algorithms::calibrated_camera::CalibratedCamera;
use quadpixel_algorithms::calibration::{Align, Calibration};
use quadpixel_algorithms::capture::{Capture, CaptureError, CaptureOptions};
use quadpixel_algorithms::maps::MapFormat;
use quadpixel_algorithms::pictures::PictureFormat;
use quadpixel_algorithms::view_pair::{PairOptions, read_pair};

/// What the user says; what is absent is taken from the files beside the capture.
#[derive(Clone, Debug, Default, Args)]
pub struct CaptureArgs {
    /// Sub-pixels of a pixel, COLUMNSxROWS; absent: as the camera's description says, or as the layers of an EXR of
    /// views are named.
    #[arg(long)]
    subpixels: Option<String>,
    /// Description of the camera (a sample's camera.json): levels of an integer mosaic (so that linear values come
    /// out), sub-pixels, lens and focus; absent: the camera.json beside the capture, or what its meta.json says of the
    /// camera.
    #[arg(long)]
    camera: Option<PathBuf>,
    /// A meta.json in place of a description: what it says of the camera is read, and nothing else of it.
    #[arg(long, conflicts_with = "camera")]
    meta: Option<PathBuf>,
}

impl CaptureArgs {
    /// With a description of the camera only.
    pub fn with_camera(camera: Option<&PathBuf>) -> Self {
        Self {
            camera: camera.cloned(),
            ..Self::default()
        }
    }

    /// Nothing was said.
    pub fn is_empty(&self) -> bool {
        self.subpixels.is_none() && self.camera.is_none() && self.meta.is_none()
    }

    /// Reads the capture at `path`.
    pub fn read(&self, path: &Path) -> Result<Capture, CommandError> {
        let subpixels = (self.subpixels.as_ref())
            .map(|text| text.parse())
            .transpose();
        let subpixels =
            subpixels.map_err(|e| CommandError::input(format!("{}: --{e}", path.display())))?;
        let options = CaptureOptions {
            subpixels,
            camera: self.camera.clone(),
            meta: self.meta.clone(),
        };
        Capture::read(path, &options).map_err(|error| match error {
            CaptureError::NoSubpixels { path } => CommandError::input(format!(
                "{}: no camera.json or meta.json lies beside it: --subpixels is needed, such as 2x2",
                path.display()
            )),
            error => CommandError::input(error),
        })
    }
}

/// What the user says of two views of a camera without description.
#[derive(Clone, Debug, Default, Args)]
pub struct PairArgs {
    /// The views are pictures in sRGB: its transfer function is undone.
    #[arg(long)]
    srgb: bool,
    /// Code of black in the two views, of 65535 (8-bit files: times 257); it is taken off.
    #[arg(value_parser = number, long, value_name = "CODE", default_value_t = 0.0)]
    black_level: f64,
    /// The two views of a uniform white sheet, of the same camera, size and kind of file: LEFT,RIGHT.
    #[arg(long, value_name = "LEFT,RIGHT", value_delimiter = ',')]
    white_sheet: Vec<PathBuf>,
    /// Uses the middle of the views only: COLUMNSxROWS, px.
    #[arg(long, value_name = "SIZE")]
    crop: Option<String>,
}

impl PairArgs {
    /// Nothing was said.
    pub fn is_empty(&self) -> bool {
        !self.srgb && self.black_level == 0.0 && self.white_sheet.is_empty() && self.crop.is_none()
    }

    /// Reads both views.
    pub fn read(&self, left: &Path, right: &Path) -> Result<[Image; 2], CommandError> {
        let white_sheet = match self.white_sheet.as_slice() {
            [] => None,
            [left, right] => Some([left.clone(), right.clone()]),
            files => {
                return Err(CommandError::input(format!(
                    "--white-sheet: {} file(s); allowed are two, LEFT,RIGHT",
                    files.len()
                )));
            }
        };
        if !(0.0..65535.0).contains(&self.black_level) {
            return Err(CommandError::input(format!(
                "--black-level is {}; allowed: 0 to below 65535",
                self.black_level
            )));
        }
        let crop_px = self.crop.as_ref().map(|text| crop(text)).transpose()?;
        let options = PairOptions {
            black: self.black_level / 65535.0,
            is_srgb: self.srgb,
            white_sheet,
            crop_px,
        };
        read_pair(left, right, &options).map_err(CommandError::input)
    }
}

fn crop(text: &str) -> Result<[usize; 2], CommandError> {
    let sides = text.split_once('x');
    let parsed = sides.and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    parsed.ok_or_else(|| {
        CommandError::input(format!(
            "--crop {text}: allowed is COLUMNSxROWS, such as 1344x1008"
        ))
    })
}

/// The camera of the capture at `path`, as calibrations name it.
pub fn calibrated_camera(
    capture: &Capture,
    pitch_um: Option<f64>,
    path: &Path,
) -> Result<CalibratedCamera, CommandError> {
    CalibratedCamera::from_capture(capture, pitch_um).map_err(|_| {
        let path = path.display();
        CommandError::input(format!(
            "{path}: no camera.json or meta.json lies beside it: --pitch-um above 0 is needed"
        ))
    })
}

/// The folder of a sample in which truth may lie, where the camera of the capture at `path` is described.
pub fn sample_folder(path: &Path, capture: &Capture) -> Option<PathBuf> {
    capture.camera.as_ref()?;
    Some(match path.is_dir() {
        true => path.to_path_buf(),
        false => path.parent().unwrap_or(Path::new("")).to_path_buf(),
    })
}

/// Reads a calibration file.
pub fn read_calibration(path: &Path) -> Result<Calibration, CommandError> {
    let bytes = file::read(path).map_err(CommandError::input)?;
    Calibration::from_json(&bytes).map_err(in_file(path))
}

/// An input error said to be in `path`.
pub fn in_file<E: Display>(path: &Path) -> impl Fn(E) -> CommandError {
    move |error| CommandError::input(format!("{}: {error}", path.display()))
}

/// `--format` of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MapFormatArg {
    /// OpenEXR, 32-bit float: one layer per map, named channels.
    Exr,
    /// NumPy: f32 of shape (maps, rows, columns, channels); axes of a single unnamed map and of a single channel are
    /// left out.
    Npy,
    /// Portable float map: one file per map, its one channel as gray or its first three as red, green, blue.
    Pfm,
}

impl From<MapFormatArg> for MapFormat {
    fn from(arg: MapFormatArg) -> Self {
        match arg {
            MapFormatArg::Exr => Self::Exr,
            MapFormatArg::Npy => Self::Npy,
            MapFormatArg::Pfm => Self::Pfm,
        }
    }
}

/// `--format` of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PictureFormatArg {
    /// OpenEXR, 32-bit float: linear, nothing clipped, the sums are sums.
    Exr,
    /// PNG, 16 bits (1 or 3 channels): 65535 is the mosaic's white in a view, and in a sum that times the views in it.
    Png,
}

impl From<PictureFormatArg> for PictureFormat {
    fn from(arg: PictureFormatArg) -> Self {
        match arg {
            PictureFormatArg::Exr => Self::Exr,
            PictureFormatArg::Png => Self::Png,
        }
    }
}

/// `--align`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum AlignArg {
    /// Centroids of the spots: the disparity as datasets define it, whatever the chart.
    Centroid,
    /// The chart's texture, by block matching: sharpest at that chart's frequencies.
    Texture,
}

impl From<AlignArg> for Align {
    fn from(arg: AlignArg) -> Self {
        match arg {
            AlignArg::Centroid => Self::Centroid,
            AlignArg::Texture => Self::Texture,
        }
    }
}
