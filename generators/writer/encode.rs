//! A sample as bytes: every file's content, made in parallel, and the description that names them.
//!
//! Packing was chosen by measurement (256 × 256 pixels, one core): half images by PIZ (2.0 → 1.4 MB in 24 ms; ZIP 48
//! ms), float maps by ZIP (4.2 → 0.4 to 2.5 MB in 21 to 96 ms; PIZ 1.5 to 2.8 MB in 23 to 96 ms). Disparities are
//! rounded before (768 × 512: 25 → 3.6 MB in 0.20 s; with all digits 19 MB in 0.57 s).

use std::path::Path;

use quadpixel::image::exr::{Compression, Layer, Sample, encode_layers};
use quadpixel::image::raster::Levels;
use quadpixel::image::views::{split_views, sum_of};
use quadpixel::image::{Image, raster};
use quadpixel_datasets::{COLOUR_SHIFTS, Optional, SCHEMA_VERSION, SUM_LAYER, paths, sample_files};
use quadpixel_datasets::{
    CameraDescription, CameraPictures, FileEntry, FileKind, Raw, RawFormat, RenderStatistics,
    SampleFile, SampleMeta, Storage,
};
use rayon::prelude::*;

use super::camera_pictures;
use super::error::WriteError;
use super::files::{RawEncoding, SampleFiles};
use super::json::{VERSION, json};
use super::mosaic;
use super::sound::{check, input};
use super::truth::{self, Truth};
use crate::preview;

/// Files of a sample: name and content.
pub(super) type Contents = Vec<(String, Vec<u8>)>;

const DISPARITY_CHANNELS: [&str; 4] = ["dx", "dy", "paraxial_dx", "paraxial_dy"];
const NORMAL_CHANNELS: [&str; 3] = ["X", "Y", "Z"];
const PREVIEW_QUALITY: u8 = 90;
/// The largest number of half precision.
const LARGEST_HALF: f32 = 65504.0;

/// The sample's description and the content of each of its files, in the order of their names.
pub(super) fn encode(
    sample: &SampleFiles<'_>,
    name: &str,
) -> Result<(SampleMeta, Contents), WriteError> {
    check(sample, name)?;
    let given = &sample.description;
    let subpixels = given.sensor.subpixels;
    let truth = truth::masked(sample);
    let views = split_views(sample.raw, subpixels);
    let sum = sum_of(&views).ok_or_else(|| input(name, "the pixel has no sub-pixel"))?;
    let files = files_of(sample, &sum);
    let colours: Vec<&str> = given.channels.iter().map(|c| c.name.as_str()).collect();
    let pictures = Pictures {
        sample,
        truth: &truth,
        views: &views,
        sum: &sum,
        colours: &colours,
        subpixels: subpixels.names(),
    };
    let encoded: Vec<(Vec<u8>, u64)> = files
        .par_iter()
        .map(|file| pictures.encode(file))
        .collect::<Result<_, _>>()?;
    let clipped = encoded.iter().map(|(_, clipped)| clipped).sum();
    let raw = raw_of(sample.raw_encoding, clipped);
    let mut meta = describe(sample, name, &truth, raw, files);
    let camera = meta.camera(given.curves.clone());
    let mut contents: Contents = (meta.files.iter().zip(encoded))
        .map(|(file, (bytes, _))| (file.name.clone(), bytes))
        .collect();
    contents.push((
        paths::CAMERA.to_string(),
        json(Path::new(paths::CAMERA), &camera)?,
    ));
    contents.sort_by(|a, b| a.0.cmp(&b.0));
    meta.contents = (contents.par_iter())
        .map(|(name, bytes)| FileEntry::new(name, bytes))
        .collect();
    contents.push((
        paths::META.to_string(),
        json(Path::new(paths::META), &meta)?,
    ));
    contents.sort_by(|a, b| a.0.cmp(&b.0));
    Ok((meta, contents))
}

/// A sample that is not written: what `meta.json` (without the list of its `contents`) and `camera.json` would say, and
/// the maps as they would be stored.
///
/// # Errors
/// As of a sample that is written.
pub fn described(
    sample: &SampleFiles<'_>,
) -> Result<(SampleMeta, CameraDescription, Truth), WriteError> {
    let name = paths::sample_name(sample.description.index)?;
    check(sample, &name)?;
    let truth = truth::masked(sample);
    let views = split_views(sample.raw, sample.description.sensor.subpixels);
    let sum = sum_of(&views).ok_or_else(|| input(&name, "the pixel has no sub-pixel"))?;
    let clipped = match sample.raw_encoding {
        RawEncoding::Png(levels) => sample
            .raw
            .data()
            .iter()
            .filter(|v| levels.clips(**v))
            .count(),
        RawEncoding::Exr => 0,
    };
    let raw = raw_of(sample.raw_encoding, clipped as u64);
    let meta = describe(sample, &name, &truth, raw, files_of(sample, &sum));
    let camera = meta.camera(sample.description.curves.clone());
    Ok((meta, camera, truth))
}

/// The sample's files; `sum`: of its views.
fn files_of(sample: &SampleFiles<'_>, sum: &Image) -> Vec<SampleFile> {
    let given = &sample.description;
    let noisy = sample.noisy.as_ref().map(|noisy| noisy.linear);
    let light = [sample.raw, sample.target, sum].into_iter().chain(noisy);
    // In this the views are: they add up to the sum.
    let bright = light
        .flat_map(|image| image.data())
        .any(|v| v.abs() > LARGEST_HALF);
    let format = match sample.raw_encoding {
        RawEncoding::Png(_) => RawFormat::Png,
        RawEncoding::Exr => RawFormat::Exr,
    };
    sample_files(
        &given.sensor,
        &given.channels,
        format,
        Optional {
            channels_differ: sample.channel_shifts_px.is_some(),
            world: sample.seen.is_some(),
            noisy: given.noise.readout().is_some(),
            mosaic: given.mosaic.is_some(),
            camera: (given.camera_pictures.as_ref())
                .map(|pictures| FileKind::camera_pictures(pictures.jpeg_quality.is_some())),
            bright,
        },
        [preview::SHEET_WIDTH as u32, preview::SHEET_HEIGHT as u32],
    )
}

struct Pictures<'a> {
    sample: &'a SampleFiles<'a>,
    truth: &'a Truth,
    views: &'a [Image],
    sum: &'a Image,
    colours: &'a [&'a str],
    subpixels: Vec<String>,
}

impl Pictures<'_> {
    /// A layer per sub-pixel.
    fn layers<'b>(&'b self, images: &'b [Image], sample: Sample) -> Vec<Layer<'b>> {
        let named = self.subpixels.iter().zip(images);
        named
            .map(|(name, image)| layer(name, self.colours, image, sample))
            .collect()
    }

    /// A layer per sub-pixel, and their sum.
    fn layers_and_sum<'b>(
        &'b self,
        images: &'b [Image],
        sum: &'b Image,
        sample: Sample,
    ) -> Vec<Layer<'b>> {
        let mut layers = self.layers(images, sample);
        layers.push(layer(SUM_LAYER, self.colours, sum, sample));
        layers
    }

    fn sheet(&self) -> preview::Sheet {
        let subpixels = self.sample.description.sensor.subpixels;
        let maps = &self.truth.disparity_px;
        preview::contact_sheet(&preview::Pictures {
            description: &self.sample.description,
            views: self.views,
            sum: self.sum,
            target: self.sample.target,
            depth_m: &self.truth.depth_m,
            left_right_px: truth::left_right_px(maps, subpixels, 0).as_ref(),
            coc_px: &self.truth.coc_px,
            occlusion: self.sample.occlusion,
        })
    }

    /// The views and the sum that camera-like pictures are of, and how they are made.
    fn camera_views(&self) -> Result<(Vec<Image>, Image, &CameraPictures), WriteError> {
        let given = &self.sample.description;
        let absent = |what: &str| input("camera-like pictures", what);
        let how = given.camera_pictures.as_ref();
        let how = how.ok_or_else(|| absent("are not described"))?;
        if !how.noisy {
            return Ok((self.views.to_vec(), self.sum.clone(), how));
        }
        let noisy = (self.sample.noisy).ok_or_else(|| absent("there is no noisy capture"))?;
        let views = split_views(noisy.linear, given.sensor.subpixels);
        let sum = sum_of(&views).ok_or_else(|| absent("the pixel has no sub-pixel"))?;
        Ok((views, sum, how))
    }

    /// The bytes of a file, and how many values were clipped.
    fn encode(&self, file: &SampleFile) -> Result<(Vec<u8>, u64), WriteError> {
        let (sample, path) = (self.sample, Path::new(&file.name));
        let (width, height) = (file.width as usize, file.height as usize);
        let absent = |what: &str| input(&file.name, what);
        let noisy = || (sample.noisy).ok_or_else(|| absent("there is no noisy capture"));
        let picked = |all: &Image| {
            let picked = mosaic::picked(&sample.description, all);
            picked.ok_or_else(|| absent("there is no pattern of colours"))
        };
        let codes = Levels::full_range(f32::from(u16::MAX));
        let png16 = |image: &Image, levels| {
            raster::encode_png16(path, image, levels).map(|(bytes, _)| bytes)
        };
        let png8 = |codes: Vec<u8>| raster::encode_png8(path, &codes, width, height, 1);
        let half = |layers: &[Layer<'_>]| encode_layers(path, layers, Compression::Piz);
        let precision = match file.storage {
            Storage::Float => Sample::Float,
            _ => Sample::Half,
        };
        let float = |layers: &[Layer<'_>]| encode_layers(path, layers, Compression::Zip);
        let map = |channel, image| {
            let channels = std::slice::from_ref(channel);
            float(&[layer("", channels, image, Sample::Float)])
        };
        let bytes = match (file.kind, sample.raw_encoding) {
            (FileKind::Raw, RawEncoding::Png(levels)) => {
                return Ok(raster::encode_png16(path, sample.raw, levels)?);
            }
            (FileKind::Raw, RawEncoding::Exr) => {
                half(&[layer("", self.colours, sample.raw, precision)])
            }
            (FileKind::Views, _) => half(&self.layers_and_sum(self.views, self.sum, precision)),
            (FileKind::Noisy, _) => png16(noisy()?.codes, codes),
            (FileKind::Mosaic, RawEncoding::Png(levels)) => png16(&picked(sample.raw)?, levels),
            (FileKind::Mosaic, RawEncoding::Exr) => return Err(absent("is picked from a raw.png")),
            (FileKind::NoisyMosaic, _) => png16(&picked(noisy()?.codes)?, codes),
            (FileKind::NoisyViews, _) => {
                let views = split_views(noisy()?.linear, sample.description.sensor.subpixels);
                let sum = sum_of(&views).ok_or_else(|| absent("the pixel has no sub-pixel"))?;
                half(&self.layers_and_sum(&views, &sum, precision))
            }
            (FileKind::Shading, _) => half(&self.layers(noisy()?.shading, precision)),
            (FileKind::Target, _) => half(&[layer("", self.colours, sample.target, precision)]),
            (FileKind::Depth, _) => map(&"Z", &self.truth.depth_m),
            (FileKind::Distance, _) => map(&"distance", &self.truth.distance_m),
            (FileKind::Disparity, _) => {
                let maps = self.subpixels.iter().zip(&self.truth.disparity_px);
                let layers: Vec<Layer<'_>> = maps
                    .map(|(name, map)| layer(name, &DISPARITY_CHANNELS, map, Sample::Float))
                    .collect();
                float(&layers)
            }
            (FileKind::Objects, _) => {
                let seen = (sample.seen).ok_or_else(|| absent("there is no map of objects"))?;
                raster::encode_gray16(path, seen.objects, width, height)
            }
            (FileKind::Normal, _) => {
                let normals = self.truth.normals.as_ref();
                let normals = normals.ok_or_else(|| absent("there is no map of normals"))?;
                float(&[layer("", &NORMAL_CHANNELS, normals, Sample::Float)])
            }
            (FileKind::Shifts, _) => {
                let sum = &self.truth.chief_to_sum_px;
                let mut layers = vec![layer(SUM_LAYER, &["dx", "dy"], sum, Sample::Half)];
                let names = self.subpixels.iter().map(String::as_str).chain([SUM_LAYER]);
                let channels = names.zip(&self.truth.channel_shifts_px);
                layers.extend(channels.map(|(n, map)| layer(n, &COLOUR_SHIFTS, map, Sample::Half)));
                float(&layers)
            }
            (FileKind::CameraJpeg | FileKind::CameraPng, _) => {
                let (_, sum, how) = self.camera_views()?;
                camera_pictures::encode(path, how, (&[sum], 1), 1.0)
            }
            (FileKind::CameraViewsJpeg | FileKind::CameraViewsPng, _) => {
                let (views, _, how) = self.camera_views()?;
                let columns = sample.description.sensor.subpixels.m();
                camera_pictures::encode(path, how, (&views, columns), how.view_gain)
            }
            (FileKind::Coc, _) => map(&"coc", &self.truth.coc_px),
            (FileKind::Occlusion, _) => {
                let code = |v: &f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
                png8(sample.occlusion.data().iter().map(code).collect())
            }
            (FileKind::Valid, _) => png8(
                (self.truth.valid.iter())
                    .map(|v| u8::from(*v) * 255)
                    .collect(),
            ),
            (FileKind::Preview, _) => {
                let sheet = self.sheet();
                raster::encode_jpeg(path, &sheet.rgb, sheet.width, sheet.height, PREVIEW_QUALITY)
            }
        };
        Ok((bytes?, 0))
    }
}

fn layer<'a>(
    name: &'a str,
    channels: &'a [&'a str],
    image: &'a Image,
    sample: Sample,
) -> Layer<'a> {
    Layer {
        name,
        channels,
        image,
        sample,
    }
}

fn raw_of(encoding: RawEncoding, clipped: u64) -> Raw {
    let levels = match encoding {
        RawEncoding::Png(levels) => Some(levels),
        RawEncoding::Exr => None,
    };
    Raw {
        format: levels.map_or(RawFormat::Exr, |_| RawFormat::Png),
        black_level: levels.map(|levels| levels.black),
        white_level: levels.map(|levels| levels.white),
        linear_at_white: levels.map(|levels| f64::from(levels.linear_at_white)),
        clipped,
    }
}

fn describe(
    sample: &SampleFiles<'_>,
    name: &str,
    truth: &Truth,
    raw: Raw,
    files: Vec<SampleFile>,
) -> SampleMeta {
    let given = sample.description.clone();
    let subpixels = given.sensor.subpixels;
    let colours = mosaic::described(&given, &raw);
    SampleMeta {
        schema_version: SCHEMA_VERSION,
        tool_version: VERSION.to_string(),
        configuration_blake3: given.configuration_blake3,
        id: name.to_string(),
        seed: given.seed,
        scene: given.scene,
        lens: given.lens,
        focus: given.focus,
        sensor: given.sensor,
        response: given.response,
        channels: given.channels,
        exposure: given.exposure,
        mosaic: colours,
        camera_pictures: given.camera_pictures,
        raw,
        noise: given.noise,
        intrinsics: given.intrinsics,
        effects: given.effects,
        statistics: RenderStatistics {
            rays_per_pixel: given.rays_per_pixel,
            rays: given.rays,
            lost: given.lost,
            rms_error_over_mean: given.errors.map(|e| e.rms_over_mean),
            median_relative_error: given.errors.map(|e| e.median_relative),
            speckle_share: given.errors.map(|e| e.speckle_share),
            invalid_pixels: truth.valid.iter().filter(|valid| !**valid).count() as u64,
            lens_tracing: Some(given.lens_tracing),
        },
        truth: given.truth,
        ranges: truth::ranges(truth),
        coc_disparity: truth::coc_disparity(truth, subpixels),
        files,
        contents: Vec::new(),
    }
}
