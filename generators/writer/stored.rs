//! One file of a sample in the making.
//!
//! Packing was chosen by measurement (256 × 256 pixels, one core): half images by PIZ (2.0 → 1.4 MB in 24 ms; ZIP 48
//! ms), float maps by ZIP (4.2 → 0.4 to 2.5 MB in 21 to 96 ms; PIZ 1.5 to 2.8 MB in 23 to 96 ms). Disparities are
//! rounded before (768 × 512: with all digits 19 MB in 0.57 s, to 2⁻¹⁴ px 3.6 MB in 0.20 s; other pictures 5.3 MB, to
//! 2⁻¹² px, as now, 3.7 MB).

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError};
use quadpixel::image::exr::{Compression, ExrRows, LayerShape, Sample};
use quadpixel::image::raster::{self, Levels};
use quadpixel::image::{Image, PngRows, PngShape};
use quadpixel_datasets::{COLOUR_SHIFTS, FileEntry, FileKind, SUM_LAYER, SampleFile, Storage};

use super::camera_pictures::CameraCodes;
use super::error::WriteError;
use super::files::RawEncoding;
use super::rows::Rows;
use super::sound::input;
use crate::describe::Description;
use crate::preview;

const DISPARITY_CHANNELS: [&str; 4] = ["dx", "dy", "paraxial_dx", "paraxial_dy"];
const PREVIEW_QUALITY: u8 = 90;

/// A file of a sample in the making.
pub(super) struct Stored {
    file: SampleFile,
    /// Where it is written.
    path: PathBuf,
    content: Content,
    /// Values that were clipped.
    pub clipped: u64,
}

enum Content {
    Exr(Box<ExrRows>),
    /// The file beside its writer, to wait for the disk.
    Png(Box<PngRows<File>>, File),
    Camera(CameraCodes),
    /// A contact sheet, which is drawn at the end.
    Sheet,
}

impl Stored {
    /// Begins a file in a folder.
    pub fn new(file: &SampleFile, folder: &Path, given: &Description) -> Result<Self, WriteError> {
        let path = folder.join(&file.name);
        let (width, height) = (file.width as usize, file.height as usize);
        let subpixels = given.sensor.subpixels;
        let content = match (file.kind, file.storage) {
            (FileKind::Preview, _) => Content::Sheet,
            (FileKind::CameraJpeg | FileKind::CameraPng, _) => {
                Content::Camera(CameraCodes::new([1, 1], [width, height]))
            }
            (FileKind::CameraViewsJpeg | FileKind::CameraViewsPng, _) => {
                let grid = [subpixels.m(), subpixels.n()];
                let tile = [width / grid[0], height / grid[1]];
                Content::Camera(CameraCodes::new(grid, tile))
            }
            (_, Storage::Half | Storage::Float) => {
                let compression = match file.kind {
                    FileKind::Raw
                    | FileKind::Views
                    | FileKind::NoisyViews
                    | FileKind::Shading
                    | FileKind::Target => Compression::Piz,
                    _ => Compression::Zip,
                };
                let layers = layers(file, given);
                let size = (width, height);
                Content::Exr(Box::new(ExrRows::new(
                    &path,
                    folder,
                    size,
                    layers,
                    compression,
                )?))
            }
            (_, Storage::Uint8 | Storage::Uint16) => {
                let shape = PngShape {
                    width,
                    height,
                    channels: file.channels.len(),
                    bits: if file.storage == Storage::Uint8 {
                        8
                    } else {
                        16
                    },
                };
                let failed = |cause| FileError::new(&path, "write", cause);
                let opened = File::create_new(&path).map_err(failed)?;
                let beside = opened.try_clone().map_err(failed)?;
                let png = PngRows::new(&path, opened, shape)?;
                Content::Png(Box::new(png), beside)
            }
        };
        Ok(Self {
            file: file.clone(),
            path,
            content,
            clipped: 0,
        })
    }

    /// Goes on with some rows.
    pub fn add(&mut self, rows: &Rows<'_>) -> Result<(), WriteError> {
        let (kind, sample) = (self.file.kind, rows.sample);
        let absent = |what: &str| input(&self.file.name, what);
        match &mut self.content {
            Content::Exr(exr) => {
                let images = images(kind, rows).ok_or_else(|| absent("is not there"))?;
                exr.rows(&images)?;
            }
            Content::Png(png, _) => match kind {
                FileKind::Valid => {
                    let codes = rows.truth.valid.iter().map(|v| u8::from(*v) * 255);
                    png.codes8(&codes.collect::<Vec<_>>())?;
                }
                FileKind::Occlusion => {
                    let code = |v: &f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
                    let codes = sample.occlusion.data().iter().map(code);
                    png.codes8(&codes.collect::<Vec<_>>())?;
                }
                FileKind::Objects => {
                    let seen = sample.seen.ok_or_else(|| absent("is not there"))?;
                    png.codes16(seen.objects)?;
                }
                _ => {
                    let (values, levels) =
                        codes_of(kind, rows).ok_or_else(|| absent("is not there"))?;
                    let (codes, clipped) = levels.codes(values.data()).map_err(absent)?;
                    png.codes16(&codes)?;
                    if kind == FileKind::Raw {
                        self.clipped += clipped;
                    }
                }
            },
            Content::Camera(codes) => {
                let how = sample.description.camera_pictures.as_ref();
                let how = how.ok_or_else(|| absent("camera-like pictures are not described"))?;
                let (views, sum) = match (&rows.noisy, how.noisy) {
                    (_, false) => (&rows.views, &rows.sum),
                    (Some(noisy), true) => (&noisy.views, &noisy.sum),
                    (None, true) => return Err(absent("there is no noisy capture")),
                };
                match kind {
                    FileKind::CameraJpeg | FileKind::CameraPng => {
                        codes.add(how, std::slice::from_ref(sum), 1.0);
                    }
                    _ => codes.add(how, views, how.view_gain),
                }
            }
            Content::Sheet => {}
        }
        Ok(())
    }

    /// Ends the file, and waits for the disk.
    pub fn finish(
        self,
        panels: &preview::Panels,
        given: &Description,
    ) -> Result<FileEntry, WriteError> {
        let path = &self.path;
        let failed = |cause| FileError::new(path, "write", cause);
        match self.content {
            Content::Exr(exr) => {
                let mut file = BufWriter::new(File::create_new(path).map_err(failed)?);
                exr.finish(&mut file)?;
                file.flush().map_err(failed)?;
                file.get_ref().sync_all().map_err(failed)?;
            }
            Content::Png(png, file) => {
                png.finish()?;
                file.sync_all().map_err(failed)?;
            }
            Content::Camera(codes) => {
                let how = given.camera_pictures.as_ref();
                let absent = || input(&self.file.name, "camera-like pictures are not described");
                file::write_synced(path, &codes.encode(path, how.ok_or_else(absent)?)?)?;
            }
            Content::Sheet => {
                let sheet = preview::contact_sheet(panels, given);
                let (width, height) = (sheet.width, sheet.height);
                let bytes = raster::encode_jpeg(path, &sheet.rgb, width, height, PREVIEW_QUALITY)?;
                file::write_synced(path, &bytes)?;
            }
        }
        let read = file::open(path)?;
        let failed = |cause| FileError::new(path, "read", cause);
        Ok(FileEntry::read(&self.file.name, read).map_err(failed)?)
    }
}

/// The layers of an EXR file, in the order of [`images`].
fn layers(file: &SampleFile, given: &Description) -> Vec<LayerShape> {
    let sample = match file.storage {
        Storage::Float => Sample::Float,
        _ => Sample::Half,
    };
    let layer = |name: &str, channels: &[&str]| LayerShape {
        name: name.to_owned(),
        channels: channels.iter().map(|c| (*c).to_owned()).collect(),
        sample,
    };
    let colours: Vec<&str> = given.channels.iter().map(|c| c.name.as_str()).collect();
    let subpixels = given.sensor.subpixels.names();
    let subpixels = subpixels.iter().map(String::as_str);
    let with_sum = subpixels.clone().chain([SUM_LAYER]);
    match file.kind {
        FileKind::Views | FileKind::NoisyViews => with_sum.map(|n| layer(n, &colours)).collect(),
        FileKind::Shading => subpixels.map(|n| layer(n, &colours)).collect(),
        FileKind::Disparity => subpixels.map(|n| layer(n, &DISPARITY_CHANNELS)).collect(),
        FileKind::Shifts => {
            let mut layers = vec![layer(SUM_LAYER, &["dx", "dy"])];
            let channels_differ = file.channels.len() > 2;
            layers.extend(
                with_sum
                    .filter(|_| channels_differ)
                    .map(|n| layer(n, &COLOUR_SHIFTS)),
            );
            layers
        }
        FileKind::Raw | FileKind::Target => vec![layer("", &colours)],
        FileKind::Normal => vec![layer("", &["X", "Y", "Z"])],
        _ => {
            let names: Vec<&str> = file.channels.iter().map(String::as_str).collect();
            vec![layer("", &names)]
        }
    }
}

/// Some rows of the layers of an EXR file.
fn images<'a>(kind: FileKind, rows: &'a Rows<'_>) -> Option<Vec<&'a Image>> {
    let (sample, truth) = (rows.sample, &rows.truth);
    Some(match kind {
        FileKind::Raw => vec![sample.raw],
        FileKind::Views => rows.views.iter().chain([&rows.sum]).collect(),
        FileKind::NoisyViews => {
            let noisy = rows.noisy.as_ref()?;
            noisy.views.iter().chain([&noisy.sum]).collect()
        }
        FileKind::Shading => sample.noisy?.shading.iter().collect(),
        FileKind::Target => vec![sample.target],
        FileKind::Depth => vec![&truth.depth_m],
        FileKind::Distance => vec![&truth.distance_m],
        FileKind::Disparity => truth.disparity_px.iter().collect(),
        FileKind::Coc => vec![&truth.coc_px],
        FileKind::Normal => vec![truth.normals.as_ref()?],
        FileKind::Shifts => {
            let sum = std::iter::once(&truth.chief_to_sum_px);
            sum.chain(&truth.channel_shifts_px).collect()
        }
        _ => return None,
    })
}

/// Some rows of the values of a 16-bit PNG, and how they become codes.
fn codes_of<'a>(
    kind: FileKind,
    rows: &'a Rows<'_>,
) -> Option<(std::borrow::Cow<'a, Image>, Levels)> {
    use std::borrow::Cow;
    let sample = rows.sample;
    let codes = Levels::full_range(f32::from(u16::MAX));
    let RawEncoding::Png(levels) = sample.raw_encoding else {
        return (kind == FileKind::Noisy).then_some((Cow::Borrowed(sample.noisy?.codes), codes));
    };
    Some(match kind {
        FileKind::Raw => (Cow::Borrowed(sample.raw), levels),
        FileKind::Mosaic => (Cow::Owned(rows.picked(sample.raw)?), levels),
        FileKind::Noisy => (Cow::Borrowed(sample.noisy?.codes), codes),
        FileKind::NoisyMosaic => (Cow::Owned(rows.picked(sample.noisy?.codes)?), codes),
        _ => return None,
    })
}
