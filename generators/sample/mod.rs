//! Recipe → rendered sample with all its truths, ready for the writer.

mod ledger;
mod noisy;
pub mod planned;
pub mod stages;

use std::sync::Arc;

use quadpixel::effects::{Choice, Decision, Effect, Estimate, Planned, Shot, plan};
use quadpixel::image::Image;
use quadpixel::image::raster::Levels;
use quadpixel::render::truth::{ChiefRays, Defocus, DisparityField, DisparityMaps, WhiteField};
use quadpixel::render::{Camera, RayRecord, RecordError, Render, SubPixelImage};
use quadpixel::response::Response;
use quadpixel::scene::Scene;
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel::units::M_PER_MM;
use quadpixel_datasets as spec;

use crate::assemble::{self, Responses};
use crate::describe::{Description, Exposed, describe};
use crate::field_error::FieldError;
use crate::observer::{Event, Observer};
use crate::recipe::{Recipe, RecipeError, SampleId};
use crate::writer::{RawEncoding, SampleFiles, Seen};
use ledger::ledger;
use noisy::Noisy;
use stages::{Stages, timed};

/// Headroom of the 16-bit mosaic: the linear value (of one sub-pixel) at its white level, as a multiple of an equal
/// share of 1.
const RAW_HEADROOM: f32 = 2.0;

/// A rendered sample. Images are linear, scaled by the exposure.
pub struct Sample {
    mosaic: SubPixelImage,
    target: Image,
    depth_m: Image,
    distance_m: Image,
    disparity: DisparityMaps,
    coc_px: Image,
    occlusion: Image,
    valid: Vec<bool>,
    noisy: Option<Noisy>,
    /// Object numbers and normals, of worlds of meshes.
    seen: Option<(Vec<u16>, Image)>,
    warnings: Vec<String>,
    description: Description,
    decisions: Vec<Decision>,
    together: Option<Estimate>,
    stages: Stages,
}

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
    recipe: Recipe,
    response: Arc<Response>,
    camera: Camera,
    scene: Scene,
    warnings: Vec<String>,
    stages: Stages,
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

/// Lens, response, camera and scene of a recipe.
///
/// # Errors
/// What a field of the recipe is and may be.
pub fn prepare(
    recipe: &Recipe,
    responses: &mut Responses,
    observer: &dyn Observer,
) -> Result<Prepared, RecipeError> {
    (recipe.tolerance.check()).map_err(RecipeError::Tolerance)?;
    if !(1..=1 << 24).contains(&recipe.render.rays_per_pixel) {
        let n = recipe.render.rays_per_pixel;
        return Err(FieldError::new("render.rays_per_pixel", n, "1 to 16777216").into());
    }
    let mut stages = Stages::default();
    let response = timed(&mut stages.response_s, || {
        let progress = |done, total| observer.event(Event::Table { done, total });
        responses.get(recipe, &progress)
    })?;
    let (camera, scene, warnings) = timed(&mut stages.scene_s, || {
        let camera = assemble::camera(recipe, &response)?;
        let framing = assemble::framing_camera(recipe, &response)?;
        let framing = framing.as_ref().unwrap_or(&camera);
        let (scene, warnings) = assemble::scene_and_warnings(recipe, framing)?;
        Ok::<_, RecipeError>((camera, scene, warnings))
    })?;
    let beyond = camera.chief_rays_beyond();
    if beyond > 0.0 {
        responses.warn(format!(
            "chief rays of {:.1} % of the window lie beyond the last one that the response holds a microlens shift for; its shift is taken there",
            100.0 * beyond
        ));
    }
    Ok(Prepared {
        recipe: recipe.clone(),
        response,
        camera,
        scene,
        warnings,
        stages,
    })
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
    /// Exposes it by `ev` stops.
    pub fn expose(&mut self, ev: f64) {
        self.recipe.exposure_ev = ev;
    }

    /// Renders it. The record is there if it was asked for.
    ///
    /// # Errors
    /// A record of another camera, or one that would be too large.
    pub fn render(
        self,
        id: SampleId,
        rays: Rays,
        observer: &dyn Observer,
    ) -> Result<(Sample, Option<RayRecord>), SampleError> {
        let Self {
            recipe,
            response,
            camera,
            scene,
            warnings,
            mut stages,
        } = self;
        let mut chief = ChiefRays::new(&camera);
        let mut geometry = timed(&mut stages.truth_s, || chief.geometry(&camera, &scene));
        // Kept rays are those of the whole camera, whatever pixel is put behind it later.
        let choice = match (&rays, recipe.effects.is_auto()) {
            (Rays::Keep | Rays::Develop(_), true) => Choice::All,
            _ => recipe.effects.clone(),
        };
        let depths_mm = planned::depth_range_mm(&geometry.depth_mm);
        let planned = timed(&mut stages.effects_s, || {
            let whole = Shot { camera, scene };
            plan(whole, depths_mm, &recipe.render, &choice, &recipe.tolerance)
        });
        let Planned {
            shot: Shot { camera, scene },
            mut decisions,
            together,
        } = planned;
        // Without aberrations, what a pixel sees has moved.
        let lens_left_out =
            |d: &Decision| d.effect == Effect::Aberrations && d.verdict.is_left_out();
        if decisions.iter().any(lens_left_out) {
            chief = ChiefRays::new(&camera);
            geometry = timed(&mut stages.truth_s, || chief.geometry(&camera, &scene));
        }
        let several = scene.planes().len() > 1 || scene.world().is_some();
        let surfaces = several.then_some(geometry.surfaces.as_slice());
        let shot = Render::new(&camera, &scene, &recipe.render)
            .occlusion(surfaces)
            .progress(&observer);
        let (rendered, record) = timed(&mut stages.rays_s, || match rays {
            Rays::Trace => Ok((shot.run(), None)),
            Rays::Keep => (shot.run_recorded()).map(|(rendered, record)| (rendered, Some(record))),
            Rays::Develop(record) => record.develop(&camera).map(|rendered| (rendered, None)),
        })?;
        let began = std::time::Instant::now();
        let white = WhiteField::new(&camera);
        let (Some(field), Some(defocus)) = (
            DisparityField::new(&camera, ChannelWavelengths::REFERENCE),
            Defocus::new(&camera),
        ) else {
            unreachable!("a camera with a lens has a focus");
        };

        let gain = recipe.exposure_ev.exp2() / white.reference_sr();
        let mut mosaic = rendered.image;
        mosaic.scale(gain as f32);
        let mut target = chief.target(&camera, &scene, &white, &recipe.render);
        // Where there is no chief ray the target is black, and `valid` says so.
        target
            .data_mut()
            .iter_mut()
            .for_each(|x| *x = if x.is_nan() { 0.0 } else { *x * gain as f32 });
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        let pitch_mm = camera.sensor().pitch_mm();
        let per_pixel = |f: &dyn Fn(f32) -> f32| {
            let data = geometry.depth_mm.data().iter().map(|&d| f(d)).collect();
            Image::from_vec(width, height, 1, data)
                .unwrap_or_else(|| unreachable!("one value a pixel"))
        };
        let coc_px =
            per_pixel(&|d| (defocus.circle_of_confusion_mm(f64::from(d)) / pitch_mm) as f32);
        let metres = |image: &Image| {
            let mut image = image.clone();
            image
                .data_mut()
                .iter_mut()
                .for_each(|x| *x *= M_PER_MM as f32);
            image
        };
        let valid = geometry
            .depth_mm
            .data()
            .iter()
            .map(|d| !d.is_nan())
            .collect();
        let seen = scene.world().is_some().then(|| {
            let normals = per_spec_frame(&geometry.normals);
            (geometry.surfaces.clone(), normals)
        });
        let expose = |settings| Noisy::expose(settings, &mosaic, &camera, &white, gain);
        let readout = recipe.readout.as_ref();
        let noise = planned::noise(readout, &choice, camera.sensor(), &white);
        let readout = readout.filter(|_| !noise.verdict.is_left_out());
        decisions.push(noise);
        let noisy = readout.map(expose).transpose().map_err(RecipeError::from)?;
        let noise = noisy.as_ref().map(Noisy::description);
        let exposed = Exposed {
            gain,
            white_sr: white.middle_sr(),
            stats: &rendered.stats,
            effects: ledger(&recipe, &camera, &response, &decisions, &recipe.tolerance),
            noise: noise.map_or(spec::Noise::None, spec::Noise::Readout),
        };
        let description = describe(&recipe, id, &camera, &response, exposed)?;
        let disparity = field.maps(&camera, &geometry.depth_mm);
        stages.truth_s += began.elapsed().as_secs_f64();
        let sample = Sample {
            stages,
            target,
            depth_m: metres(&geometry.depth_mm),
            distance_m: metres(&geometry.distance_mm),
            disparity,
            coc_px,
            occlusion: rendered
                .occlusion
                .unwrap_or_else(|| Image::zeros(width, height, 1)),
            valid,
            noisy,
            seen,
            warnings,
            description,
            decisions,
            together,
            mosaic,
        };
        Ok((sample, record))
    }
}

/// Directions in the layout's frame, whose Z runs into the scene.
fn per_spec_frame(normals: &Image) -> Image {
    let mut normals = normals.clone();
    for n in normals.data_mut().chunks_exact_mut(3) {
        // Written as a difference, so that no −0 is stored.
        n[2] = 0.0 - n[2];
    }
    normals
}

impl Sample {
    /// Where the time went.
    pub fn stages(&self) -> Stages {
        self.stages
    }

    /// What was left out of its scene.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Which effects it was rendered with, and why.
    pub fn decisions(&self) -> &[Decision] {
        &self.decisions
    }

    /// What the effects that were left out, if they are several, do together.
    pub fn left_out_together(&self) -> Option<Estimate> {
        self.together
    }

    /// Its description.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// What the writer takes.
    pub fn files(&self) -> SampleFiles<'_> {
        let share = 1.0 / self.mosaic.subpixels.count() as f32;
        SampleFiles {
            raw: &self.mosaic.mosaic,
            raw_encoding: RawEncoding::Png(Levels::full_range(RAW_HEADROOM * share)),
            target: &self.target,
            depth_m: &self.depth_m,
            distance_m: Some(&self.distance_m),
            traced_px: &self.disparity.traced,
            paraxial_px: &self.disparity.paraxial,
            coc_px: &self.coc_px,
            occlusion: &self.occlusion,
            noisy: self.noisy.as_ref().map(Noisy::files),
            valid: &self.valid,
            seen: self
                .seen
                .as_ref()
                .map(|(objects, normals)| Seen { objects, normals }),
            description: self.description.clone(),
        }
    }
}
