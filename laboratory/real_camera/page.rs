//! The page: tables, with what was fitted set apart from what is predicted. Its words are in `page.md`.

use quadpixel_laboratory::template::{TemplateError, filled};

use crate::aperture;
use crate::camera::FITTED_ON;
use crate::depths::CLAIM_M;
use crate::measure::Shift;
use crate::noise::PARTS;
use crate::results::{CaptureResult, DepthResult, LensResult, Results};

const PAGE: &str = include_str!("page.md");

/// The page in Markdown.
///
/// # Errors
/// A placeholder of the template that has no value.
pub fn page(results: &Results) -> Result<String, TemplateError> {
    let values = [
        ("noise", lines(results.noise.iter().map(noise))),
        ("lens", lines(results.lens.iter().map(lens))),
        ("captures", captures(results)),
        ("apertures", apertures(results)),
        ("measured", measured(results)),
        ("claim_m", CLAIM_M.to_string()),
        ("depths", depths(&results.depths)),
        ("calibrated", calibrated(results)),
        ("pictures", pictures(results)),
        ("left_out", left_out(results)),
    ];
    filled(PAGE, &values)
}

/// Lines without the last one's end, which the template has.
fn lines(lines: impl Iterator<Item = String>) -> String {
    lines.collect::<Vec<_>>().join("\n")
}

fn fit_or_prediction(fitted: bool) -> &'static str {
    if fitted { "fit" } else { "prediction" }
}

fn noise((name, ratios): &(String, [f64; PARTS])) -> String {
    let cells = ratios.map(|r| format!("{r:.2}"));
    format!("| {name} | {} |", cells.join(" | "))
}

fn lens(l: &LensResult) -> String {
    format!(
        "| F/{} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
        l.mark,
        l.stop_semi_mm,
        l.efl_mm,
        l.f_number,
        l.sensor_from_vertex_mm,
        l.focus_from_vertex_mm
    )
}

fn captures(results: &Results) -> String {
    let all: Vec<String> = results.captures.iter().map(capture).collect();
    all.join("\n\n")
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
    lines(rows.into_iter())
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

/// The curves, a column per model.
fn apertures(results: &Results) -> String {
    let curves = &results.aperture.curves;
    let names: Vec<&str> = curves.iter().map(|c| c.0.as_str()).collect();
    let mut rows = vec![
        format!("| F-number | {} |", names.join(" | ")),
        format!("|---|{}", "---|".repeat(names.len())),
    ];
    for (i, mark) in aperture::MARKS.iter().enumerate() {
        let parts: Vec<String> = (curves.iter())
            .map(|(_, points)| format!("{:.4}", points[i].1))
            .collect();
        rows.push(format!("| {mark} | {} |", parts.join(" | ")));
    }
    lines(rows.into_iter())
}

fn measured(results: &Results) -> String {
    let rows = results.aperture.measured.iter();
    lines(rows.map(|(name, coc, shift, (mark, part))| {
        let fitted =
            (name.as_str(), *mark) == (format!("{} mm", FITTED_ON.0).as_str(), FITTED_ON.1);
        format!(
            "| {name}, F/{mark} | {} | {coc:.2} | {shift:.3} | {part:.4} |",
            fit_or_prediction(fitted)
        )
    }))
}

fn depths(depths: &[DepthResult]) -> String {
    let each = depths.iter().map(|d| {
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
    });
    let mut kinds: Vec<&str> = depths.iter().map(|d| d.kind.as_str()).collect();
    kinds.dedup();
    let means = kinds
        .into_iter()
        .filter_map(|kind| mean_of_kind(kind, depths));
    lines(each.chain(means))
}

/// The same by planes, where there are two.
fn calibrated(results: &Results) -> String {
    if results.calibrated.is_empty() {
        return String::new();
    }
    format!(
        "The same after `qpalgo calibrate-depth` by the planes of that aperture, on which focus and gain are fitted then; scenes are predicted:\n\n\
         | capture | used for | MAE claimed, m | median, m | relative | accuracy | share claimed | MAE of all matched, m | share matched |\n\
         |---|---|---|---|---|---|---|---|---|\n{}\n\n",
        depths(&results.calibrated)
    )
}

fn pictures(results: &Results) -> String {
    let each = results.shown().iter();
    let each = each.map(|d| format!("![Depth of {}]({})", d.name, d.picture_name()));
    each.collect::<Vec<_>>().join("\n\n")
}

/// The means over the captures of a kind that claim anything, where there are several.
fn mean_of_kind(kind: &str, depths: &[DepthResult]) -> Option<String> {
    let claiming: Vec<&DepthResult> = (depths.iter())
        .filter(|d| d.kind == kind && d.claimed.share > 0.0)
        .collect();
    let mean = |value: &dyn Fn(&DepthResult) -> f64| {
        claiming.iter().map(|d| value(d)).sum::<f64>() / claiming.len() as f64
    };
    (claiming.len() > 1).then(|| {
        format!(
            "| mean of {} ({kind}) | | {:.4} | {:.4} | {:.1} % | {:.3} | {:.1} % | | |",
            claiming.len(),
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
    let each = results.left_out.iter().map(|line| format!("- {line}\n"));
    format!("Left out:\n\n{}\n", each.collect::<String>())
}
