//! The camera that was put together last: many pictures are taken through one lens, with one focus.

use std::sync::{Arc, OnceLock};

use quadpixel::lens::{Lens, ReflectionSettings};
use quadpixel::render::Camera;
use quadpixel::render::truth::DisparityField;
use quadpixel::response::Response;
use quadpixel::spectrum::Bands;
use quadpixel_datasets::CameraCurves;

use super::camera::camera_behind;
use super::{Responses, lens};
use crate::recipe::{Recipe, RecipeError, SensorRecipe};

/// What is known of a camera whatever it is shown: found with its first picture.
#[derive(Default)]
pub(crate) struct OfCamera {
    fields: OnceLock<Vec<DisparityField>>,
    curves: OnceLock<CameraCurves>,
}

impl OfCamera {
    /// The disparity of its channels; `found`, where it is the first time.
    pub fn fields(&self, found: impl FnOnce() -> Vec<DisparityField>) -> Vec<DisparityField> {
        self.fields.get_or_init(found).clone()
    }

    /// Its curves; `found`, where it is the first time.
    pub fn curves(&self, found: impl FnOnce() -> CameraCurves) -> CameraCurves {
        self.curves.get_or_init(found).clone()
    }
}

/// A camera, and what it is made of.
pub(super) struct Kept {
    /// As it is focused and stopped down.
    lens: Lens,
    reflections: ReflectionSettings,
    sensor: SensorRecipe,
    spectrum: Option<Bands>,
    response: Arc<Response>,
    camera: Camera,
    known: Arc<OfCamera>,
}

impl Kept {
    fn has(&self, response: &Arc<Response>) -> bool {
        // A table is large, a box is made anew each time.
        let is_box = matches!(**response, Response::Geometric(_));
        Arc::ptr_eq(&self.response, response) || is_box && self.response == *response
    }

    fn is_of(&self, recipe: &Recipe, lens: &Lens, response: &Arc<Response>) -> bool {
        self.lens == *lens
            && self.reflections == recipe.lens.reflections
            && self.sensor == recipe.sensor
            && self.spectrum == recipe.spectrum
            && self.has(response)
    }
}

impl Responses {
    /// The camera of a recipe with its response, and what is known of it; those of the last one where it is the same.
    ///
    /// # Errors
    /// What a field of the recipe is and may be.
    pub(crate) fn camera(
        &mut self,
        recipe: &Recipe,
        response: &Arc<Response>,
    ) -> Result<(Camera, Arc<OfCamera>), RecipeError> {
        let lens = lens(&recipe.lens)?;
        let kept = self.camera.as_ref();
        if let Some(kept) = kept.filter(|kept| kept.is_of(recipe, &lens, response)) {
            return Ok((kept.camera.clone(), kept.known.clone()));
        }
        let camera = camera_behind(&lens, recipe, response)?;
        let known = Arc::<OfCamera>::default();
        self.camera = Some(Kept {
            lens,
            reflections: recipe.lens.reflections,
            sensor: recipe.sensor.clone(),
            spectrum: recipe.spectrum,
            response: response.clone(),
            camera: camera.clone(),
            known: known.clone(),
        });
        Ok((camera, known))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::config::{DEFAULT_TOML, DatasetConfig};
    use crate::draw;

    #[test]
    fn a_change_of_any_part_makes_another_camera_and_none_the_same() {
        let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "t").unwrap();
        config.response = toml::from_str("model = \"geometric\"").unwrap();
        config.sensor.pitch_um = Some(serde_json::from_str("2.8").unwrap());
        let first = draw::recipe(&config, 0, &|_| Ok(1.6)).unwrap();
        let mut responses = Responses::new();
        let response = responses.get(&first, &|_, _| ()).unwrap();
        let changed = |change: &dyn Fn(&mut Recipe)| {
            let mut recipe = first.clone();
            change(&mut recipe);
            recipe
        };
        let recipes = [
            changed(&|_| ()),
            changed(&|r| r.lens.focus_mm = Some(1234.5)),
            changed(&|r| r.lens.f_number = Some(5.6)),
            changed(&|r| r.lens.reflections.sensor = 0.3),
            changed(&|r| r.sensor.width += 2),
            changed(&|r| r.spectrum = Some(Bands::default())),
        ];
        let looks = |camera: &Camera| {
            let tenth = camera.sensor().position_mm(10.0, 10.0);
            format!(
                "{} {:?} {:?} {:?} {:?}",
                camera.focus_distance_mm(),
                camera.wavelengths(),
                camera.sensor(),
                camera.pupil_at(tenth),
                camera.without_reflections().is_some(),
            )
        };
        for recipe in &recipes {
            let (_, of_first) = responses.camera(&first, &response).unwrap();
            let fresh = super::super::camera::camera(recipe, &response).unwrap();
            let (camera, known) = responses.camera(recipe, &response).unwrap();
            assert_eq!(looks(&camera), looks(&fresh));
            assert_eq!(Arc::ptr_eq(&known, &of_first), *recipe == first);
            // A box of the same size.
            let again = Arc::new(response.as_ref().clone());
            let (camera, kept) = responses.camera(recipe, &again).unwrap();
            assert_eq!(looks(&camera), looks(&fresh));
            assert!(Arc::ptr_eq(&known, &kept));
        }
        let different = recipes.iter().filter(|recipe| **recipe != first);
        assert_eq!(different.count(), recipes.len() - 1);
    }
}
