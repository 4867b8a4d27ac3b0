//! Whether a picture's blur is larger than the picture: found before a batch, by the lens's paraxial figures.

use quadpixel::render::truth::Defocus;
use quadpixel::rgbd::DepthPicture;
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel::units::MM_PER_UM;

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
            "a point at {:.3} m is blurred over {:.0} px by a lens focused at {:.3} m; allowed: less than the picture's shorter \
             side, {} px; a larger picture, a smaller aperture, or a focus nearer to the scene",
            self.depth_m, self.coc_px, self.focus_m, self.shorter_px
        )
    }
}

impl Depths {
    /// Of a picture.
    pub fn of(picture: &DepthPicture) -> Self {
        let share = |k: usize| k as f64 / (KEPT - 1) as f64;
        let light = picture.light();
        Self {
            kept_mm: (0..KEPT)
                .map(|k| picture.depth_quantile_mm(share(k)))
                .collect(),
            shorter_px: light.width().min(light.height()),
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
                depth_m: 1e-3 * depth_mm,
                focus_m: 1e-3 * focus_mm,
                shorter_px: self.shorter_px,
            }
        });
        let beyond = |t: &TooLarge| t.coc_px + FOOTPRINT_PX >= self.shorter_px as f64;
        Ok(found.into_iter().find(beyond))
    }
}
