//! A study in numbers: CSV, JSON, and tables for people.

use std::fmt::Write;

use quadpixel::response::RejectionRanges;
use serde_json::json;

use super::cases::Case;
use super::curve::{Curve, TOTAL_WITHIN_DEG};

/// Every point of every curve. Names hold commas and are quoted.
pub(super) fn curves_csv(cases: &[Case], curves: &[Curve]) -> String {
    let mut text =
        String::from("case,wavelength_nm,theta_deg,p_left,p_right,p_sum,ratio,p_total,reflected\n");
    for (case, curve) in cases.iter().zip(curves) {
        for p in &curve.points {
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                text,
                "\"{}\",{},{},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5}",
                case.name,
                case.wavelength_nm,
                (p.theta_deg * 1e6).round() / 1e6,
                p.left,
                p.right,
                p.left + p.right,
                p.ratio(case.centre_deg),
                p.total,
                p.reflected
            );
        }
    }
    text
}

/// R_a, R_b, acceptance and total of every case, beside the paper's; an empty cell is a range that does not exist.
pub(super) fn ranges_csv(cases: &[Case], curves: &[Curve]) -> String {
    let mut text = String::from(
        "case,side,pitch_um,radius_um,height_um,wavelength_nm,chief_ray_deg,r_a_deg,r_b_deg,open,acceptance_deg,total,paper_r_a_deg,paper_r_b_deg\n",
    );
    for (case, curve) in cases.iter().zip(curves) {
        for (side, r) in sides(case, curve) {
            let cell = |x: Option<f64>| x.map_or(String::new(), |x| format!("{x:.2}"));
            let lens = &case.stack.lens;
            let _ = writeln!(
                text,
                "\"{}\",{side},{},{:.4},{:.4},{},{},{},{:.2},{},{},{:.4},{},{}",
                case.name,
                case.stack.pitch_um,
                lens.radius_um,
                lens.height_um,
                case.wavelength_nm,
                case.centre_deg,
                cell(r.r_a_deg),
                r.r_b_deg,
                r.open,
                cell(r.acceptance_deg),
                curve.total,
                cell(case.paper.map(|p| p.0)),
                cell(case.paper.map(|p| p.1))
            );
        }
    }
    text
}

/// The same as JSON, full precision.
pub(super) fn json(cases: &[Case], curves: &[Curve]) -> Vec<serde_json::Value> {
    let mut all = Vec::new();
    for (case, curve) in cases.iter().zip(curves) {
        for (side, r) in sides(case, curve) {
            all.push(json!({
                "case": case.name, "side": side, "wavelength_nm": case.wavelength_nm, "chief_ray_deg": case.centre_deg,
                "r_a_deg": r.r_a_deg, "r_b_deg": r.r_b_deg, "open": r.open, "acceptance_deg": r.acceptance_deg,
                "total": curve.total, "paper": case.paper
            }));
        }
    }
    all
}

/// For a person.
pub(super) fn table(cases: &[Case], curves: &[Curve]) -> String {
    let mut text = format!(
        "{:<28} {:>7} {:>9} {:>12} {:>7}   paper R_a / R_b   (deg; total: mean within {TOTAL_WITHIN_DEG} deg)\n",
        "case", "R_a", "R_b", "acceptance", "total"
    );
    for (case, curve) in cases.iter().zip(curves) {
        for (side, r) in sides(case, curve) {
            let name = if case.centre_deg == 0.0 {
                case.name.clone()
            } else {
                format!("{} ({side})", case.name)
            };
            let angle = |x: Option<f64>| x.map_or("never".into(), |x| format!("{x:.1}"));
            let more = if r.open { ">" } else { "" };
            let paper = case.paper.map_or("-".into(), |(a, b)| format!("{a} / {b}"));
            let _ = writeln!(
                text,
                "{name:<28} {:>7} {:>9} {:>12} {:>7.3}   {paper}",
                angle(r.r_a_deg),
                format!("{more}{:.1}", r.r_b_deg),
                format!("{more}{}", angle(r.acceptance_deg)),
                curve.total
            );
        }
    }
    text
}

/// The cases by the paper's four criteria, the best first: the place in each, and the score, the mean over the criteria
/// of how far a case falls short of the best in parts of the way to the worst (0: best in all, 1: worst in all).
pub(super) fn ranking(cases: &[Case], curves: &[Curve]) -> String {
    let of = |f: &dyn Fn(&Curve) -> f64| curves.iter().map(f).collect::<Vec<f64>>();
    // A ratio that never falls is as bad as one that falls at the horizon.
    let horizon = 90.0;
    let criteria = [
        of(&|c| c.ranges[0].acceptance_deg.unwrap_or(0.0)),
        of(&|c| c.ranges[0].r_b_deg),
        of(&|c| -c.ranges[0].r_a_deg.unwrap_or(horizon)),
        of(&|c| c.total),
    ];
    let place = criteria.each_ref().map(|values| places(values));
    let short = criteria.each_ref().map(|values| shortfalls(values));
    let score = |i: usize| short.iter().map(|s| s[i]).sum::<f64>() / short.len() as f64;
    let mut order: Vec<usize> = (0..cases.len()).collect();
    order.sort_by(|&a, &b| score(a).total_cmp(&score(b)));
    let mut text = format!(
        "\n{:<28} {:>10} {:>5} {:>5} {:>6} {:>6}   (places by criterion; score: 0 best, 1 worst; the paper: smallest RoC and h)\n",
        "ranking", "acceptance", "R_b", "R_a", "total", "score"
    );
    for i in order {
        let [acceptance, r_b, r_a, total] = place.each_ref().map(|p| p[i]);
        let name = &cases[i].name;
        let _ = writeln!(
            text,
            "{name:<28} {acceptance:>10} {r_b:>5} {r_a:>5} {total:>6} {:>6.2}",
            score(i)
        );
    }
    text
}

/// Place of each value from 1, the largest first; equal values share one.
fn places(values: &[f64]) -> Vec<usize> {
    let before = |x: &f64| values.iter().filter(|v| *v > x).count() + 1;
    values.iter().map(before).collect()
}

/// How far each value lies from the largest, in parts of the way to the smallest.
fn shortfalls(values: &[f64]) -> Vec<f64> {
    let best = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let worst = values.iter().copied().fold(f64::INFINITY, f64::min);
    let part = |x: &f64| {
        if best > worst {
            (best - x) / (best - worst)
        } else {
            0.0
        }
    };
    values.iter().map(part).collect()
}

/// A centred lens has the same ranges on both sides.
fn sides<'a>(case: &Case, curve: &'a Curve) -> Vec<(&'static str, &'a RejectionRanges)> {
    let [beyond, before] = &curve.ranges;
    if case.centre_deg == 0.0 {
        vec![("both", beyond)]
    } else {
        vec![("beyond", beyond), ("before", before)]
    }
}

#[cfg(test)]
mod tests {
    use super::{places, shortfalls};

    #[test]
    fn equal_values_share_their_place() {
        assert_eq!(places(&[0.3, 0.9, 0.3, f64::NEG_INFINITY]), [2, 1, 2, 4]);
    }

    #[test]
    fn the_best_falls_short_by_nothing_and_the_worst_by_all() {
        assert_eq!(shortfalls(&[3.0, 1.0, 2.0]), [0.0, 1.0, 0.5]);
        assert_eq!(shortfalls(&[3.0, 3.0]), [0.0, 0.0]);
    }
}
