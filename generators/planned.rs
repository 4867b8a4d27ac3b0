//! Which effects a sample is rendered with: the plan, and what `meta.json` and the log say of it.

use quadpixel::command::CommandError;
use quadpixel::effects::{Choice, Decision, Effect, Estimate, Tolerance, Verdict};
use quadpixel::image::Image;
use quadpixel::render::truth::WhiteField;
use quadpixel::sensor::Sensor;
use quadpixel::sensor::readout::ReadoutSettings;
use quadpixel_datasets as spec;

use crate::observer::{Event, Observer};

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

/// Reports each decision about `sample`, and what was left out together.
pub fn report(
    observer: &dyn Observer,
    sample: &str,
    decisions: &[Decision],
    together: Option<Estimate>,
) {
    for decision in decisions {
        observer.event(Event::Decision { sample, decision });
    }
    if let Some(estimate) = together {
        let text = format!("{sample}: left out together: {estimate}");
        observer.event(Event::Info(&text));
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
