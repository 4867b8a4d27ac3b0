//! A sample of a picture with depth: converted by kernels or rays, with the truths of every sample.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use quadpixel::effects::{Choice, Planned, Shot, plan};
use quadpixel::image::Image;
use quadpixel::render::RenderStats;
use quadpixel::render::truth::{DisparityField, SightRays, WhiteField};
use quadpixel::rgbd::{Conversion, Converted, DepthPicture, RgbdError};
use quadpixel_datasets as spec;

use super::exposure::{Exposure, Known, Shown};
use super::planned::depth_range_mm;
use super::prepared::{Prepared, Rays, SampleError};
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

/// A picture that is being converted: its camera, and what all rows share.
pub(super) struct Begun {
    pub prepared: Prepared,
    picture: DepthPicture,
    rgbd: RgbdRecipe,
    fields: Vec<DisparityField>,
    sight: SightRays,
    choice: Choice,
    planned: Planned,
}

impl Begun {
    /// `rays`: they have to be traced.
    pub fn new(mut prepared: Prepared, rays: &Rays) -> Result<Self, SampleError> {
        let refused = RecipeError::Incomplete(
            "rgbd: its rays are not kept; allowed: without --keep-rays and --from-rays",
        );
        let (Rays::Trace, Some(picture), Some(rgbd)) =
            (rays, prepared.picture.take(), prepared.recipe.rgbd.clone())
        else {
            return Err(refused.into());
        };
        let choice = match prepared.recipe.effects.is_auto() {
            true => Choice::All,
            false => prepared.recipe.effects.clone(),
        };
        let camera = &prepared.camera;
        let whole = Shot {
            // The light beside the picture, which ghosts may come from, is not known.
            camera: camera
                .without_reflections()
                .unwrap_or_else(|| camera.clone()),
            scene: prepared.scene().clone(),
        };
        let depths_mm = depth_range_mm(picture.depth_mm());
        let (settings, tolerance) = (prepared.recipe.render, prepared.recipe.tolerance);
        let planned = timed(&mut prepared.stages.effects_s, || {
            plan(whole, depths_mm, &settings, &choice, &tolerance)
        });
        prepared.camera = planned.shot.camera.clone();
        if choice != Choice::All || rgbd.level != Level::Psf {
            // Of another camera, perhaps.
            prepared.known = Arc::default();
        }
        if rgbd.level == Level::Rays {
            let tracing = prepared.recipe.lens_tracing;
            let maps_for = prepared.maps_for;
            prepared.camera = timed(&mut prepared.stages.scene_s, || {
                (prepared.camera).with_lens_maps(&tracing, maps_for)
            });
            let warning = lens_tracing::warning(&prepared.camera);
            prepared.warnings.extend(warning);
        }
        let camera = &prepared.camera;
        let registration = prepared.recipe.registration;
        let (fields, sight) = timed(&mut prepared.stages.truth_s, || {
            let fields = prepared.known.fields(|| {
                DisparityField::of_channels(camera)
                    .unwrap_or_else(|| unreachable!("a camera with a lens has a focus"))
            });
            let sight = match registration {
                spec::Registration::Centroid => SightRays::centroids(&fields),
                spec::Registration::ChiefRay => SightRays::chief_rays(camera),
            };
            (fields, sight)
        });
        Ok(Self {
            prepared,
            picture,
            rgbd,
            fields,
            sight,
            choice,
            planned,
        })
    }

    pub fn conversion(&self) -> Conversion<'_> {
        let camera = &self.prepared.camera;
        Conversion::new(camera, &self.sight, &self.fields, &self.picture)
    }

    pub fn refused(&self, cause: RgbdError) -> SampleError {
        RecipeError::from(self.rgbd.pair(cause)).into()
    }

    /// The exposure of what so many rays are traced for, and the picture.
    pub fn exposure(
        self,
        id: SampleId,
        rays: u64,
    ) -> Result<(Exposure, DepthPicture), SampleError> {
        let known = Known {
            white: WhiteField::from_fields(&self.prepared.camera, &self.fields),
            fields: self.fields,
            sight: self.sight,
            choice: self.choice,
            decisions: self.planned.decisions,
            left_out_together: self.planned.together,
            stats: RenderStats {
                rays,
                exact_rays: rays,
                ..RenderStats::default()
            },
        };
        Ok((Exposure::new(self.prepared, id, known)?, self.picture))
    }
}

/// What was converted, with its truth: of all rows, or of some.
pub(super) fn shown(
    exposure: &Exposure,
    picture: &DepthPicture,
    converted: Converted,
    rows: Option<Range<usize>>,
) -> Shown {
    let camera = &exposure.prepared.camera;
    let part = rows.clone().map(|rows| camera.rows(rows));
    let camera = part.as_ref().unwrap_or(camera);
    let depth_mm = known_depths(picture, &converted.made_up, camera.sensor().first_row());
    Shown {
        rows,
        image: converted.image,
        occlusion: Some(converted.occlusion),
        target: converted.target,
        geometry: exposure.known.sight.geometry_at(camera, depth_mm),
    }
}

impl Prepared {
    /// The sample of its picture.
    pub(super) fn convert(
        self,
        id: SampleId,
        rays: &Rays,
        observer: &dyn Observer,
    ) -> Result<Sample, SampleError> {
        let mut begun = Begun::new(self, rays)?;
        let began = Instant::now();
        let converted = match begun.rgbd.level {
            Level::Psf => {
                let converted = begun.conversion().run();
                observer.event(Event::Rays(begun.prepared.recipe.rays()));
                converted
            }
            Level::Rays => {
                let settings = begun.prepared.recipe.render;
                begun.conversion().trace(&settings, &observer)
            }
        };
        let converted = converted.map_err(|cause| begun.refused(cause))?;
        begun.prepared.stages.rays_s += began.elapsed().as_secs_f64();
        let began = Instant::now();
        let (mut exposure, picture) = begun.exposure(id, converted.rays)?;
        let shown = shown(&exposure, &picture, converted, None);
        let pictures = exposure.pictures(shown);
        let mut sample = exposure.sample(pictures);
        sample.made.stages.truth_s += began.elapsed().as_secs_f64();
        Ok(sample)
    }
}

/// Depths of rows from the `first` on, where they are known and most of the light is of places that are.
fn known_depths(picture: &DepthPicture, made_up: &Image, first: usize) -> Image {
    let depth = picture.depth_mm();
    let (width, count) = (depth.width(), made_up.data().len());
    let depths = depth.data()[first * width..][..count].iter();
    let known = |(depth, share): (&f32, &f32)| match RgbdRecipe::is_known(*share) {
        true => *depth,
        false => f32::NAN,
    };
    let data = depths.zip(made_up.data()).map(known).collect();
    Image::from_vec(width, count / width, 1, data)
        .unwrap_or_else(|| unreachable!("a depth per share"))
}
