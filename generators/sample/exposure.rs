//! How what was rendered becomes a sample: exposure, noise, truths, and what is said of them; all at once or by rows.

use std::ops::Range;

use quadpixel::effects::{Choice, Decision, Estimate};
use quadpixel::image::Image;
use quadpixel::render::truth::{
    Defocus, DisparityField, GeometryTruth, SightRays, WhiteField, channel_shifts,
};
use quadpixel::render::{Camera, RenderStats, SubPixelImage};
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel_datasets as spec;

use super::coherence::{self, FineContrast};
use super::ledger::ledger;
use super::noisy::Capture;
use super::planned;
use super::prepared::Prepared;
use super::rendered::{Made, Maps, Pictures, Sample, Shifts, raw_white, saturation};
use crate::assemble;
use crate::describe::{Description, RenderedLight, curves, describe};
use crate::recipe::{RecipeError, SampleId};

/// What is known of a sample before its pixels.
pub(super) struct Known {
    pub fields: Vec<DisparityField>,
    pub white: WhiteField,
    pub sight: SightRays,
    pub choice: Choice,
    pub decisions: Vec<Decision>,
    pub left_out_together: Option<Estimate>,
    pub stats: RenderStats,
}

/// What was rendered of a scene, and its truth: of the whole window, or of rows of it.
pub(super) struct Shown {
    pub rows: Option<Range<usize>>,
    /// sr times the unit of radiance; so is the target.
    pub image: SubPixelImage,
    pub occlusion: Option<Image>,
    pub target: Image,
    pub geometry: GeometryTruth,
}

/// A camera's exposure, and what was counted of it so far.
pub(super) struct Exposure {
    pub prepared: Prepared,
    pub known: Known,
    /// What `meta.json` says, but for what is counted.
    pub description: Description,
    /// The ledger before anything is counted.
    effects: spec::Effects,
    chief: SightRays,
    defocus: Defocus,
    /// Linear value a sr of absorbed white light.
    gain: f64,
    /// Linear value at the white level of the mosaic.
    pub raw_white: f32,
    capture: Option<Capture>,
    contrast: FineContrast,
    clipped: u64,
    saturated: u64,
    values: usize,
}

impl Exposure {
    pub fn new(prepared: Prepared, id: SampleId, mut known: Known) -> Result<Self, RecipeError> {
        let (recipe, camera) = (&prepared.recipe, &prepared.camera);
        let white = &known.white;
        let gain = recipe.exposure_ev.exp2() / white.reference_sr();
        let readout = recipe.readout.as_ref();
        let noise = planned::noise(readout, &known.choice, camera.sensor(), white);
        let readout = readout.filter(|_| !noise.verdict.is_left_out());
        known.decisions.push(noise);
        let lens = assemble::lens(&recipe.lens)?;
        let errors = prepared.colours.errors;
        planned::estimate_band_width(&mut known.decisions, errors, &lens, camera);
        let capture = readout.map(|settings| Capture::new(settings, camera, white, gain));
        let capture = capture.transpose()?;
        let noise = capture.as_ref().map(|capture| capture.description(0));
        let called = (known.decisions.as_slice(), &prepared.colours);
        let (tolerance, response) = (&recipe.tolerance, &prepared.response);
        let exposed = RenderedLight {
            gain,
            white_sr: white.middle_sr(),
            stats: &known.stats,
            channels_differ: known.fields.len() > 1,
            curves: (prepared.known).curves(|| {
                curves(camera, &known.fields)
                    .unwrap_or_else(|| unreachable!("a camera with a lens"))
            }),
            effects: ledger(recipe, camera, response, called, tolerance),
            noise: noise.map_or(spec::Noise::None, spec::Noise::Readout),
        };
        let description = describe(recipe, id, camera, response, exposed)?;
        Ok(Self {
            effects: description.effects.clone(),
            description,
            chief: SightRays::chief_rays(camera),
            defocus: Defocus::new(camera)
                .unwrap_or_else(|| unreachable!("a camera with a lens has a focus")),
            gain,
            raw_white: raw_white(white, recipe.exposure_ev),
            capture,
            contrast: FineContrast::new(camera.sensor().subpixels()),
            clipped: 0,
            saturated: 0,
            values: 0,
            prepared,
            known,
        })
    }

    /// Exposes what was rendered: of rows after those that were exposed before.
    pub fn pictures(&mut self, shown: Shown) -> Pictures {
        let part = shown.rows.map(|rows| self.prepared.camera.rows(rows));
        let camera: &Camera = part.as_ref().unwrap_or(&self.prepared.camera);
        let Known { fields, white, .. } = &self.known;
        let field = &fields[ChannelWavelengths::REFERENCE.min(fields.len() - 1)];
        let mut mosaic = shown.image;
        mosaic.scale(self.gain as f32);
        let mut target = shown.target;
        // Where there is no ray of sight the target is black, and `valid` says so.
        for value in target.data_mut() {
            *value = if value.is_nan() {
                0.0
            } else {
                *value * self.gain as f32
            };
        }
        let capture = self.capture.as_ref();
        let noisy = capture.map(|capture| capture.expose(&mosaic.mosaic, camera, white));
        let values = mosaic.mosaic.data();
        self.contrast.add(&mosaic.mosaic);
        self.clipped += values.iter().filter(|v| **v > self.raw_white).count() as u64;
        self.saturated += noisy.as_ref().map_or(0, |noisy| noisy.saturated);
        self.values += values.len();
        let geometry = shown.geometry;
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        let is_world = self.prepared.scene.world().is_some();
        Pictures {
            shifts: Shifts {
                chief_to_sum: (self.chief).chief_to_sum_px(camera, field, &geometry.depth_mm),
                channels: channel_shifts(camera, fields, &geometry.depth_mm),
            },
            raw_white: self.raw_white,
            disparity: field.maps(camera, &geometry.depth_mm),
            maps: Maps::new(camera, is_world, geometry, &self.defocus),
            occlusion: (shown.occlusion).unwrap_or_else(|| Image::zeros(width, height, 1)),
            target,
            noisy,
            mosaic,
        }
    }

    /// Forgets what was counted.
    pub fn begin_again(&mut self) {
        self.contrast = FineContrast::new(self.prepared.camera.sensor().subpixels());
        self.description.effects = self.effects.clone();
        (self.clipped, self.saturated, self.values) = (0, 0, 0);
    }

    /// Puts into the description what was counted of all rows.
    pub fn count(&mut self) {
        let effects = &mut self.description.effects;
        coherence::enter(&self.prepared.camera, &self.contrast, effects);
        if let Some(capture) = &self.capture {
            let noise = capture.description(self.saturated);
            self.description.noise = spec::Noise::Readout(noise);
        }
    }

    /// What was made, once all rows are counted.
    pub fn made(self) -> Made {
        let mut warnings = self.prepared.warnings;
        warnings.extend(saturation("raw.png", self.clipped, self.values));
        warnings.extend(saturation("noisy.png", self.saturated, self.values));
        Made {
            left_out_together: self.known.left_out_together,
            stages: self.prepared.stages,
            decisions: self.known.decisions,
            description: self.description,
            warnings,
        }
    }

    /// The sample, of the pictures of all rows.
    pub fn sample(mut self, pictures: Pictures) -> Sample {
        self.count();
        Sample {
            pictures,
            made: self.made(),
        }
    }
}
