//! What a fit found, printed.

use quadpixel_laboratory::fit::Fitted;
use quadpixel_laboratory::fit::goals::Goal;
use quadpixel_laboratory::fit::prediction::Prediction;

use super::{FitArgs, STRONG};
use crate::exit::CommandError;
use crate::outln;

/// Parameters, correlations, planes and goals; `confirmed`: the goals by Fourier modes.
pub(super) fn print(
    fitted: &Fitted,
    predicted: &Prediction,
    confirmed: Option<&[Goal]>,
    seconds: f64,
    args: &FitArgs,
) -> Result<(), CommandError> {
    outln!("parameter                     value      sigma    prior (sigma)");
    for p in fitted.table() {
        let note = match (p.at_bound, p.held_by_data) {
            (true, _) => "  at its bound",
            (_, false) => "  not held by the data: its prior",
            _ => "",
        };
        let [prior, sigma] = p.prior;
        outln!(
            "{:<24} {:>10.4} {:>10.4}    {prior:.4} ({sigma:.4}){note}",
            p.name,
            p.value,
            p.sigma
        );
    }
    let strong = fitted.correlations(STRONG);
    outln!(
        "correlations of {STRONG} and more: {}",
        if strong.is_empty() { "none" } else { "" }
    );
    for (a, b, r) in strong {
        outln!("  {a}, {b}: {r:.2}");
    }
    let held_out = match (args.all, predicted.planes.iter().any(|p| p.held_out)) {
        (true, false) => "nothing was kept out",
        (true, true) => "planes in other light",
        _ => "what was kept out",
    };
    for plane in &predicted.planes {
        let kept = if plane.held_out { "kept out" } else { "fitted" };
        let thirds = plane.thirds.map(|third| match third {
            Some([measured, predicted]) => format!("{measured:.3} -> {predicted:.3}"),
            None => "no texture".to_owned(),
        });
        outln!(
            "plane at {} mm, stop {:.2} x F, {} nm, {kept}: x_L - x_R in px, left, middle, right third: {}",
            plane.distance_mm,
            plane.stop,
            plane.wavelength_nm,
            thirds.join("; ")
        );
    }
    let by_rcwa = confirmed.map_or("", |_| "; by rcwa");
    outln!("goals ({held_out}):                                         found   at most{by_rcwa}");
    for (i, goal) in predicted.goals().iter().enumerate() {
        let verdict = if goal.met { "met" } else { "MISSED" };
        let by_rcwa = confirmed.and_then(|goals| goals.get(i));
        let by_rcwa = by_rcwa.map_or(String::new(), |goal| format!("; {:.4}", goal.found));
        outln!(
            "{:<58} {:>8.4}  {:>8.4}  {verdict}{by_rcwa}",
            goal.what,
            goal.found,
            goal.at_most
        );
    }
    outln!(
        "{} steps, {seconds:.1} s; {}",
        fitted.steps,
        args.out.display()
    );
    Ok(())
}
