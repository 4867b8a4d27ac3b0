//! What the plan of effects needs to know of a sample.

use glam::DVec2;
use quadpixel::effects::{Choice, Decision, Effect, Estimate, Verdict};
use quadpixel::image::Image;
use quadpixel::lens::{Lens, OpticalSystem, chief_ray, trace_backward};
use quadpixel::render::Camera;
use quadpixel::render::truth::WhiteField;
use quadpixel::sensor::Sensor;
use quadpixel::sensor::readout::ReadoutSettings;
use quadpixel::spectrum::Bands;

use crate::assemble::ColourErrors;

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

/// Says of channels that are traced at one wavelength each what the width of their bands would do: in the pixel's
/// response, where that is known, and in the lens.
pub(crate) fn estimate_band_width(
    decisions: &mut [Decision],
    pixel: Option<ColourErrors>,
    lens: &Lens,
    camera: &Camera,
) {
    let absent =
        |d: &&mut Decision| d.effect == Effect::Wavelengths && d.verdict == Verdict::Absent;
    if let Some(decision) = decisions.iter_mut().find(absent) {
        decision.estimate = Some(Estimate {
            signal_percent: pixel.map(|e| e.width_percent),
            shift_px: lateral_colour_px(lens, camera),
        });
    }
}

/// Largest shift of a channel's picture, a standard deviation of its band to either side, by the chief ray of the
/// window's farthest corner, px; `None` where that does not pass.
fn lateral_colour_px(lens: &Lens, camera: &Camera) -> Option<f64> {
    let bands = Bands::default();
    let w = camera.sensor().window_mm();
    let half = DVec2::new(w.half_width, w.half_height);
    let corner = w.centre + half.copysign(w.centre);
    let seen = |system: &OpticalSystem| {
        let chief = chief_ray(system, corner.x, corner.y).ok()?;
        let d = trace_backward(system, chief).ok()?.direction;
        Some(d.truncate() / d.z)
    };
    let focal_px = camera.paraxial()?.efl_mm / camera.sensor().pitch_mm();
    let channel = |c: usize| {
        let off = Bands::DEVIATION * bands.width_nm[c];
        let at = |nm: f64| seen(&lens.at(nm).ok()?);
        let ends = at(bands.middle_nm[c] + off)? - at(bands.middle_nm[c] - off)?;
        Some(0.5 * focal_px * ends.length())
    };
    let channels: Option<Vec<f64>> = (0..3).map(channel).collect();
    Some(channels?.into_iter().fold(0.0, f64::max))
}
