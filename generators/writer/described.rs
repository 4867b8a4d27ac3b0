//! What `meta.json` and `camera.json` say of a sample.

use quadpixel::image::Image;
use quadpixel_datasets::{
    CameraDescription, FileKind, Optional, Raw, RawFormat, RenderStatistics, SCHEMA_VERSION,
    SampleFile, SampleMeta, paths, sample_files,
};

use super::error::WriteError;
use super::files::{RawEncoding, SampleFiles};
use super::findings::Findings;
use super::json::VERSION;
use super::mosaic;
use super::rows::Rows;
use super::sound::check;
use super::truth::Truth;
use crate::describe::Description;
use crate::preview;

/// The largest number of half precision.
const LARGEST_HALF: f32 = 65504.0;

/// Which files a sample has, and how its light is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kind {
    /// How the raw mosaic is stored.
    pub raw: RawEncoding,
    /// Whether the colour channels have shifts of their own.
    pub channels_differ: bool,
    /// Whether it is of a world of meshes.
    pub world: bool,
    /// Light above what half precision holds (65504).
    pub bright: bool,
}

impl Kind {
    /// Of a whole sample.
    pub(super) fn of(rows: &Rows<'_>) -> Self {
        let sample = rows.sample;
        let noisy = sample.noisy.as_ref().map(|noisy| noisy.linear);
        let light = [sample.raw, sample.target, &rows.sum]
            .into_iter()
            .chain(noisy);
        // In this the views are: they add up to the sum.
        let above = |image: &Image| image.any(|v| v.abs() > LARGEST_HALF);
        Self {
            raw: sample.raw_encoding,
            channels_differ: sample.channel_shifts_px.is_some(),
            world: sample.seen.is_some(),
            bright: light.into_iter().any(above),
        }
    }

    /// The sample's files.
    pub(super) fn files(self, given: &Description) -> Vec<SampleFile> {
        let format = match self.raw {
            RawEncoding::Png(_) => RawFormat::Png,
            RawEncoding::Exr => RawFormat::Exr,
        };
        sample_files(
            &given.sensor,
            &given.channels,
            format,
            Optional {
                channels_differ: self.channels_differ,
                world: self.world,
                noisy: given.noise.readout().is_some(),
                mosaic: given.mosaic.is_some(),
                camera: (given.camera_pictures.as_ref())
                    .map(|pictures| FileKind::camera_pictures(pictures.jpeg_quality.is_some())),
                bright: self.bright,
            },
            [preview::SHEET_WIDTH as u32, preview::SHEET_HEIGHT as u32],
        )
    }

    /// What is said of the raw mosaic, of which so many values were clipped.
    fn described_raw(self, clipped: u64) -> Raw {
        let levels = match self.raw {
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

    /// What `meta.json` says, but for the list of its `contents`.
    pub(super) fn describe(
        self,
        given: Description,
        name: &str,
        findings: &Findings,
        clipped: u64,
    ) -> SampleMeta {
        let files = self.files(&given);
        let raw = self.described_raw(clipped);
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
                invalid_pixels: findings.invalid,
                lens_tracing: Some(given.lens_tracing),
            },
            truth: given.truth,
            ranges: findings.ranges.clone(),
            coc_disparity: findings.coc_disparity(),
            files,
            contents: Vec::new(),
        }
    }
}

/// A sample that is not written: what `meta.json` (without the list of its `contents`) and `camera.json` would say, and
/// the maps as they would be stored.
///
/// # Errors
/// As of a sample that is written.
pub fn described(
    sample: &SampleFiles<'_>,
) -> Result<(SampleMeta, CameraDescription, Truth), WriteError> {
    let given = sample.description;
    let name = paths::sample_name(given.index)?;
    check(sample, &name, given.sensor.height_px as usize)?;
    let rows = Rows::new(sample, &name, 0)?;
    let mut findings = Findings::default();
    findings.add(&rows.truth);
    let clipped = match sample.raw_encoding {
        RawEncoding::Png(levels) => levels.clipped(sample.raw.data()),
        RawEncoding::Exr => 0,
    };
    let meta = Kind::of(&rows).describe(given.clone(), &name, &findings, clipped);
    let camera = meta.camera(given.curves.clone());
    Ok((meta, camera, rows.truth))
}
