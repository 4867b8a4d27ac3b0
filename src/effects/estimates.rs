//! What leaving effects out does to one shot, each estimate by what the whole shows.

use super::shift::{ReferenceViews, SubpixelViews};
use super::signal::{Look, Probes};
use super::{Effect, Estimate, Shot, Tolerance};
use crate::render::RenderSettings;

/// Compares subjects with the whole. What the whole shows is looked at when it is first asked for.
pub(super) struct EffectEstimates<'a> {
    whole: &'a Shot,
    depths_mm: [f64; 2],
    settings: &'a RenderSettings,
    views: Option<ReferenceViews>,
    probes: Option<Probes>,
    /// For effects that move the rays.
    moved_probes: Option<Probes>,
}

impl<'a> EffectEstimates<'a> {
    pub fn new(whole: &'a Shot, depths_mm: [f64; 2], settings: &'a RenderSettings) -> Self {
        Self {
            whole,
            depths_mm,
            settings,
            views: None,
            probes: None,
            moved_probes: None,
        }
    }

    /// What leaving out an effect, and perhaps others before it, does. `decides`: what tells it from the tolerance is
    /// enough.
    pub fn estimate(
        &mut self,
        effect: Effect,
        less: &Shot,
        tolerance: &Tolerance,
        decides: bool,
    ) -> Estimate {
        // Only a camera moves what is seen; bare pixels have no picture to be moved.
        let moves = effect != Effect::GlobalIllumination && self.whole.camera.paraxial().is_some();
        let shift_px = moves.then(|| {
            let camera = &self.whole.camera;
            let views = (self.views).get_or_insert_with(|| ReferenceViews::new(camera));
            views.largest_shift_px(&SubpixelViews::new(&less.camera), self.depths_mm)
        });
        let is_decided = decides && shift_px.is_some_and(|s| s >= tolerance.shift_px);
        let signal_percent =
            (!is_decided).then(|| self.signal_percent(effect, less, tolerance, decides));
        Estimate {
            signal_percent,
            shift_px,
        }
    }

    fn signal_percent(
        &mut self,
        effect: Effect,
        less: &Shot,
        tolerance: &Tolerance,
        decides: bool,
    ) -> f64 {
        let (whole, settings) = (self.whole, self.settings);
        let moves_rays = effect == Effect::LensDiffraction;
        if decides || !moves_rays {
            let same = self
                .probes
                .get_or_insert_with(|| Probes::new(whole, settings, Look::Same));
            let found = same.difference(less);
            if !moves_rays || 100.0 * found.at_least > tolerance.signal_percent {
                return 100.0 * found.at_most;
            }
        }
        let moved = || Probes::new(whole, settings, Look::Moved);
        let moved = self.moved_probes.get_or_insert_with(moved);
        100.0 * moved.difference(less).at_most
    }
}
