//! From a choice and a tolerance to what is rendered.

use quadpixel_datasets::{Effects, Reason};

use super::estimates::EffectEstimates;
use super::reflections;
use super::vignetting::lost_light;
use super::{Choice, Effect, Estimate, Shot, Tolerance};
use crate::render::RenderSettings;

/// What becomes of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Simulated: it is above the tolerance, or asked for.
    Simulated,
    /// Simulated: leaving it out would save nothing.
    NoCheaperPath,
    /// Left out: below the tolerance.
    Below,
    /// Left out: not asked for.
    NotAsked,
    /// Not there: there is nothing to simulate or to leave out.
    Absent,
}

impl Verdict {
    /// Whether an effect that is there is not simulated.
    pub fn is_left_out(self) -> bool {
        matches!(self, Self::Below | Self::NotAsked)
    }
}

/// What becomes of one effect, and why.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Decision {
    /// The effect.
    pub effect: Effect,
    /// What becomes of it.
    pub verdict: Verdict,
    /// What leaving it out does or would do, where that was looked at.
    pub estimate: Option<Estimate>,
}

impl Decision {
    /// Enters it into the ledger of a sample, where the effect is there. What an image without it lacks is entered by
    /// `enter_absent`.
    pub fn enter(&self, ledger: &mut Effects, tolerance: &Tolerance) {
        let errors = self.estimate.map_or(Vec::new(), |e| e.errors());
        match self.verdict {
            Verdict::Simulated | Verdict::NoCheaperPath => ledger.simulate(self.effect),
            Verdict::Below => {
                let reason = Reason::BelowTolerance {
                    signal_percent: tolerance.signal_percent,
                    shift_px: tolerance.shift_px,
                };
                ledger.leave_out_at(self.effect, reason, errors);
            }
            Verdict::NotAsked => ledger.leave_out_at(self.effect, Reason::NotChosen, errors),
            Verdict::Absent => self.enter_absent(ledger),
        }
    }

    /// An effect that is not there: what the camera and the scene have in its place.
    fn enter_absent(&self, ledger: &mut Effects) {
        let reason = match self.effect {
            Effect::PixelDiffraction => Reason::GeometricResponse,
            Effect::Dispersion => Reason::NoAbbeNumbers,
            Effect::Wavelengths => Reason::OneTracedWavelength,
            Effect::Noise => Reason::NoReadout,
            Effect::LensDiffraction => Reason::NoAperture,
            Effect::LensReflections => Reason::FullTransmission,
            // A single surface hides nothing, but each ray finds its own.
            Effect::Occlusion => return ledger.simulate(self.effect),
            // Cards send each other no light, and a fixed chief ray is that of the whole window.
            _ => return,
        };
        let errors = self.estimate.map_or(Vec::new(), |e| e.errors());
        ledger.leave_out_at(self.effect, reason, errors);
    }
}

impl std::fmt::Display for Decision {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = match self.verdict {
            Verdict::Simulated => "simulated",
            Verdict::NoCheaperPath => "simulated: no cheaper path",
            Verdict::Below => "left out: below the tolerance",
            Verdict::NotAsked => "left out: not asked for",
            Verdict::Absent => "not there",
        };
        write!(f, "{}: {what}", self.effect.name())?;
        self.estimate.map_or(Ok(()), |e| write!(f, " ({e})"))
    }
}

/// What is rendered, and what became of each effect but noise and the response's colours, which are decided elsewhere.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Without the effects that are left out.
    pub shot: Shot,
    /// One per effect, in the order of [`Effect::SELECTABLE`].
    pub decisions: Vec<Decision>,
    /// What leaving out all those does together, where they are more than one that the scene does not call for.
    pub together: Option<Estimate>,
}

/// Effects with a cheaper path of their own, in the order in which they are tried: first what saves most.
const CANDIDATES: [Effect; 7] = [
    Effect::GlobalIllumination,
    Effect::Dispersion,
    Effect::Wavelengths,
    Effect::Aberrations,
    Effect::CraVariation,
    Effect::PixelDiffraction,
    Effect::LensDiffraction,
];

/// Decides. `depths_mm`: nearest and farthest depth in the picture (+∞ allowed); `settings`: those of the render to
/// come.
///
/// Effects are left out one after the other, and each is compared, together with those before it, with the whole: their
/// sum is below the tolerance too.
///
/// Ghosts are decided on last: they add light, and move none of the rest.
pub fn plan(
    whole: Shot,
    depths_mm: [f64; 2],
    settings: &RenderSettings,
    choice: &Choice,
    tolerance: &Tolerance,
) -> Planned {
    let Some(direct) = whole.without(Effect::LensReflections) else {
        return plan_direct(whole, depths_mm, settings, choice, tolerance);
    };
    let planned = plan_direct(direct, depths_mm, settings, choice, tolerance);
    reflections::decide(&whole, planned, settings, choice, tolerance)
}

/// [`plan`] for a shot without ghosts.
fn plan_direct(
    whole: Shot,
    depths_mm: [f64; 2],
    settings: &RenderSettings,
    choice: &Choice,
    tolerance: &Tolerance,
) -> Planned {
    if *choice == Choice::All {
        let decisions = Effect::SELECTABLE
            .into_iter()
            .filter(|e| !is_decided_elsewhere(*e));
        let decisions = decisions.map(|effect| Decision {
            effect,
            verdict: if whole.has(effect) {
                Verdict::Simulated
            } else {
                Verdict::Absent
            },
            estimate: None,
        });
        return Planned {
            decisions: decisions.collect(),
            together: None,
            shot: whole,
        };
    }
    let mut estimates = EffectEstimates::new(&whole, depths_mm, settings);
    let mut shot = whole.clone();
    let (mut decided, mut sum) = (Vec::new(), None);
    for effect in CANDIDATES {
        let Some(alone) = whole.without(effect) else {
            continue;
        };
        let wanted = choice.asks_for(effect);
        if wanted == Some(true) {
            continue;
        }
        let together = shot.without(effect).unwrap_or_else(|| shot.clone());
        let estimate = estimates.estimate(effect, &alone, tolerance, wanted.is_none());
        let mut below = tolerance.allows(&estimate);
        if below && decided.iter().any(|d: &Decision| d.verdict.is_left_out()) {
            let both = estimates.estimate(effect, &together, tolerance, true);
            below = tolerance.allows(&both);
            if below {
                sum = Some(both);
            }
        }
        let verdict = match wanted {
            Some(_) => Verdict::NotAsked,
            None if below => Verdict::Below,
            None => Verdict::Simulated,
        };
        if verdict.is_left_out() {
            shot = together;
        }
        decided.push(Decision {
            effect,
            verdict,
            estimate: Some(estimate),
        });
    }
    let decisions = Effect::SELECTABLE
        .into_iter()
        .filter(|e| !is_decided_elsewhere(*e));
    let decisions = decisions.map(|effect| {
        let found = decided.iter().find(|d| d.effect == effect).copied();
        found.unwrap_or_else(|| without_estimate(effect, &whole, &decided, choice))
    });
    Planned {
        decisions: decisions.collect(),
        together: sum,
        shot,
    }
}

/// Noise is no part of the clean image, and tables of the response are chosen before there is a camera.
fn is_decided_elsewhere(effect: Effect) -> bool {
    matches!(effect, Effect::Noise | Effect::ResponseSpectrum)
}

/// An effect that no cheaper path belongs to, that is not there, or that is asked for.
fn without_estimate(
    effect: Effect,
    whole: &Shot,
    decided: &[Decision],
    choice: &Choice,
) -> Decision {
    let lens = decided.iter().find(|d| d.effect == Effect::Aberrations);
    let (verdict, estimate) = match effect {
        _ if !whole.has(effect) => (Verdict::Absent, None),
        Effect::Vignetting => {
            let estimate = lost_light(&whole.camera).map(|lost| Estimate {
                signal_percent: Some(100.0 * lost),
                shift_px: None,
            });
            // An ideal lens has no apertures but its stop.
            let verdict = lens.map_or(Verdict::NoCheaperPath, |d| match d.verdict {
                Verdict::Simulated => Verdict::NoCheaperPath,
                left_out => left_out,
            });
            (verdict, estimate)
        }
        Effect::Occlusion => (Verdict::NoCheaperPath, None),
        _ if choice.asks_for(effect) == Some(true) => (Verdict::Simulated, None),
        _ => (Verdict::NoCheaperPath, None),
    };
    Decision {
        effect,
        verdict,
        estimate,
    }
}
