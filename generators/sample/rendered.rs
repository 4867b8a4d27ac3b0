//! A rendered sample.

use quadpixel::effects::{Decision, Estimate};
use quadpixel::image::Image;
use quadpixel::image::raster::Levels;
use quadpixel::render::truth::{Defocus, DisparityMaps, GeometryTruth, WhiteField};
use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::units::M_PER_MM;

use super::noisy::Noisy;
use super::stages::Stages;
use crate::describe::Description;
use crate::observer::{Event, Observer};
use crate::writer::{RawEncoding, SampleFiles, WorldMaps};

/// Headroom of the 16-bit mosaic: the linear value at its white level, as a multiple of the largest that a white wall
/// gives a sub-pixel.
const RAW_HEADROOM: f64 = 2.0;

/// The linear value at the white level of the mosaic, with the headroom of underexposed pictures as of others.
pub(super) fn raw_white(white: &WhiteField, ev: f64) -> f32 {
    (RAW_HEADROOM * white.largest_share() * ev.max(0.0).exp2()) as f32
}

/// How the mosaic is stored whose white level stands for this linear value.
pub(super) fn raw_encoding(raw_white: f32) -> RawEncoding {
    RawEncoding::Png(Levels::full_range(raw_white))
}

/// Saturated part of a mosaic's values above which a warning says so.
const SATURATED_SHARE: f64 = 1e-3;

/// What to say of a mosaic of `values` values of which `saturated` are at its largest code; `None` where it is but few.
pub(super) fn saturation(what: &str, saturated: u64, values: usize) -> Option<String> {
    let share = saturated as f64 / values.max(1) as f64;
    (share > SATURATED_SHARE).then(|| {
        format!(
            "{what}: {:.2} % of the values are saturated; a lower exposure_ev keeps them",
            100.0 * share
        )
    })
}

/// The pictures and maps of a sample, or of rows of it. Images are linear, scaled by the exposure.
pub(super) struct Pictures {
    pub mosaic: SubPixelImage,
    pub target: Image,
    pub maps: Maps,
    pub disparity: DisparityMaps,
    pub shifts: Shifts,
    pub occlusion: Image,
    pub noisy: Option<Noisy>,
    /// Linear value at the white level of the mosaic.
    pub raw_white: f32,
}

/// A rendered sample.
pub struct Sample {
    pub(super) pictures: Pictures,
    /// What is said of it.
    pub made: Made,
}

/// What is said of a sample that was made.
pub struct Made {
    /// What was left out of its scene.
    pub(super) warnings: Vec<String>,
    pub(super) left_out_together: Option<Estimate>,
    /// What `meta.json` says of it.
    pub description: Description,
    /// Which effects it was rendered with, and why.
    pub decisions: Vec<Decision>,
    /// Where the time went.
    pub stages: Stages,
}

/// Small shifts beside the disparity, px.
pub(super) struct Shifts {
    /// Where the sum shows what the chief ray meets, from there.
    pub chief_to_sum: Image,
    /// As of [`quadpixel::render::truth::channel_shifts`].
    pub channels: Option<Vec<Image>>,
}

/// What the rays of sight met, pixel by pixel.
pub(super) struct Maps {
    depth_m: Image,
    distance_m: Image,
    coc_px: Image,
    valid: Vec<bool>,
    /// Object numbers and normals, of worlds of meshes.
    seen: Option<(Vec<u16>, Image)>,
}

impl Maps {
    pub(super) fn new(
        camera: &Camera,
        is_world: bool,
        truth: GeometryTruth,
        defocus: &Defocus,
    ) -> Self {
        let pitch_mm = camera.sensor().pitch_mm();
        let coc_px = |d: f32| (defocus.circle_of_confusion_mm(f64::from(d)) / pitch_mm) as f32;
        let metres = |mm: f32| mm * M_PER_MM as f32;
        Self {
            coc_px: mapped(&truth.depth_mm, coc_px),
            valid: truth.depth_mm.data().iter().map(|d| !d.is_nan()).collect(),
            depth_m: mapped(&truth.depth_mm, metres),
            distance_m: mapped(&truth.distance_mm, metres),
            seen: is_world.then(|| (truth.surfaces, per_spec_frame(truth.normals))),
        }
    }
}

fn mapped(image: &Image, value: impl Fn(f32) -> f32) -> Image {
    let mut image = image.clone();
    image.data_mut().iter_mut().for_each(|x| *x = value(*x));
    image
}

/// Directions in the layout's frame, whose Z runs into the scene.
fn per_spec_frame(mut normals: Image) -> Image {
    for n in normals.data_mut().chunks_exact_mut(3) {
        // Written as a difference, so that no −0 is stored.
        n[2] = 0.0 - n[2];
    }
    normals
}

impl Made {
    /// Reports under `name` what was left out of its scene, and each decision about its effects.
    pub fn report(&self, observer: &dyn Observer, name: &str) {
        for warning in &self.warnings {
            observer.event(Event::Warning(warning));
        }
        for decision in &self.decisions {
            observer.event(Event::Decision {
                sample: name,
                decision,
            });
        }
        if let Some(estimate) = self.left_out_together {
            let text = format!("{name}: left out together: {estimate}");
            observer.event(Event::Info(&text));
        }
    }
}

impl Sample {
    /// What the writer takes.
    pub fn files(&self) -> SampleFiles<'_> {
        self.pictures.files(&self.made.description)
    }
}

impl Pictures {
    /// What the writer takes; `description`: of the whole sample.
    pub fn files<'a>(&'a self, description: &'a Description) -> SampleFiles<'a> {
        let maps = &self.maps;
        SampleFiles {
            raw: &self.mosaic.mosaic,
            raw_encoding: raw_encoding(self.raw_white),
            target: &self.target,
            depth_m: &maps.depth_m,
            distance_m: &maps.distance_m,
            traced_px: &self.disparity.traced,
            paraxial_px: &self.disparity.paraxial,
            coc_px: &maps.coc_px,
            chief_to_sum_px: &self.shifts.chief_to_sum,
            channel_shifts_px: self.shifts.channels.as_deref(),
            occlusion: &self.occlusion,
            noisy: self.noisy.as_ref().map(Noisy::files),
            valid: &maps.valid,
            seen: (maps.seen.as_ref()).map(|(objects, normals)| WorldMaps { objects, normals }),
            description,
        }
    }
}
