//! What the plan of effects needs to know of a sample.

use quadpixel::effects::{Choice, Decision, Effect, Estimate, Verdict};
use quadpixel::image::Image;
use quadpixel::render::truth::WhiteField;
use quadpixel::sensor::Sensor;
use quadpixel::sensor::readout::ReadoutSettings;

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
