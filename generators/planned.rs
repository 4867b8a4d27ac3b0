//! Which effects a sample is rendered with: the plan, and what `meta.json` and the log say of it.

use clap::Args;
use quadpixel::command::CommandError;
use quadpixel::effects::{Choice, Decision, Effect, Estimate, Tolerance, Verdict};
use quadpixel::image::Image;
use quadpixel::render::truth::WhiteField;
use quadpixel::sensor::Sensor;
use quadpixel::sensor::readout::ReadoutSettings;
use quadpixel_datasets as spec;

use crate::log::Level;
use crate::progress::Progress;
use crate::sample::Sample;

/// Arguments that choose the effects.
#[derive(Args)]
pub struct EffectArgs {
    /// Effects that are simulated: auto (those whose absence would be seen), all, none, or a list separated by commas of pixel-diffraction, cra-variation,
    /// dispersion, aberrations, vignetting, wavelengths, global-illumination, occlusion, noise; absent: as the file says, else auto.
    #[arg(long, value_name = "auto|all|none|LIST")]
    effects: Option<Choice>,
    /// With auto: root-mean-square difference, in % of the signal, below which an effect is left out [default: 0.5].
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// With auto: shift, in px, below which an effect is left out [default: 0.02].
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    tolerance_px: Option<f64>,
}

impl EffectArgs {
    /// Puts what was given in the place of what a file says.
    pub fn apply(&self, effects: &mut Choice, tolerance: &mut Tolerance) {
        if let Some(choice) = &self.effects {
            effects.clone_from(choice);
        }
        tolerance.signal_percent = self.tolerance.unwrap_or(tolerance.signal_percent);
        tolerance.shift_px = self.tolerance_px.unwrap_or(tolerance.shift_px);
    }
}

/// Nearest and farthest depth of a map, mm (+∞ allowed); an empty picture lies at infinity.
pub(crate) fn depth_range_mm(depth_mm: &Image) -> [f64; 2] {
    let seen = depth_mm.data().iter().filter(|d| **d > 0.0);
    let (near, far) = seen.fold((f32::INFINITY, 0.0f32), |(n, f), &d| (n.min(d), f.max(d)));
    match far > 0.0 {
        true => [near, far].map(f64::from),
        false => [f64::INFINITY; 2],
    }
}

/// What becomes of the noise, which is asked for with the readout: its part of the signal where the sum is 1.
pub(crate) fn noise(
    readout: Option<&ReadoutSettings>,
    choice: &Choice,
    sensor: &Sensor,
    white: &WhiteField,
) -> Decision {
    let estimate = readout.map(|settings| {
        let electrons = settings.electrons_at_white(sensor.pitch_um(), white.quantum_efficiency());
        let noise = settings.relative_noise_at_white(sensor.subpixels(), electrons);
        Estimate {
            signal_percent: Some(100.0 * noise),
            shift_px: None,
        }
    });
    let verdict = match (readout, choice.asks_for(Effect::Noise)) {
        (None, _) => Verdict::Absent,
        (Some(_), Some(false)) => Verdict::NotAsked,
        (Some(_), _) => Verdict::Simulated,
    };
    Decision {
        effect: Effect::Noise,
        verdict,
        estimate,
    }
}

/// Says what was left out, and in detail all the rest.
pub fn tell(progress: &Progress, what: &str, sample: &Sample) {
    for decision in sample.decisions() {
        let level = match decision.verdict.is_left_out() {
            true => Level::Info,
            false => Level::Debug,
        };
        progress.tell(level, &format!("{what}: {decision}"));
    }
    if let Some(estimate) = sample.left_out_together() {
        progress.info(&format!("{what}: left out together: {estimate}"));
    }
}

/// The name of an effect in `meta.json`.
fn name(effect: Effect) -> &'static str {
    match effect {
        Effect::PixelDiffraction => "diffraction and crosstalk in the pixel",
        Effect::CraVariation => "variation of the chief ray over the window",
        Effect::Dispersion => "dispersion",
        Effect::Aberrations => "lens aberrations",
        Effect::Vignetting => "vignetting",
        Effect::Wavelengths => "width of the colour bands",
        Effect::GlobalIllumination => "light reflected and transmitted between surfaces",
        Effect::Occlusion => "occlusion",
        Effect::Noise => "sensor noise",
    }
}

/// Moves what was left out from the one list to the other, with its estimate.
pub(crate) fn into_effects(
    effects: &mut spec::Effects,
    decisions: &[Decision],
    tolerance: &Tolerance,
) {
    for d in decisions.iter().filter(|d| d.verdict.is_left_out()) {
        let name = name(d.effect);
        effects.simulated.retain(|s| !s.starts_with(name));
        effects.left_out.retain(|l| l.name != name);
        let estimate = d.estimate.map_or(String::new(), |e| format!(": {e}"));
        let reason = match d.verdict {
            Verdict::Below => format!(
                "below the tolerance of {} % of the signal and {} px{estimate}",
                tolerance.signal_percent, tolerance.shift_px
            ),
            _ => format!("not among the effects asked for{estimate}"),
        };
        let signal = d.estimate.and_then(|e| e.signal_percent);
        effects.left_out.push(spec::LeftOut {
            name: name.to_string(),
            reason,
            estimated_error: signal.map(|value| spec::EstimatedError {
                quantity: "signal (RMS)".to_string(),
                value,
                unit: "%".to_string(),
            }),
        });
    }
}

/// The tolerance, if it is one.
///
/// # Errors
/// The field that is out of bounds.
pub(crate) fn checked(tolerance: &Tolerance) -> Result<(), CommandError> {
    tolerance.check().map_err(CommandError::input)
}
