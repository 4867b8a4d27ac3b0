//! Layers of inverse depth: as many as the blur grows pixels over the range, even in 1/D.

use super::error::RgbdError;
use crate::render::Camera;
use crate::render::truth::Defocus;

/// Growth of the circle of confusion from layer to layer, px.
const STEP_PX: f64 = 1.0;
/// Most layers; a range with more is stepped through in larger steps.
const MOST: usize = 256;
/// Jump of the circle of confusion between neighbours, px, that tears the surface: less uncovers nothing to be seen.
const TEAR_PX: f64 = 1.0;

/// Part of a layer before infinity at which what is at infinity has its place.
const BEFORE_INFINITY: f64 = 0.01;
/// Inverse depth of the farthest place where there are no layers, per mm.
const LEAST_PER_MM: f64 = 1e-6;

/// The layers of inverse depth that a picture's depths are sorted into; layer 0 is the nearest.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    nearest_per_mm: f64,
    step_per_mm: f64,
    count: usize,
    /// Circle of confusion per layer, px.
    coc_px: f64,
}

impl Levels {
    /// For the inverse depths from `nearest` to `farthest`, per mm, before a camera.
    ///
    /// # Errors
    /// A camera without a focus.
    pub fn new(camera: &Camera, [nearest, farthest]: [f64; 2]) -> Result<Self, RgbdError> {
        let defocus = Defocus::new(camera).ok_or(RgbdError::Dark)?;
        let pitch_mm = camera.sensor().pitch_mm();
        let coc_px = |t: f64| defocus.circle_of_confusion_mm(1.0 / t) / pitch_mm;
        let growth = (coc_px(farthest) - coc_px(nearest)).abs();
        let intervals = ((growth / STEP_PX).ceil() as usize).clamp(1, MOST - 1);
        let is_flat = nearest <= farthest;
        let count = if is_flat { 1 } else { intervals + 1 };
        Ok(Self {
            nearest_per_mm: nearest,
            step_per_mm: (nearest - farthest) / intervals as f64,
            count,
            coc_px: growth / intervals as f64,
        })
    }

    /// Their inverse depths, per mm, nearest first.
    pub fn inverse_depths_per_mm(&self) -> Vec<f64> {
        let at = |k: usize| self.nearest_per_mm - self.step_per_mm * k as f64;
        (0..self.count).map(|k| at(k).max(0.0)).collect()
    }

    /// Layers.
    pub fn count(&self) -> usize {
        self.count
    }

    /// A depth, mm, in layers behind the nearest.
    #[inline]
    pub fn level(&self, depth_mm: f32) -> f32 {
        if self.count == 1 {
            return 0.0;
        }
        let behind = (self.nearest_per_mm - 1.0 / f64::from(depth_mm)) / self.step_per_mm;
        behind.clamp(0.0, (self.count - 1) as f64) as f32
    }

    /// The depth of a level, mm; what no pixel tells from infinity is as far as that.
    pub(super) fn depth_mm(&self, level: f32) -> f64 {
        let inverse = self.nearest_per_mm - self.step_per_mm * f64::from(level);
        let least = match self.count {
            1 => LEAST_PER_MM,
            _ => BEFORE_INFINITY * self.step_per_mm,
        };
        1.0 / inverse.max(least)
    }

    /// Difference of neighbours, in layers, above which they are two surfaces.
    pub fn tear(&self) -> f32 {
        (TEAR_PX / self.coc_px.max(1e-9)) as f32
    }

    /// How far a surface moves beside one a layer behind it as the pupil is crossed from its middle to its rim, px.
    pub fn parallax_px(&self) -> f64 {
        0.5 * self.coc_px
    }
}
