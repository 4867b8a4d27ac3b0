//! A capture: the views of one exposure, with what is known of the camera that made it.
//!
//! It comes from a sample's folder (its raw mosaic and `meta.json`), from a mosaic, or from an EXR with a layer a view. Of
//! `meta.json` only what a real camera knows of itself is read: pitch, sub-pixels, place on the sensor, levels.

use std::path::{Path, PathBuf};

use datasets_spec::{RawFormat, SampleMeta};
use quadpixel::file;

use crate::error::CommandError;
use crate::load;
use crate::sai::{Partition, Views};
use crate::sai_command::linearise;

/// What a calibration must have in common with the captures that it is for.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Distance of the microlenses, µm.
    pub pitch_um: f64,
    /// Sub-pixels, `COLUMNSxROWS`.
    pub subpixels: String,
    /// Columns of a view.
    pub width_px: usize,
    /// Rows of a view.
    pub height_px: usize,
    /// Names of the colour channels, in order.
    pub channels: Vec<String>,
    /// Middle of the window on the sensor, mm; absent: not known, and not compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<[f64; 2]>,
}

/// Views with their camera.
#[derive(Clone, Debug)]
pub struct Capture {
    /// The views.
    pub views: Views,
    /// Their camera.
    pub camera: Camera,
    /// Linear value of a full code of the mosaic: 1 unless `meta.json` says otherwise.
    pub white: f64,
    /// The sample's folder, where it is one.
    pub sample: Option<PathBuf>,
    /// What `meta.json` says.
    pub meta: Option<SampleMeta>,
}

/// What the user says where no `meta.json` lies beside the file.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// `--subpixels`.
    pub subpixels: Option<String>,
    /// `--pitch-um`.
    pub pitch_um: Option<f64>,
}

impl Camera {
    /// Says in what `other` differs, first difference only; `None` where they are one camera.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differs = |what: &str, a: String, b: String| Some(format!("{what} {a} where {b} is"));
        if (self.pitch_um - other.pitch_um).abs() > 1e-9 * self.pitch_um.abs() {
            return differs(
                "pitch_um",
                self.pitch_um.to_string(),
                other.pitch_um.to_string(),
            );
        }
        if self.subpixels != other.subpixels {
            return differs("subpixels", self.subpixels.clone(), other.subpixels.clone());
        }
        if (self.width_px, self.height_px) != (other.width_px, other.height_px) {
            let size = |c: &Self| format!("{}x{}", c.width_px, c.height_px);
            return differs("size", size(self), size(other));
        }
        if self.channels != other.channels {
            return differs(
                "channels",
                self.channels.join(" "),
                other.channels.join(" "),
            );
        }
        match (self.centre_mm, other.centre_mm) {
            (Some(a), Some(b)) if (a[0] - b[0]).hypot(a[1] - b[1]) > 1e-6 => {
                differs("centre_mm", format!("{a:?}"), format!("{b:?}"))
            }
            _ => None,
        }
    }

    /// The channel that others are matched to: green, or the first where there is none.
    pub fn reference_channel(&self) -> usize {
        self.channels.iter().position(|c| c == "G").unwrap_or(0)
    }
}

impl Capture {
    /// Reads `path`: a sample's folder, a mosaic, or an EXR with a layer a view.
    pub fn read(path: &Path, given: &Given) -> Result<Self, CommandError> {
        let input = |text: String| CommandError::input(text);
        let named = |text: String| input(format!("{}: {text}", path.display()));
        let folder = if path.is_dir() {
            path.to_path_buf()
        } else {
            path.parent().unwrap_or(Path::new("")).to_path_buf()
        };
        let meta_path = folder.join("meta.json");
        let meta = if path.is_dir() || meta_path.is_file() {
            Some(read_meta(&meta_path)?)
        } else {
            None
        };
        let of_meta = meta
            .as_ref()
            .map(|m| format!("{}x{}", m.sensor.subpixels.columns, m.sensor.subpixels.rows));
        let subpixels = given.subpixels.clone().or(of_meta).ok_or_else(|| {
            named("no meta.json lies beside it: --subpixels is needed, such as 2x2".to_owned())
        })?;
        let partition: Partition = (subpixels.parse()).map_err(|e| named(format!("{e}")))?;
        let pitch_um = (given.pitch_um.or(meta.as_ref().map(|m| m.sensor.pitch_um)))
            .filter(|p| p.is_finite() && *p > 0.0)
            .ok_or_else(|| {
                named("no meta.json lies beside it: --pitch-um above 0 is needed".to_owned())
            })?;
        let mosaic = match (&meta, path.is_dir()) {
            (Some(meta), true) => folder.join(match meta.raw.format {
                RawFormat::Png => "raw.png",
                RawFormat::Exr => "raw.exr",
            }),
            _ => path.to_path_buf(),
        };
        let is_png = mosaic.extension().is_some_and(|e| e == "png");
        let mut white = 1.0;
        let layers = load::layers(&mosaic)?;
        let first = (layers.first())
            .ok_or_else(|| input(format!("{}: it holds no layer", mosaic.display())))?;
        let channels = first.channels.clone();
        let views = if layers.len() == 1 {
            let mut image = first.image.clone();
            if meta.is_some() && is_png {
                linearise(&mut image, &meta_path)?;
                white = (meta.as_ref())
                    .and_then(|m| m.raw.linear_at_white)
                    .unwrap_or(1.0);
            }
            Views::of_mosaic(&image, partition)
                .map_err(|e| input(format!("{}: {e}", mosaic.display())))?
        } else {
            let view = |index| {
                let name = partition.name(index);
                let layer = layers.iter().find(|l| l.name == name);
                let layer = layer.ok_or_else(|| named(format!("it has no view {name}")))?;
                if layer.channels != channels {
                    return Err(named(format!("view {name} has other channels")));
                }
                Ok(layer.image.clone())
            };
            let images = (0..partition.count())
                .map(view)
                .collect::<Result<_, CommandError>>()?;
            Views::new(partition, images).map_err(|e| named(format!("{e}")))?
        };
        let camera = Camera {
            pitch_um,
            subpixels: partition.to_string(),
            width_px: views.images()[0].width(),
            height_px: views.images()[0].height(),
            channels,
            centre_mm: meta.as_ref().map(|m| m.sensor.centre_mm),
        };
        Ok(Self {
            views,
            camera,
            white,
            sample: meta.as_ref().map(|_| folder),
            meta,
        })
    }
}

fn read_meta(path: &Path) -> Result<SampleMeta, CommandError> {
    let bytes = file::read(path).map_err(|e| CommandError::input(e.to_string()))?;
    serde_json::from_slice(&bytes)
        .map_err(|e| CommandError::input(format!("{}: {e}", path.display())))
}
