//! A recipe put together, and rendered.

use std::sync::Arc;

use quadpixel::effects::{Choice, Decision, Estimate, Shot, plan};
use quadpixel::image::Image;
use quadpixel::render::truth::{
    Defocus, DisparityField, GeometryTruth, SightRays, WhiteField, channel_shifts,
};
use quadpixel::render::{Camera, RayRecord, RecordError, Render, Rendered};
use quadpixel::response::Response;
use quadpixel::rgbd::DepthPicture;
use quadpixel::scene::Scene;
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel_datasets as spec;

use super::coherence;
use super::ledger::ledger;
use super::noisy::Noisy;
use super::planned;
use super::prepare::prepare;
use super::rendered::{Maps, Sample, Shifts, raw_white, saturation};
use super::stages::{Stages, timed};
use crate::assemble::{self, ColourCall, Responses};
use crate::describe::{RenderedLight, describe};
use crate::lens_tracing;
use crate::observer::Observer;
use crate::recipe::{Recipe, RecipeError, SampleId};

/// Why a sample could not be rendered.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum SampleError {
    /// Its recipe.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// Rays that were kept, or shall be.
    #[error(transparent)]
    Rays(#[from] RecordError),
}

impl SampleError {
    /// Whether the caller can mend it.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Recipe(e) => e.is_input(),
            Self::Rays(_) => true,
        }
    }
}

/// Renders a recipe.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn render_sample(
    recipe: &Recipe,
    id: SampleId,
    responses: &mut Responses,
    observer: &dyn Observer,
) -> Result<Sample, SampleError> {
    let prepared = prepare(recipe, responses, observer)?;
    Ok(prepared.render(id, Rays::Trace, observer)?.0)
}

/// A recipe put together, before its first ray.
pub struct Prepared {
    pub(super) recipe: Recipe,
    pub(super) colours: ColourCall,
    pub(super) response: Arc<Response>,
    pub(super) camera: Camera,
    pub(super) scene: Scene,
    /// In the place of the scene.
    pub(super) picture: Option<DepthPicture>,
    pub(super) warnings: Vec<String>,
    pub(super) stages: Stages,
    /// Rays per pixel that lens maps must pay for.
    pub(super) maps_for: usize,
}

/// Where the radiance of the rays comes from.
pub enum Rays {
    /// They are traced.
    Trace,
    /// They are traced and kept.
    Keep,
    /// They were kept.
    Develop(Box<RayRecord>),
}

/// What was rendered of a scene, and its truth.
pub(super) struct Shown {
    pub rendered: Rendered,
    pub fields: Vec<DisparityField>,
    pub white: WhiteField,
    pub sight: SightRays,
    pub geometry: GeometryTruth,
    /// sr times the unit of radiance; absent: it is to be rendered.
    pub target: Option<Image>,
    pub choice: Choice,
    pub decisions: Vec<Decision>,
    pub left_out_together: Option<Estimate>,
}

impl Prepared {
    /// Its recipe.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }
    /// Its response.
    pub fn response(&self) -> &Response {
        &self.response
    }
    /// Its scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
    /// Makes lens maps where so many rays per pixel would be worth them, however few it is rendered with.
    pub(crate) fn make_maps_for(&mut self, rays_per_pixel: usize) {
        self.maps_for = rays_per_pixel;
    }
    /// Exposes it by `ev` stops.
    pub fn expose(&mut self, ev: f64) {
        self.recipe.exposure_ev = ev;
    }

    /// Renders it. The record is there if it was asked for.
    ///
    /// # Errors
    /// A record of another camera, or one that would be too large.
    pub fn render(
        mut self,
        id: SampleId,
        rays: Rays,
        observer: &dyn Observer,
    ) -> Result<(Sample, Option<RayRecord>), SampleError> {
        if self.picture.is_some() {
            return Ok((self.convert(id, &rays, observer)?, None));
        }
        let chief = SightRays::chief_rays(&self.camera);
        let geometry = timed(&mut self.stages.truth_s, || {
            chief.geometry(&self.camera, &self.scene)
        });
        // Kept rays are those of the whole camera, whatever pixel is put behind it later.
        let choice = match (&rays, self.recipe.effects.is_auto()) {
            (Rays::Keep | Rays::Develop(_), true) => Choice::All,
            _ => self.recipe.effects.clone(),
        };
        // Ghosts are followed from the scene: they have no place among kept rays.
        if let (Rays::Keep | Rays::Develop(_), Some(direct)) =
            (&rays, self.camera.without_reflections())
        {
            self.camera = direct;
        }
        let depths_mm = planned::depth_range_mm(&geometry.depth_mm);
        let (settings, tolerance) = (&self.recipe.render, &self.recipe.tolerance);
        let whole = Shot {
            camera: self.camera,
            scene: self.scene,
        };
        let planned = timed(&mut self.stages.effects_s, || {
            plan(whole, depths_mm, settings, &choice, tolerance)
        });
        (self.camera, self.scene) = (planned.shot.camera, planned.shot.scene);
        // Of the camera that is left: without aberrations, what a pixel sees has moved.
        let (fields, sight, geometry) = timed(&mut self.stages.truth_s, || {
            let fields = DisparityField::of_channels(&self.camera)
                .unwrap_or_else(|| unreachable!("a camera with a lens has a focus"));
            let sight = match self.recipe.registration {
                spec::Registration::Centroid => SightRays::centroids(&fields),
                spec::Registration::ChiefRay => SightRays::chief_rays(&self.camera),
            };
            let geometry = sight.geometry(&self.camera, &self.scene);
            (fields, sight, geometry)
        });
        let tracing = self.recipe.lens_tracing;
        self.camera = timed(&mut self.stages.scene_s, || {
            (self.camera).with_lens_maps(&tracing, self.maps_for)
        });
        self.warnings.extend(lens_tracing::warning(&self.camera));
        let several = self.scene.planes().len() > 1 || self.scene.world().is_some();
        let surfaces = several.then_some(geometry.surfaces.as_slice());
        let white = WhiteField::from_fields(&self.camera, &fields);
        let shot = Render::new(&self.camera, &self.scene, settings)
            .white(&white)
            .occlusion(surfaces)
            .progress(&observer);
        let (rendered, record) = timed(&mut self.stages.rays_s, || match rays {
            Rays::Trace => Ok((shot.run(), None)),
            Rays::Keep => (shot.run_recorded()).map(|(rendered, record)| (rendered, Some(record))),
            Rays::Develop(record) => (record.develop(&self.camera)).map(|done| (done, None)),
        })?;
        let began = std::time::Instant::now();
        let shown = Shown {
            rendered,
            fields,
            white,
            sight,
            geometry,
            target: None,
            choice,
            decisions: planned.decisions,
            left_out_together: planned.together,
        };
        let mut sample = self.exposed(id, shown)?;
        sample.stages.truth_s += began.elapsed().as_secs_f64();
        Ok((sample, record))
    }

    /// The sample, on the scale of its exposure.
    pub(super) fn exposed(self, id: SampleId, shown: Shown) -> Result<Sample, RecipeError> {
        let (recipe, camera, scene) = (&self.recipe, &self.camera, &self.scene);
        let Shown {
            rendered,
            fields,
            white,
            sight,
            geometry,
            mut decisions,
            target: shown_target,
            choice,
            left_out_together,
        } = shown;
        let field = &fields[ChannelWavelengths::REFERENCE.min(fields.len() - 1)];
        let defocus = Defocus::new(camera)
            .unwrap_or_else(|| unreachable!("a camera with a lens has a focus"));
        let gain = recipe.exposure_ev.exp2() / white.reference_sr();
        let mut mosaic = rendered.image;
        mosaic.scale(gain as f32);
        let rendered_target = || sight.target(camera, scene, &white, &recipe.render);
        let mut target = shown_target.unwrap_or_else(rendered_target);
        // Where there is no ray of sight the target is black, and `valid` says so.
        for value in target.data_mut() {
            *value = if value.is_nan() {
                0.0
            } else {
                *value * gain as f32
            };
        }
        let readout = recipe.readout.as_ref();
        let noise = planned::noise(readout, &choice, camera.sensor(), &white);
        let readout = readout.filter(|_| !noise.verdict.is_left_out());
        decisions.push(noise);
        let lens = assemble::lens(&recipe.lens)?;
        planned::estimate_band_width(&mut decisions, self.colours.errors, &lens, camera);
        let expose = |settings| Noisy::expose(settings, &mosaic, camera, &white, gain);
        let noisy = readout.map(expose).transpose()?;
        let noise = noisy.as_ref().map(Noisy::description);
        let (tolerance, response) = (&recipe.tolerance, &self.response);
        let called = (decisions.as_slice(), &self.colours);
        let mut effects = ledger(recipe, camera, response, called, tolerance);
        coherence::enter(camera, &mosaic, &mut effects);
        let exposed = RenderedLight {
            gain,
            white_sr: white.middle_sr(),
            stats: &rendered.stats,
            fields: &fields,
            effects,
            noise: noise.map_or(spec::Noise::None, spec::Noise::Readout),
        };
        let description = describe(recipe, id, camera, &self.response, exposed)?;
        let occlusion = rendered.occlusion;
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        let chief = SightRays::chief_rays(camera);
        let raw_white = raw_white(&white, recipe.exposure_ev);
        let values = mosaic.mosaic.data();
        let clipped = values.iter().filter(|v| **v > raw_white).count() as u64;
        let noisy_saturated = (noisy.as_ref()).map_or(0, |n| n.description().saturated);
        let mut warnings = self.warnings;
        warnings.extend(saturation("raw.png", clipped, values.len()));
        warnings.extend(saturation("noisy.png", noisy_saturated, values.len()));
        Ok(Sample {
            shifts: Shifts {
                chief_to_sum: chief.chief_to_sum_px(camera, field, &geometry.depth_mm),
                channels: channel_shifts(camera, &fields, &geometry.depth_mm),
            },
            raw_white,
            disparity: field.maps(camera, &geometry.depth_mm),
            maps: Maps::new(camera, scene.world().is_some(), geometry, &defocus),
            occlusion: occlusion.unwrap_or_else(|| Image::zeros(width, height, 1)),
            left_out_together,
            stages: self.stages,
            warnings,
            target,
            noisy,
            description,
            decisions,
            mosaic,
        })
    }
}
