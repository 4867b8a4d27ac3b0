//! What numbers of a recipe may be, said before the first ray and not by what they do to the picture.

use super::{Recipe, RecipeError};
use crate::field_error::FieldError;

/// Most stops of exposure, up or down: beyond, no light is left or none fits.
const LARGEST_EV: f64 = 64.0;
/// Of a lens that is stopped down.
pub(crate) const F_NUMBERS: std::ops::RangeInclusive<f64> = 0.5..=64.0;

impl Recipe {
    /// Checks the numbers that no part of the camera checks when it is made.
    ///
    /// # Errors
    /// The first field that is out of its range.
    pub(crate) fn check(&self) -> Result<(), RecipeError> {
        let rays = self.render.rays_per_pixel;
        if !(1..=1 << 24).contains(&rays) {
            return Err(FieldError::new("render.rays_per_pixel", rays, "1 to 16777216").into());
        }
        let ev = self.exposure_ev;
        if !(-LARGEST_EV..=LARGEST_EV).contains(&ev) {
            return Err(FieldError::new("exposure_ev", ev, "-64 to 64 stops").into());
        }
        let positive = |field: &'static str, value: Option<f64>| match value {
            Some(value) if !(value.is_finite() && value > 0.0) => {
                Err(FieldError::new(field, value, "a positive number"))
            }
            _ => Ok(()),
        };
        if let Some(f_number) = self.lens.f_number.filter(|f| !F_NUMBERS.contains(f)) {
            return Err(FieldError::new("lens.f_number", f_number, "0.5 to 64").into());
        }
        positive("lens.focus_mm", self.lens.focus_mm)?;
        positive("framing_focus_mm", self.framing_focus_mm)?;
        positive("sensor.pitch_um", Some(self.sensor.pitch_um))?;
        let paths = self.world.as_ref().map(|world| world.paths);
        let clamp = paths.and_then(|paths| paths.clamp).map(f64::from);
        positive("world.paths.clamp", clamp)?;
        if let Some(pictures) = &self.camera_pictures {
            pictures.check(self.readout.is_some())?;
        }
        let light = |v: &f32| v.is_finite() && *v >= 0.0;
        match self.environment.iter().find(|v| !light(v)) {
            Some(dark) => {
                Err(FieldError::new("environment", dark, "finite light, not negative").into())
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use crate::recipe::parse_recipe;

    #[test]
    fn a_number_that_would_spoil_the_picture_is_named_before_the_first_ray() {
        let text = include_str!("../../cli/qpgen/scene.toml");
        let sound = parse_recipe(text, "t").unwrap();
        sound.check().unwrap();
        for (field, spoil) in [
            (
                "exposure_ev",
                (|r| r.exposure_ev = f64::NAN) as fn(&mut super::Recipe),
            ),
            ("exposure_ev", |r| r.exposure_ev = 1e3),
            ("lens.f_number", |r| r.lens.f_number = Some(-1.0)),
            ("lens.f_number is 1000", |r| r.lens.f_number = Some(1000.0)),
            ("lens.focus_mm", |r| r.lens.focus_mm = Some(f64::NAN)),
            ("sensor.pitch_um", |r| r.sensor.pitch_um = 0.0),
            ("environment", |r| r.environment[1] = f32::INFINITY),
            ("render.rays_per_pixel", |r| r.render.rays_per_pixel = 0),
        ] {
            let mut recipe = sound.clone();
            spoil(&mut recipe);
            let text = recipe.check().unwrap_err().to_string();
            assert!(text.starts_with(field), "{field}: {text}");
        }
    }
}
