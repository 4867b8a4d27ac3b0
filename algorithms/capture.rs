//! A capture: the views of one exposure, with what is known of the camera that made it.
//!
//! It comes from a sample's folder (its raw mosaic and `meta.json`), from a mosaic, or from an EXR with one layer per view. Of
//! `meta.json` only what a real camera knows of itself is read: pitch, sub-pixels, place on the sensor, levels.

use std::path::{Path, PathBuf};

use quadpixel::command::CommandError;
use quadpixel::file;
use quadpixel::image::Image;
use quadpixel::image::exr::NamedLayer;
use quadpixel::image::srgb::to_linear;
use quadpixel_datasets::{Raw as RawMosaic, RawFormat, SampleMeta};

use crate::load;
use crate::sai::{Partition, Views};

/// What a calibration must have in common with the captures that it is for.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Distance of the microlenses, µm; 0: not known.
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

/// What was read of one exposure.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// The views.
    pub views: Views,
    /// Names of the colour channels, in order.
    pub channels: Vec<String>,
    /// Linear value of a full code of the mosaic: 1 unless `meta.json` says otherwise.
    pub white: f64,
    /// The sample's folder, where it is one.
    pub sample: Option<PathBuf>,
    /// What `meta.json` says.
    pub meta: Option<SampleMeta>,
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

/// What the user says; what is absent is taken from the `meta.json` beside the file.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Given {
    /// Sub-pixels of a pixel, COLUMNSxROWS; absent: as in meta.json, or as the layers of an EXR of views are named.
    #[arg(long)]
    pub subpixels: Option<String>,
    /// A meta.json: levels of an integer mosaic (so that linear values come out), sub-pixels; absent: the one beside the file.
    #[arg(long)]
    pub meta: Option<PathBuf>,
}

impl Camera {
    /// Says in what `other` differs, first difference only; `None` where they are one camera.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differs = |what: &str, a: String, b: String| Some(format!("{what} {a} instead of {b}"));
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

impl Exposure {
    /// Reads `path`: a sample's folder, a mosaic, or an EXR with one layer per view.
    pub fn read(path: &Path, given: &Given) -> Result<Self, CommandError> {
        let named = |text: String| CommandError::input(format!("{}: {text}", path.display()));
        let is_folder = path.is_dir();
        let folder = if is_folder {
            path.to_path_buf()
        } else {
            path.parent().unwrap_or(Path::new("")).to_path_buf()
        };
        let beside = folder.join("meta.json");
        let meta_path =
            (given.meta.clone()).or_else(|| (is_folder || beside.is_file()).then_some(beside));
        if let (true, Some(wanted)) = (is_folder, meta_path.as_ref().filter(|p| !p.is_file())) {
            return Err(named(format!(
                "{} is missing: allowed is a sample's folder, such as DATASET/samples/000000",
                wanted.display()
            )));
        }
        let meta = meta_path.as_deref().map(read_meta).transpose()?;
        let mosaic = match (&meta, is_folder) {
            (Some(meta), true) => folder.join(match meta.raw.format {
                RawFormat::Png => "raw.png",
                RawFormat::Exr => "raw.exr",
            }),
            _ => path.to_path_buf(),
        };
        let layers = load::layers(&mosaic)?;
        let partition = partition(given, meta.as_ref(), &layers).map_err(named)?;
        let mut white = 1.0;
        let (views, channels) = if let [mosaic_layer] = layers.as_slice() {
            let mut image = mosaic_layer.image.clone();
            let is_exr = (mosaic.extension()).is_some_and(|e| e.eq_ignore_ascii_case("exr"));
            if let (Some(meta), Some(meta_path), false) = (&meta, &meta_path, is_exr) {
                white = linearise(&mut image, &meta.raw)
                    .map_err(|e| CommandError::input(format!("{}: {e}", meta_path.display())))?;
            }
            let views = Views::of_mosaic(&image, partition)
                .map_err(|e| CommandError::input(format!("{}: {e}", mosaic.display())))?;
            (views, mosaic_layer.channels.clone())
        } else {
            views_of(&layers, partition).map_err(named)?
        };
        if let (Some(meta), Some(meta_path), None) = (&meta, &meta_path, &given.subpixels) {
            let first = &views.images()[0];
            let found = [first.width(), first.height()];
            let [width, height] = [meta.sensor.width_px, meta.sensor.height_px].map(|n| n as usize);
            if found != [width, height] {
                return Err(CommandError::input(format!(
                    "{}: views of {} × {} pixels where {} says {width} × {height}",
                    mosaic.display(),
                    found[0],
                    found[1],
                    meta_path.display()
                )));
            }
        }
        Ok(Self {
            views,
            channels,
            white,
            sample: meta.is_some().then_some(folder),
            meta,
        })
    }
}

impl Capture {
    /// The left and right view of a camera of which nothing else is known; with `srgb`, the transfer function of the codes is undone.
    pub fn of_pair(left: &Path, right: &Path, srgb: bool) -> Result<Self, CommandError> {
        let mut images = load::alike(&[left.to_path_buf(), right.to_path_buf()])?;
        if srgb {
            let values = images.iter_mut().flat_map(|image| image.data_mut());
            values.for_each(|v| *v = to_linear(*v));
        }
        let named = |e: String| CommandError::input(format!("{}: {e}", left.display()));
        let partition = Partition::new(2, 1).map_err(|e| named(e.to_string()))?;
        let names: &[&str] = match images[0].channels() {
            3 => &["R", "G", "B"],
            _ => &["Y"],
        };
        let camera = Camera {
            pitch_um: 0.0,
            subpixels: partition.to_string(),
            width_px: images[0].width(),
            height_px: images[0].height(),
            channels: names.iter().map(ToString::to_string).collect(),
            centre_mm: None,
        };
        let views = Views::new(partition, images).map_err(|e| named(e.to_string()))?;
        Ok(Self {
            views,
            camera,
            white: 1.0,
            sample: None,
            meta: None,
        })
    }

    /// Reads as [`Exposure::read`] does, and makes the camera of it; `pitch_um` is needed where no `meta.json` says it.
    pub fn read(path: &Path, given: &Given, pitch_um: Option<f64>) -> Result<Self, CommandError> {
        let read = Exposure::read(path, given)?;
        let pitch_um = (pitch_um.or(read.meta.as_ref().map(|m| m.sensor.pitch_um)))
            .filter(|p| p.is_finite() && *p > 0.0)
            .ok_or_else(|| {
                let path = path.display();
                CommandError::input(format!(
                    "{path}: no meta.json lies beside it: --pitch-um above 0 is needed"
                ))
            })?;
        let camera = Camera {
            pitch_um,
            subpixels: read.views.partition().to_string(),
            width_px: read.views.images()[0].width(),
            height_px: read.views.images()[0].height(),
            channels: read.channels,
            centre_mm: read.meta.as_ref().map(|m| m.sensor.centre_mm),
        };
        Ok(Self {
            views: read.views,
            camera,
            white: read.white,
            sample: read.sample,
            meta: read.meta,
        })
    }
}

/// What the user says, else `meta.json`, else the names of the views.
fn partition(
    given: &Given,
    meta: Option<&SampleMeta>,
    layers: &[NamedLayer],
) -> Result<Partition, String> {
    if let Some(text) = &given.subpixels {
        return text.parse().map_err(|e| format!("--{e}"));
    }
    if let Some(meta) = meta {
        let counts = &meta.sensor.subpixels;
        return Partition::new(counts.columns as usize, counts.rows as usize)
            .map_err(|e| e.to_string());
    }
    let names: Vec<&str> = layers.iter().map(|l| l.name.as_str()).collect();
    Partition::of_names(&names)
        .ok_or_else(|| "no meta.json lies beside it: --subpixels is needed, such as 2x2".to_owned())
}

/// The views of an EXR with a layer each, and their channels.
fn views_of(layers: &[NamedLayer], partition: Partition) -> Result<(Views, Vec<String>), String> {
    let mut channels: Option<&Vec<String>> = None;
    let view = |index| {
        let name = partition.name(index);
        let layer = layers.iter().find(|l| l.name == name);
        let layer = layer.ok_or_else(|| format!("it has no view {name}"))?;
        if channels.get_or_insert(&layer.channels) != &&layer.channels {
            return Err(format!("view {name} has other channels"));
        }
        Ok(layer.image.clone())
    };
    let images: Vec<Image> = (0..partition.count())
        .map(view)
        .collect::<Result<_, String>>()?;
    let views = Views::new(partition, images).map_err(|e| e.to_string())?;
    Ok((views, channels.cloned().unwrap_or_default()))
}

/// Turns parts of the full scale of 16 bits into linear values by the levels in `raw`; returns the linear value at white. An EXR
/// mosaic has no levels and is linear as it is.
fn linearise(mosaic: &mut Image, raw: &RawMosaic) -> Result<f64, String> {
    let (Some(black), Some(white), Some(at_white)) =
        (raw.black_level, raw.white_level, raw.linear_at_white)
    else {
        return Ok(1.0);
    };
    if white <= black {
        return Err(format!(
            "raw: white_level {white} must be above black_level {black}"
        ));
    }
    let span = f64::from(white) - f64::from(black);
    for value in mosaic.data_mut() {
        *value = ((f64::from(*value) * 65535.0 - f64::from(black)) * at_white / span) as f32;
    }
    Ok(at_white)
}

fn read_meta(path: &Path) -> Result<SampleMeta, CommandError> {
    let bytes = file::read(path).map_err(CommandError::input)?;
    serde_json::from_slice(&bytes)
        .map_err(|e| CommandError::input(format!("{}: {e}", path.display())))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn cameras_differ_in_pitch_sub_pixels_size_channels_and_place_on_the_sensor() {
        let camera = Camera {
            pitch_um: 2.8,
            subpixels: "2x2".to_owned(),
            width_px: 40,
            height_px: 30,
            channels: vec!["R".to_owned(), "G".to_owned(), "B".to_owned()],
            centre_mm: Some([0.5, -1.0]),
        };
        let changed = |change: fn(&mut Camera)| {
            let mut other = camera.clone();
            change(&mut other);
            camera.difference(&other)
        };
        assert_eq!(changed(|_| ()), None);
        for (change, wanted) in [
            (
                (|c| c.pitch_um = 1.6) as fn(&mut Camera),
                "pitch_um 2.8 instead of 1.6",
            ),
            (
                |c| c.subpixels = "2x1".to_owned(),
                "subpixels 2x2 instead of 2x1",
            ),
            (|c| c.height_px = 40, "size 40x30 instead of 40x40"),
            (
                |c| c.channels = vec!["Y".to_owned()],
                "channels R G B instead of Y",
            ),
            (
                |c| c.centre_mm = Some([0.5, 1.0]),
                "centre_mm [0.5, -1.0] instead of [0.5, 1.0]",
            ),
        ] {
            assert_eq!(changed(change).unwrap(), wanted);
        }
        // A place that is not known is not compared.
        assert_eq!(changed(|c| c.centre_mm = None), None);
        assert_eq!(camera.reference_channel(), 1);
    }
}
