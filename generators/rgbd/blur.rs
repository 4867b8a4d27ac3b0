//! Whether a picture's blur is larger than the picture: found before a batch, by the lens's paraxial figures.

use quadpixel::render::truth::Defocus;
use quadpixel::rgbd::DepthPicture;
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel::units::{M_PER_MM, MM_PER_UM};
use rayon::prelude::*;

use crate::assemble;
use crate::recipe::{Recipe, RecipeError};

/// Depths that are kept of a picture, from the nearest to the farthest, even in their number.
const KEPT: usize = 257;
/// What a point in focus takes of a kernel beside its circle of confusion, px.
const FOOTPRINT_PX: f64 = 2.0;

/// The depths of a picture in few numbers, and its size.
#[derive(Clone, Debug, PartialEq)]
pub struct Depths {
    kept_mm: Vec<f64>,
    shorter_px: usize,
}

/// A blur that is larger than its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooLarge {
    /// Circle of confusion of the nearest or the farthest depth, px.
    pub coc_px: f64,
    /// That depth, m.
    pub depth_m: f64,
    /// The depth in focus, m.
    pub focus_m: f64,
    /// Shorter side of the picture, px.
    pub shorter_px: usize,
}

impl std::fmt::Display for TooLarge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "a point at {:.3} m is blurred over {:.0} px by a lens focused at {:.3} m; allowed: less than the picture's \
             shorter side, {} px; a larger picture, a smaller aperture, or a focus nearer to the scene",
            self.depth_m, self.coc_px, self.focus_m, self.shorter_px
        )
    }
}

impl Depths {
    /// Of a picture.
    pub fn of(picture: &DepthPicture) -> Self {
        let depth = picture.depth_mm();
        let known = depth.data().iter().copied().filter(|d| !d.is_nan());
        let mut known: Vec<f32> = known.collect();
        known.par_sort_unstable_by(f32::total_cmp);
        let last = known.len() - 1; // a picture has a depth that is known
        let kept = |k: usize| f64::from(known[k * last / (KEPT - 1)]);
        Self {
            kept_mm: (0..KEPT).map(kept).collect(),
            shorter_px: depth.width().min(depth.height()),
        }
    }

    /// Whether a recipe's camera blurs the nearest or the farthest of them over more than the picture. What is a few px
    /// less may still be refused when it is converted: there the kernels are traced.
    ///
    /// # Errors
    /// A lens that cannot be built.
    pub fn blurred_beyond(&self, recipe: &Recipe) -> Result<Option<TooLarge>, RecipeError> {
        let lens = assemble::lens(&recipe.lens)?;
        let share = recipe.rgbd.as_ref().and_then(|rgbd| rgbd.focus_share);
        let focus_mm = match share {
            Some(share) => self.kept_mm[(share.clamp(0.0, 1.0) * (KEPT - 1) as f64) as usize],
            None => recipe.lens.focus_mm.unwrap_or(f64::INFINITY),
        };
        let paraxial = lens.paraxial(ChannelWavelengths::default().reference_nm())?;
        let defocus = Defocus::of_focused(&paraxial, focus_mm);
        let pitch_mm = recipe.sensor.pitch_um * MM_PER_UM;
        let found = [self.kept_mm[0], self.kept_mm[KEPT - 1]].map(|depth_mm| {
            let coc_px = defocus.circle_of_confusion_mm(depth_mm).abs() / pitch_mm;
            TooLarge {
                coc_px,
                depth_m: depth_mm * M_PER_MM,
                focus_m: focus_mm * M_PER_MM,
                shorter_px: self.shorter_px,
            }
        });
        let beyond = |t: &TooLarge| t.coc_px + FOOTPRINT_PX >= self.shorter_px as f64;
        Ok(found.into_iter().find(beyond))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use quadpixel::image::Image;

    use super::*;
    use crate::recipe::parse_recipe;

    fn recipe(focus_mm: f64) -> Recipe {
        let text = format!(
            r#"
            environment = [0, 0, 0]
            planes = []
            lens = {{ name = "wide_US20120327520A1_emb3", focus_mm = {focus_mm} }}
            sensor = {{ pitch_um = 2.8, subpixels = "2x2", width = 30, height = 20, window = {{ at = "centre" }} }}
            response = {{ model = "geometric" }}
            render = {{ rays_per_pixel = 16, seed = 3 }}
            "#
        );
        parse_recipe(&text, "a camera").unwrap()
    }

    #[test]
    fn the_nearest_depth_says_whether_a_picture_is_blurred_beyond_itself() {
        let image = |channels, value: &dyn Fn(usize) -> f32| {
            let data = (0..30 * 20 * channels).map(value).collect();
            Image::from_vec(30, 20, channels, data).unwrap()
        };
        let depths = |near_mm: f32| {
            let depth = image(1, &|i| match i {
                0 => f32::NAN,
                1..40 => near_mm,
                _ => 700.0,
            });
            Depths::of(&DepthPicture::new(image(3, &|_| 0.5), depth).unwrap())
        };
        let beyond = |near_mm, focus_mm| depths(near_mm).blurred_beyond(&recipe(focus_mm)).unwrap();
        assert_eq!(beyond(500.0, 600.0), None);
        let found = beyond(15.0, 600.0).unwrap();
        assert_eq!((found.shorter_px, found.focus_m), (20, 0.6));
        // A thin lens of 4.2 mm at F/2.5 blurs by f²/N |1/d − 1/s| = 0.46 mm, 164 px; depths here are from the first
        // surface, not the principal plane.
        assert!((120.0..180.0).contains(&found.coc_px), "{found}");
        assert!((found.depth_m - 0.015).abs() < 1e-9);
    }
}
