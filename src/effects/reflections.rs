//! Whether a scene calls for ghosts and veiling glare.
//!
//! Their light in blocks of the window, followed from what the front of the lens sees, over the mean light of a
//! sub-pixel. Two sets of rays have independent errors, as in [`super::signal`]: d² = ⟨a₁ a₂⟩, and
//! RMS ≤ √(d² + 2 s/√n). What else is left out adds up with it as errors do that know nothing of each other, in
//! squares.
//!
//! A short look at charts comes first: most have ghosts far below the tolerance. So few of its rays land that a block
//! lit in both sets is rare. The mean square of a set itself, ⟨a²⟩ for ⟨a₁ a₂⟩, has the set's noise in it and is too
//! large on average, which is enough to tell that ghosts are small. Lamps and suns, whose ghosts few rays find, are
//! looked at for long at once.

use super::{Choice, Decision, Effect, Estimate, Planned, Shot, Tolerance, Verdict};
use crate::render::{Execution, GhostLook, RenderSettings, ghost_blocks, probe};
use crate::sampling::hash;

/// Pixels on a side of the window, and rays of each, whose mean is the signal.
const SIDE: usize = 8;
const RAYS: usize = 16;
/// A short look that finds any light is believed where so many times that are still below the tolerance.
const ROOM: f64 = 2.0;
/// Keeps these random numbers apart from others.
const KEY: u64 = 0x6105_7EED;

/// Decides on the ghosts of `whole`, of which all else is `planned` without them.
pub(super) fn decide(
    whole: &Shot,
    planned: Planned,
    settings: &RenderSettings,
    choice: &Choice,
    tolerance: &Tolerance,
) -> Planned {
    let wanted = choice.asks_for(Effect::LensReflections);
    let estimate = (*choice != Choice::All).then(|| estimate(whole, &planned, settings, tolerance));
    let verdict = match (wanted, estimate) {
        (Some(true), _) => Verdict::Simulated,
        (Some(false), _) => Verdict::NotAsked,
        (None, Some(alone)) if tolerance.allows(&with_others(alone, &planned)) => Verdict::Below,
        (None, _) => Verdict::Simulated,
    };
    let mut shot = planned.shot;
    if let (false, Some(reflections)) = (verdict.is_left_out(), whole.camera.reflections()) {
        shot.camera = shot.camera.with_reflections(reflections.clone());
    }
    let decisions = planned.decisions.into_iter().map(|decision| {
        let ours = decision.effect == Effect::LensReflections;
        let decided = Decision {
            verdict,
            estimate: estimate.filter(|_| wanted != Some(true)),
            ..decision
        };
        if ours { decided } else { decision }
    });
    Planned {
        decisions: decisions.collect(),
        shot,
        ..planned
    }
}

/// What leaving out the ghosts does: by a short look where that is enough.
fn estimate(
    whole: &Shot,
    planned: &Planned,
    settings: &RenderSettings,
    tolerance: &Tolerance,
) -> Estimate {
    let percent = |over_mean: f64| Estimate {
        signal_percent: Some(100.0 * over_mean),
        shift_px: None,
    };
    if whole.scene.world().is_none() {
        let found = ghosts_over_mean(whole, settings, GhostLook::Short);
        let short = percent(found.with_noise);
        let worse = Estimate {
            signal_percent: short.signal_percent.map(|ghosts| ROOM * ghosts),
            ..short
        };
        if found.with_noise > 0.0 && tolerance.allows(&with_others(worse, planned)) {
            return short;
        }
    }
    percent(ghosts_over_mean(whole, settings, GhostLook::Long).over_mean)
}

/// The ghosts with the other effects that are below the tolerance and left out.
fn with_others(alone: Estimate, planned: &Planned) -> Estimate {
    let below = |d: &&Decision| d.verdict == Verdict::Below;
    let each = planned.decisions.iter().filter(below);
    let single = each.filter_map(|d| d.estimate?.signal_percent);
    let others = match planned.together {
        Some(together) => together.signal_percent.unwrap_or(0.0),
        None => single.fold(0.0, f64::max),
    };
    Estimate {
        signal_percent: alone.signal_percent.map(|ghosts| ghosts.hypot(others)),
        ..alone
    }
}

/// What a look finds.
struct Found {
    /// RMS of the ghosts over the mean light of a sub-pixel; 0 where there are none, infinite where there is nothing
    /// else.
    over_mean: f64,
    /// The same with the noise of one set.
    with_noise: f64,
}

fn ghosts_over_mean(whole: &Shot, settings: &RenderSettings, look: GhostLook) -> Found {
    let seed = hash(settings.seed, &[KEY]);
    let Some(blocks) = ghost_blocks(&whole.camera, &whole.scene, seed, look) else {
        return Found {
            over_mean: 0.0,
            with_noise: 0.0,
        };
    };
    let [a, b] = &blocks.values;
    let products: Vec<f64> = a.iter().zip(b).map(|(a, b)| a * b).collect();
    let n = products.len() as f64;
    let mean = products.iter().sum::<f64>() / n;
    let variance = products.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let square = mean + 2.0 * (variance / n).sqrt();
    let squares = a.iter().chain(b).map(|x| x * x).sum::<f64>() / (2.0 * n);
    let light = mean_light(whole, seed);
    let over_mean = |square: f64| match square.max(0.0).sqrt() {
        0.0 => 0.0,
        rms => rms / light,
    };
    Found {
        over_mean: over_mean(square),
        with_noise: over_mean(squares),
    }
}

/// Of sub-pixels spread over the window, without ghosts.
fn mean_light(whole: &Shot, seed: u64) -> f64 {
    let sensor = whole.camera.sensor();
    let (columns, rows) = (SIDE.min(sensor.width()), SIDE.min(sensor.height()));
    let middle = |cell: usize, of: usize, length: usize| (2 * cell + 1) * length / (2 * of);
    let places: Vec<_> = (0..columns * rows)
        .map(|k| {
            let (i, j) = (k % columns, k / columns);
            (
                middle(i, columns, sensor.width()),
                middle(j, rows, sensor.height()),
            )
        })
        .collect();
    let settings = RenderSettings {
        rays_per_pixel: RAYS,
        seed,
    };
    let values = probe(
        &whole.camera,
        &whole.scene,
        &settings,
        &Execution::default(),
        &places,
    );
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
