//! Plans held to what they promise: what is left out changes the image by less than the tolerance, and saves work; what
//! a scene calls for is kept.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

mod diffraction;
mod ghosts;
mod light;
mod paths;
mod scenes;
#[path = "../common/shots.rs"]
mod shots;

use quadpixel::effects::{Choice, Effect, Planned, Shot, Tolerance, Verdict, plan};
use quadpixel::render::truth::{SightRays, WhiteField};
use quadpixel::render::{RenderSettings, Rendered};
use scenes::Case;

const RAYS: RenderSettings = RenderSettings {
    rays_per_pixel: 64,
    seed: 11,
};

fn planned(shot: &Shot, choice: &Choice) -> Planned {
    let geometry = SightRays::chief_rays(&shot.camera).geometry(&shot.camera, &shot.scene);
    let depths = geometry.depth_mm.data().iter().filter(|d| **d > 0.0);
    let (near, far) = depths.fold((f32::INFINITY, 0f32), |(n, f), &d| (n.min(d), f.max(d)));
    let depths = [near, far].map(f64::from);
    plan(shot.clone(), depths, &RAYS, choice, &Tolerance::default())
}

fn shoot(shot: &Shot, seed: u64) -> Rendered {
    shots::shoot(&shot.camera, &shot.scene, 128, seed)
}

/// RMS difference of the converged images over their mean, %, each in units of its white wall: from the products of two
/// renders' differences, whose errors are independent, so that noise averages out instead of adding.
fn difference_percent(whole: &Shot, less: &Shot) -> f64 {
    let white = [whole, less].map(|s| WhiteField::new(&s.camera).reference_sr());
    let shots = [1, 2].map(|seed| [whole, less].map(|s| shoot(s, seed).image.mosaic));
    let value =
        |set: usize, which: usize, k: usize| f64::from(shots[set][which].data()[k]) / white[which];
    let n = shots[0][0].data().len();
    let off = |set: usize, k: usize| value(set, 1, k) - value(set, 0, k);
    let square = (0..n).map(|k| off(0, k) * off(1, k)).sum::<f64>() / n as f64;
    let mean = (0..n).map(|k| value(0, 0, k)).sum::<f64>() / n as f64;
    100.0 * square.max(0.0).sqrt() / mean
}

fn left_out(planned: &Planned) -> Vec<Effect> {
    let out = planned.decisions.iter().filter(|d| d.verdict.is_left_out());
    out.map(|d| d.effect).collect()
}

/// Two dozen scenes chosen to call for different effects.
#[test]
fn what_auto_leaves_out_is_below_the_tolerance_and_saves_rays() {
    let tolerance = Tolerance::default();
    let mut sets = std::collections::BTreeSet::new();
    let mut wrong = Vec::new();
    for Case {
        name,
        shot,
        leaves_out,
        by_chance,
    } in scenes::all().into_iter().chain(light::all())
    {
        let auto = planned(&shot, &Choice::Auto);
        let out = left_out(&auto);
        let off = difference_percent(&shot, &auto.shot);
        let rays = [&shot, &auto.shot].map(|s| shoot(s, 3).stats.rays);
        let told: Vec<String> = auto.decisions.iter().map(ToString::to_string).collect();
        println!(
            "{name}: {off:.3} %, rays {rays:?}, left out {out:?}\n  {}",
            told.join("\n  ")
        );
        assert!(
            off < tolerance.signal_percent,
            "{name}: {off} % without {out:?}"
        );
        assert!(rays[1] <= rays[0], "{name}: {rays:?}");
        let sure = out.iter().filter(|effect| !by_chance.contains(effect));
        if !sure.eq(&leaves_out) {
            wrong.push(format!("{name}: leaves out {out:?}, not {leaves_out:?}"));
        }
        // What is said of each effect is what was done.
        for d in &auto.decisions {
            if d.verdict == Verdict::Below {
                let e = d.estimate.unwrap();
                assert!(
                    e.signal_percent
                        .is_some_and(|s| s < tolerance.signal_percent),
                    "{name}: {d}"
                );
                assert!(
                    e.shift_px.is_none_or(|s| s < tolerance.shift_px),
                    "{name}: {d}"
                );
            }
        }
        sets.insert(out);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(sets.len() >= 6, "{sets:?}");
}

#[test]
fn a_plan_is_the_same_again_and_on_one_thread() {
    let case = scenes::simple();
    let first = planned(&case.shot, &Choice::Auto).decisions;
    let again = shots::on_threads(1, || planned(&case.shot, &Choice::Auto).decisions);
    assert_eq!(first, again);
}

#[test]
fn what_is_asked_for_is_done_whatever_the_tolerance() {
    let (whole, simple) = (&scenes::demanding().shot, &scenes::simple().shot);
    // All: nothing is left out, not even what would not be seen, and nothing is estimated.
    let all = planned(simple, &Choice::All);
    assert!(left_out(&all).is_empty());
    assert!(all.decisions.iter().all(|d| d.estimate.is_none()));
    // None: all that can be left out is, and its cost is told.
    let none = planned(whole, &"none".parse().unwrap());
    let out = [
        Effect::CraVariation,
        Effect::Dispersion,
        Effect::Aberrations,
        Effect::Vignetting,
    ];
    assert_eq!(left_out(&none), out);
    for d in none.decisions.iter().filter(|d| d.verdict.is_left_out()) {
        assert_eq!(d.verdict, Verdict::NotAsked);
        assert!(d.estimate.unwrap().signal_percent.unwrap() > 0.0, "{d}");
    }
    // A list: these, the rest not; vignetting goes with the surfaces that cause it.
    let some = planned(whole, &"aberrations".parse().unwrap());
    assert_eq!(left_out(&some), [Effect::CraVariation, Effect::Dispersion]);
    let vignetting = some
        .decisions
        .iter()
        .find(|d| d.effect == Effect::Vignetting);
    assert_eq!(vignetting.unwrap().verdict, Verdict::NoCheaperPath);
}
