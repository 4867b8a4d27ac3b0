//! The files of a sample: one list for writers, readers and the checker.

use crate::camera::{Channel, Sensor};
use crate::camera_description::RawFormat;
use crate::sample::{FileKind, SampleFile, Storage};

/// Name of the views' layer that holds the sum of all sub-pixels.
pub const SUM_LAYER: &str = "sum";

/// Channels per layer of `shifts.exr` where the colour channels differ: red and blue, each from green.
pub const COLOUR_SHIFTS: [&str; 4] = ["R.dx", "R.dy", "B.dx", "B.dy"];

/// Whether a file of this name may be in a sample.
pub fn is_sample_file(name: &str) -> bool {
    let formats = [RawFormat::Png, RawFormat::Exr];
    let is_picture = |kind: &FileKind| formats.iter().any(|raw| kind.file_name(*raw) == name);
    [crate::paths::META, crate::paths::CAMERA].contains(&name)
        || FileKind::ALL.iter().any(is_picture)
}

impl FileKind {
    /// All kinds.
    pub const ALL: [Self; 22] = [
        Self::Raw,
        Self::Views,
        Self::Target,
        Self::Depth,
        Self::Distance,
        Self::Disparity,
        Self::Coc,
        Self::Shifts,
        Self::Occlusion,
        Self::Objects,
        Self::Normal,
        Self::Valid,
        Self::Preview,
        Self::Noisy,
        Self::NoisyViews,
        Self::Shading,
        Self::Mosaic,
        Self::NoisyMosaic,
        Self::CameraJpeg,
        Self::CameraViewsJpeg,
        Self::CameraPng,
        Self::CameraViewsPng,
    ];

    /// The files of camera-like pictures, JPEGs or PNGs: the sum, and the views side by side.
    pub fn camera_pictures(jpeg: bool) -> (Self, Self) {
        match jpeg {
            true => (Self::CameraJpeg, Self::CameraViewsJpeg),
            false => (Self::CameraPng, Self::CameraViewsPng),
        }
    }

    /// The file's name.
    pub fn file_name(self, raw: RawFormat) -> &'static str {
        match (self, raw) {
            (FileKind::Raw, RawFormat::Png) => "raw.png",
            (FileKind::Raw, RawFormat::Exr) => "raw.exr",
            (FileKind::Views, _) => "views.exr",
            (FileKind::Target, _) => "target.exr",
            (FileKind::Depth, _) => "depth.exr",
            (FileKind::Distance, _) => "distance.exr",
            (FileKind::Disparity, _) => "disparity.exr",
            (FileKind::Coc, _) => "coc.exr",
            (FileKind::Shifts, _) => "shifts.exr",
            (FileKind::Occlusion, _) => "occlusion.png",
            (FileKind::Objects, _) => "objects.png",
            (FileKind::Normal, _) => "normal.exr",
            (FileKind::Valid, _) => "valid.png",
            (FileKind::Preview, _) => crate::paths::PREVIEW,
            (FileKind::Noisy, _) => "noisy.png",
            (FileKind::NoisyViews, _) => "noisy_views.exr",
            (FileKind::Shading, _) => "shading.exr",
            (FileKind::Mosaic, _) => "mosaic.png",
            (FileKind::NoisyMosaic, _) => "noisy_mosaic.png",
            (FileKind::CameraJpeg, _) => "camera.jpg",
            (FileKind::CameraViewsJpeg, _) => "camera_views.jpg",
            (FileKind::CameraPng, _) => "camera.png",
            (FileKind::CameraViewsPng, _) => "camera_views.png",
        }
    }
}

/// Files that not every sample has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Optional {
    /// Shifts of the colour channels.
    pub channels_differ: bool,
    /// Objects and normals of a world of meshes.
    pub world: bool,
    /// A readout: the noisy capture, its views and the shading.
    pub noisy: bool,
    /// The colour-filter mosaic, and with a readout the noisy one.
    pub mosaic: bool,
    /// Camera-like pictures: of the sum, and of the views side by side.
    pub camera: Option<(FileKind, FileKind)>,
    /// Light above what half precision holds (65504): raw, views and target are stored as 32-bit floats.
    pub bright: bool,
}

/// The files of a sample in the order of their names, each with size, channels and number format. `preview` is the
/// contact sheet's width and height; `optional` says which of the files are there that not every sample has.
pub fn sample_files(
    sensor: &Sensor,
    colours: &[Channel],
    raw: RawFormat,
    optional: Optional,
    preview: [u32; 2],
) -> Vec<SampleFile> {
    use FileKind as K;
    let (width, height) = (sensor.width_px, sensor.height_px);
    let colours: Vec<&str> = colours
        .iter()
        .map(|channel| channel.name.as_str())
        .collect();
    let names = sensor.subpixels.names();
    let layers = |layers: &[String], channels: &[&str]| {
        let of_layer = |layer: &String| {
            let full: Vec<String> = channels.iter().map(|c| format!("{layer}.{c}")).collect();
            full
        };
        let mut all: Vec<String> = layers.iter().flat_map(of_layer).collect();
        all.sort();
        all
    };
    let mut with_sum = names.clone();
    with_sum.push(SUM_LAYER.to_string());
    let truth = ["dx", "dy", "paraxial_dx", "paraxial_dy"];
    let shifts = shift_channels(&names, optional.channels_differ);
    let sheet = ["R", "G", "B"];
    let raw_storage = match raw {
        RawFormat::Png => Storage::Uint16,
        RawFormat::Exr if optional.bright => Storage::Float,
        RawFormat::Exr => Storage::Half,
    };
    let light = match optional.bright {
        true => Storage::Float,
        false => Storage::Half,
    };
    let mosaic = [
        width.saturating_mul(sensor.subpixels.m() as u32),
        height.saturating_mul(sensor.subpixels.n() as u32),
    ];
    let (half, float, byte) = (Storage::Half, Storage::Float, Storage::Uint8);
    let size = [width, height];
    let mut rows = vec![
        (K::Raw, mosaic, layers_of_none(&colours), raw_storage),
        (K::Views, size, layers(&with_sum, &colours), light),
        (K::Target, size, layers_of_none(&colours), light),
        (K::Depth, size, layers_of_none(&["Z"]), float),
        (K::Distance, size, layers_of_none(&["distance"]), float),
        (K::Disparity, size, layers(&names, &truth), float),
        (K::Coc, size, layers_of_none(&["coc"]), float),
        (K::Shifts, size, shifts, half),
        (K::Occlusion, size, layers_of_none(&["Y"]), byte),
        (K::Valid, size, layers_of_none(&["Y"]), byte),
        (K::Preview, preview, layers_of_none(&sheet), byte),
    ];
    if optional.world {
        rows.push((K::Objects, size, layers_of_none(&["Y"]), Storage::Uint16));
        rows.push((K::Normal, size, layers_of_none(&["X", "Y", "Z"]), float));
    }
    if optional.noisy {
        rows.extend([
            (K::Noisy, mosaic, layers_of_none(&colours), Storage::Uint16),
            (K::NoisyViews, size, layers(&with_sum, &colours), light),
            (K::Shading, size, layers(&names, &colours), half),
        ]);
    }
    if optional.mosaic {
        rows.push((K::Mosaic, mosaic, layers_of_none(&["Y"]), Storage::Uint16));
        if optional.noisy {
            rows.push((
                K::NoisyMosaic,
                mosaic,
                layers_of_none(&["Y"]),
                Storage::Uint16,
            ));
        }
    }
    if let Some((sum, views)) = optional.camera {
        rows.push((sum, size, layers_of_none(&sheet), byte));
        rows.push((views, mosaic, layers_of_none(&sheet), byte));
    }
    let file = |(kind, [width, height], channels, storage): (K, [u32; 2], _, _)| SampleFile {
        name: kind.file_name(raw).to_string(),
        kind,
        width,
        height,
        channels,
        storage,
    };
    let mut files: Vec<SampleFile> = rows.into_iter().map(file).collect();
    files.sort_by(|a, b| a.name.cmp(&b.name));
    files
}

/// Channels of `shifts.exr`, sorted: `sum.dx` and `sum.dy`, and where the colour channels differ `R.dx` to `B.dy` of
/// the sum and of each sub-pixel.
fn shift_channels(subpixels: &[String], channels_differ: bool) -> Vec<String> {
    let mut all = vec![format!("{SUM_LAYER}.dx"), format!("{SUM_LAYER}.dy")];
    if channels_differ {
        for layer in subpixels.iter().map(String::as_str).chain([SUM_LAYER]) {
            all.extend(COLOUR_SHIFTS.map(|channel| format!("{layer}.{channel}")));
        }
    }
    all.sort();
    all
}

fn layers_of_none(names: &[&str]) -> Vec<String> {
    let mut sorted: Vec<String> = names.iter().map(ToString::to_string).collect();
    sorted.sort();
    sorted
}
