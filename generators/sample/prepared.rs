//! A recipe put together, and rendered.

use std::sync::Arc;

use quadpixel::effects::{Choice, Shot, plan};
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField};
use quadpixel::render::{Camera, Footprints, RayRecord, RecordError, Render};
use quadpixel::response::Response;
use quadpixel::rgbd::DepthPicture;
use quadpixel::scene::Scene;
use quadpixel_datasets as spec;

use super::exposure::{Exposure, Known, Shown};
use super::planned;
use super::prepare::prepare;
use super::rendered::Sample;
use super::stages::{Stages, timed};
use crate::assemble::{ColourCall, OfCamera, Responses};
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
    /// Of this camera, with or without reflections.
    pub(super) known: Arc<OfCamera>,
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
        // Of another camera, perhaps.
        self.known = Arc::default();
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
        let footprints = timed(&mut self.stages.rays_s, || {
            (self.recipe.footprints)
                .then(|| Footprints::new(&self.camera, &self.scene))
                .flatten()
        });
        let shot = Render::new(&self.camera, &self.scene, settings)
            .white(&white)
            .footprints(footprints.as_ref())
            .occlusion(surfaces)
            .progress(&observer);
        let (rendered, record) = timed(&mut self.stages.rays_s, || match rays {
            Rays::Trace => Ok((shot.run(), None)),
            Rays::Keep => (shot.run_recorded()).map(|(rendered, record)| (rendered, Some(record))),
            Rays::Develop(record) => (record.develop(&self.camera)).map(|done| (done, None)),
        })?;
        let began = std::time::Instant::now();
        let target = sight.target(&self.camera, &self.scene, &white, settings);
        let known = Known {
            fields,
            white,
            sight,
            choice,
            decisions: planned.decisions,
            left_out_together: planned.together,
            stats: rendered.stats,
        };
        let mut exposure = Exposure::new(self, id, known)?;
        let pictures = exposure.pictures(Shown {
            rows: None,
            image: rendered.image,
            occlusion: rendered.occlusion,
            target,
            geometry,
        });
        let mut sample = exposure.sample(pictures);
        sample.made.stages.truth_s += began.elapsed().as_secs_f64();
        Ok((sample, record))
    }
}
