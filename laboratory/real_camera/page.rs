//! The page: tables, with what was fitted parted from what is predicted.

use std::fmt::Write;

use crate::aperture;
use crate::camera::FITTED_ON;
use crate::depths::CLAIM_M;
use crate::measure::Shift;
use crate::noise::PARTS;
use crate::report::{CaptureResult, DepthResult, Results};

/// What is said whatever the numbers are.
const INTRODUCTION: &str = include_str!("page_introduction.md");
const LIMITS: &str = include_str!("page_limits.md");

/// The page in Markdown.
pub fn of(results: &Results) -> String {
    let mut page = INTRODUCTION.to_owned();
    for part in [
        noise(results),
        lens(results),
        captures(results),
        apertures(results),
        depths(results),
        left_out(results),
    ] {
        page += &part;
    }
    page + LIMITS
}

/// Lines, each with its end.
fn lines(lines: impl IntoIterator<Item = String>) -> String {
    lines.into_iter().fold(String::new(), |mut all, line| {
        // Writing to a String cannot fail.
        let _ = writeln!(all, "{line}");
        all
    })
}

/// Rows under their head.
fn table(head: &str, rows: impl IntoIterator<Item = String>) -> String {
    lines(std::iter::once(head.to_owned()).chain(rows))
}

fn fit_or_prediction(fitted: bool) -> &'static str {
    if fitted { "fit" } else { "prediction" }
}

fn noise(results: &Results) -> String {
    let head = "| variance left / right, by sixths of the width | 1 | 2 | 3 | 4 | 5 | 6 |\n|---|---|---|---|---|---|---|";
    let row = |(name, ratios): &(String, [f64; PARTS])| {
        let cells: Vec<String> = ratios.iter().map(|r| format!("{r:.2}")).collect();
        format!("| {name} | {} |", cells.join(" | "))
    };
    let tail = "\nSo the left view has less light on the right of the picture, and the right view on its left: the light arrives beside the split there, by the chief ray.";
    let rows = results.noise.iter().map(row);
    table(head, rows.chain([tail.to_owned()]))
}

fn lens(results: &Results) -> String {
    let head = "\n## Lens\n\n| mark | stop, mm | EFL, mm | F-number | sensor behind first vertex, mm | focus in front of it, mm |\n|---|---|---|---|---|---|";
    let row = |l: &crate::report::LensResult| {
        format!(
            "| F/{} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
            l.mark,
            l.stop_semi_mm,
            l.efl_mm,
            l.f_number,
            l.sensor_from_vertex_mm,
            l.focus_from_vertex_mm
        )
    };
    table(head, results.lens.iter().map(row))
}

fn captures(results: &Results) -> String {
    let head = "\n## Captures simulated\n\nShift: x_L − x_R, px, one window of half the picture's height each; in brackets the median of windows of 31 × 31 that the matcher trusts (— none).\n";
    table(head, results.captures.iter().map(capture))
}

fn capture(c: &CaptureResult) -> String {
    let mut rows = vec![
        format!(
            "**{} mm, F/{}** ({}), circle of confusion {:.2} px\n\n| | PSNR, dB | SSIM | left | centre | right |\n|---|---|---|---|---|---|",
            c.distance_mm,
            c.mark,
            fit_or_prediction((c.distance_mm, c.mark) == FITTED_ON),
            c.coc_px.abs()
        ),
        format!("| measured | | | {} |", cells(&c.measured)),
    ];
    rows.extend(c.models.iter().map(|m| {
        format!(
            "| {} | {:.2} | {:.4} | {} |",
            m.name,
            m.likeness.psnr_db,
            m.likeness.ssim,
            cells(&m.shifts)
        )
    }));
    lines(rows)
}

fn cells(shifts: &[Shift]) -> String {
    let cell = |s: &Shift| {
        let median = if s.median_px.is_nan() {
            "—".to_owned()
        } else {
            format!("{:.3}", s.median_px)
        };
        format!("{:.3} ({median})", s.whole_px)
    };
    shifts.iter().map(cell).collect::<Vec<_>>().join(" | ")
}

fn apertures(results: &Results) -> String {
    let curves = &results.aperture.curves;
    let names: Vec<&str> = curves.iter().map(|c| c.0.as_str()).collect();
    let mut rows = vec![
        "\n## Shift against aperture\n\nShift over circle of confusion in the middle of the picture, for a point at 600 mm.\n\n![Shift over circle of confusion against the F-number](aperture.svg)\n".to_owned(),
        format!("| F-number | {} |\n|---|{}", names.join(" | "), "---|".repeat(names.len())),
    ];
    for (i, mark) in aperture::MARKS.iter().enumerate() {
        let parts: Vec<String> = (curves.iter())
            .map(|(_, points)| format!("{:.4}", points[i].1))
            .collect();
        rows.push(format!("| {mark} | {} |", parts.join(" | ")));
    }
    rows.push("\n| measured | used for | circle of confusion, px | shift, px | shift over circle |\n|---|---|---|---|---|".to_owned());
    for (name, coc, shift, (mark, part)) in &results.aperture.measured {
        let fitted =
            (name.as_str(), *mark) == (format!("{} mm", FITTED_ON.0).as_str(), FITTED_ON.1);
        rows.push(format!(
            "| {name}, F/{mark} | {} | {coc:.2} | {shift:.3} | {part:.4} |",
            fit_or_prediction(fitted)
        ));
    }
    lines(rows)
}

fn depths(results: &Results) -> String {
    let mut rows = vec![
        format!(
            "\n## Depth\n\nClaimed: where the estimate's own standard deviation is at most {CLAIM_M} m. MAE: mean error; accuracy: part within a factor of 1.25. Share: of the pixels whose depth is known (to 10 m).\n"
        ),
        "| capture | pixel | MAE claimed, m | median, m | relative | accuracy | share claimed | MAE of all matched, m | share matched |\n|---|---|---|---|---|---|---|---|---|".to_owned(),
    ];
    rows.extend(results.depths.iter().map(|d| {
        let (c, a) = (&d.claimed, &d.all);
        format!(
            "| {}, F/{} | {} | {:.4} | {:.4} | {:.1} % | {:.3} | {:.1} % | {:.4} | {:.1} % |",
            d.name,
            d.mark,
            fit_or_prediction(d.fitted),
            c.mean_m,
            c.median_m,
            100.0 * c.relative,
            c.accuracy,
            100.0 * c.share,
            a.mean_m,
            100.0 * a.share
        )
    }));
    let mut kinds: Vec<&str> = results.depths.iter().map(|d| d.kind.as_str()).collect();
    kinds.dedup();
    for kind in kinds {
        rows.extend(mean_of(kind, &results.depths));
    }
    rows.push(String::new());
    rows.extend(
        (results.depths.iter()).map(|d| format!("![Depth of {}]({})\n", d.name, d.picture_name())),
    );
    rows.push("Left: claimed depth; right: known depth; yellow is near, black is not claimed or not known; one scale, linear in 1/Z.\n".to_owned());
    lines(rows)
}

/// The means over the captures of a kind that claim anything, where there are several.
fn mean_of(kind: &str, depths: &[DepthResult]) -> Option<String> {
    let of: Vec<&DepthResult> = (depths.iter())
        .filter(|d| d.kind == kind && d.claimed.share > 0.0)
        .collect();
    let mean = |value: &dyn Fn(&DepthResult) -> f64| {
        of.iter().map(|d| value(d)).sum::<f64>() / of.len() as f64
    };
    (of.len() > 1).then(|| {
        format!(
            "| mean of {} ({kind}) | | {:.4} | {:.4} | {:.1} % | {:.3} | {:.1} % | | |",
            of.len(),
            mean(&|d| d.claimed.mean_m),
            mean(&|d| d.claimed.median_m),
            100.0 * mean(&|d| d.claimed.relative),
            mean(&|d| d.claimed.accuracy),
            100.0 * mean(&|d| d.claimed.share)
        )
    })
}

fn left_out(results: &Results) -> String {
    if results.left_out.is_empty() {
        return String::new();
    }
    let each = results.left_out.iter().map(|line| format!("- {line}"));
    table("Left out:\n", each.chain([String::new()]))
}
