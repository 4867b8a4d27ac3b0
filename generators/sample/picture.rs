//! A sample of a picture with depth: converted by kernels or rays, with the truths of every sample.

use std::time::Instant;

use quadpixel::effects::{Choice, Shot, plan};
use quadpixel::image::Image;
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField};
use quadpixel::render::{RenderStats, Rendered, SubPixelImage};
use quadpixel::rgbd::{Conversion, DepthPicture};
use quadpixel_datasets as spec;

use super::planned::depth_range_mm;
use super::prepared::{Prepared, Rays, SampleError, Shown};
use super::rendered::Sample;
use super::stages::timed;
use crate::field_error::FieldError;
use crate::lens_tracing;
use crate::observer::{Event, Observer};
use crate::recipe::{Recipe, RecipeError, SampleId};
use crate::rgbd::{Level, RgbdRecipe};

/// The recipe of a picture, with its focus at a depth of the picture where it asks so.
///
/// # Errors
/// A picture that is not of the sensor window's size.
pub(super) fn resolved(recipe: &Recipe, picture: &DepthPicture) -> Result<Recipe, RecipeError> {
    let mut resolved = recipe.clone();
    let Some(rgbd) = &recipe.rgbd else {
        return Err(RecipeError::Incomplete(
            "rgbd is absent; allowed: what the picture's numbers mean",
        ));
    };
    let (width, height) = (picture.light().width(), picture.light().height());
    if (width, height) != (recipe.sensor.width, recipe.sensor.height) {
        let window = format!("{} x {}", recipe.sensor.width, recipe.sensor.height);
        let allowed = format!("{width} x {height}, the size of {}", rgbd.image);
        return Err(FieldError::new("sensor.width x height", window, allowed).into());
    }
    if let Some(share) = rgbd.focus_share {
        let focus_mm = picture.depth_quantile_mm(share);
        resolved.lens.focus_mm = focus_mm.is_finite().then_some(focus_mm);
    }
    Ok(resolved)
}

impl Prepared {
    /// The sample of its picture.
    pub(super) fn convert(
        mut self,
        id: SampleId,
        rays: &Rays,
        observer: &dyn Observer,
    ) -> Result<Sample, SampleError> {
        let refused = RecipeError::Incomplete(
            "rgbd: its rays are not kept; allowed: without --keep-rays and --from-rays",
        );
        let (Rays::Trace, Some(picture), Some(rgbd)) =
            (rays, self.picture.take(), self.recipe.rgbd.clone())
        else {
            return Err(refused.into());
        };
        let choice = match self.recipe.effects.is_auto() {
            true => Choice::All,
            false => self.recipe.effects.clone(),
        };
        let whole = Shot {
            // The light beside the picture, which ghosts may come from, is not known.
            camera: (self.camera.without_reflections()).unwrap_or_else(|| self.camera.clone()),
            scene: self.scene().clone(),
        };
        let depths_mm = depth_range_mm(picture.depth_mm());
        let (settings, tolerance) = (self.recipe.render, self.recipe.tolerance);
        let planned = timed(&mut self.stages.effects_s, || {
            plan(whole, depths_mm, &settings, &choice, &tolerance)
        });
        self.camera = planned.shot.camera;
        if rgbd.level == Level::Rays {
            let tracing = self.recipe.lens_tracing;
            self.camera = timed(&mut self.stages.scene_s, || {
                (self.camera).with_lens_maps(&tracing, self.maps_for)
            });
            self.warnings.extend(lens_tracing::warning(&self.camera));
        }
        let camera = &self.camera;
        let began = Instant::now();
        let fields = DisparityField::of_channels(camera)
            .unwrap_or_else(|| unreachable!("a camera with a lens has a focus"));
        let sight = match self.recipe.registration {
            spec::Registration::Centroid => SightRays::centroids(&fields),
            spec::Registration::ChiefRay => SightRays::chief_rays(camera),
        };
        self.stages.truth_s += began.elapsed().as_secs_f64();
        let began = Instant::now();
        let conversion = Conversion::new(camera, &sight, &fields, &picture);
        let converted = match rgbd.level {
            Level::Psf => {
                let converted = conversion.run();
                observer.event(Event::Rays(self.recipe.rays()));
                converted
            }
            Level::Rays => conversion.trace(&settings, &observer),
        };
        let converted = converted.map_err(|cause| RecipeError::from(rgbd.pair(cause)))?;
        self.stages.rays_s += began.elapsed().as_secs_f64();
        let began = Instant::now();
        let geometry = sight.geometry_at(camera, known_depths(&picture, &converted.made_up));
        let shown = Shown {
            rendered: rendered(converted.image, converted.occlusion, converted.rays),
            target: Some(converted.target),
            white: WhiteField::from_fields(camera, &fields),
            fields,
            sight,
            geometry,
            choice,
            decisions: planned.decisions,
            left_out_together: planned.together,
        };
        let mut sample = self.exposed(id, shown)?;
        sample.stages.truth_s += began.elapsed().as_secs_f64();
        Ok(sample)
    }
}

/// Depths where they are known and most of the light is of places that are.
fn known_depths(picture: &DepthPicture, made_up: &Image) -> Image {
    let mut depth = picture.depth_mm().clone();
    for (depth, share) in depth.data_mut().iter_mut().zip(made_up.data()) {
        if !RgbdRecipe::is_known(*share) {
            *depth = f32::NAN;
        }
    }
    depth
}

fn rendered(image: SubPixelImage, occlusion: Image, rays: u64) -> Rendered {
    Rendered {
        image,
        occlusion: Some(occlusion),
        stats: RenderStats {
            rays,
            exact_rays: rays,
            ..RenderStats::default()
        },
    }
}
