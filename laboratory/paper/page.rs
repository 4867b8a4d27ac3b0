//! The page: each figure of the paper beside ours, and a sentence on each difference. Its words are in `page.md` and
//! `why_*.md`, what the paper prints is in `paper.toml`.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use quadpixel::file;
use quadpixel_laboratory::template::filled;
use serde::Deserialize;
use serde_json::Value;

use crate::captures::{Captures, LIGHT, POSITIONS, SETUPS};
use crate::pictures;
use crate::studies::Studies;
use crate::tools::Tools;

const PAGE: &str = include_str!("page.md");
const TUNGSTEN: &str = include_str!("page_tungsten.md");
const PAPER: &str = include_str!("paper.toml");
const QUICK: &str =
    "\n**This is the quick page: coarse angles, the wave level, few rays, no Fig. 3(b).**\n";
/// Sentences on the differences, by placeholder.
const REASONS: [(&str, &str); 7] = [
    ("why_rejection", include_str!("why_rejection.md")),
    ("why_tungsten", include_str!("why_tungsten.md")),
    ("why_cra", include_str!("why_cra.md")),
    ("why_pitch", include_str!("why_pitch.md")),
    ("why_wavelength", include_str!("why_wavelength.md")),
    ("why_size", include_str!("why_size.md")),
    ("why_table2", include_str!("why_table2.md")),
];

/// `paper.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Paper {
    picture: Vec<Picture>,
    table2: Vec<Table2Row>,
}

/// A picture of a step, and its name beside the page.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Picture {
    from: String,
    to: String,
}

/// One row of the paper's Table 2.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table2Row {
    setup: String,
    metric: String,
    centre: Printed,
    corner: Printed,
}

/// Sharpness as the paper prints it; the gain in %.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Printed {
    raw: String,
    corrected: String,
    gain: String,
}

/// Writes the page and its pictures into `out`.
pub fn write(
    out: &Path,
    tools: &Tools,
    studies: &Studies,
    captures: &Captures,
) -> Result<(), Box<dyn Error>> {
    let paper: Paper = toml::from_str(PAPER)?;
    file::create_folder(out)?;
    for picture in &paper.picture {
        if picture.from.starts_with("tungsten/") && studies.tungsten.is_none() {
            continue;
        }
        let bytes = file::read(&tools.work.join(&picture.from))?;
        file::write_aside(&out.join(&picture.to), &bytes)?;
    }
    pictures::write(&out.join("fig10.jpg"), &figure_10(tools)?, 1)?;
    pictures::write(&out.join("fig15.jpg"), &figure_15(tools)?, 3)?;
    let text = text(tools.quick, studies, &table_2(&paper, &captures.table))?;
    file::write_aside(&out.join("README.md"), text.as_bytes()).map_err(Into::into)
}

/// The page in Markdown.
fn text(quick: bool, studies: &Studies, table_2: &str) -> Result<String, Box<dyn Error>> {
    // The template has the last line ends.
    let whole = |text: &str| text.trim_end_matches('\n').to_owned();
    let reason = |text: &str| if quick { String::new() } else { whole(text) };
    let mut values: Vec<(&str, String)> = REASONS
        .iter()
        .map(|(name, text)| (*name, reason(text)))
        .collect();
    values.extend([
        ("quick", if quick { QUICK } else { "" }.to_owned()),
        ("rejection", whole(&ranges(&studies.rejection))),
        ("wavelength", whole(&ranges(&studies.wavelength))),
        ("microlens", whole(&studies.microlens)),
        ("validation", whole(&experiments(&studies.validation))),
        ("size", whole(&sizes(&studies.size))),
        ("table2", whole(table_2)),
    ]);
    let section = match &studies.tungsten {
        Some(tungsten) => {
            values.push(("tungsten", whole(&ranges(tungsten))));
            filled(TUNGSTEN, &values)?
        }
        None => String::new(),
    };
    values.push(("tungsten_section", section));
    filled(PAGE, &values).map_err(Into::into)
}

/// A number of a table, if there is one.
fn figure(value: &Value, places: usize, unit: &str) -> String {
    let known = value.as_f64();
    known.map_or("–".to_owned(), |x| format!("{x:.places$}{unit}"))
}

/// R_a and R_b beside the paper's.
fn ranges(study: &Value) -> String {
    let model = study["model"].as_str().unwrap_or("?");
    let mut text = format!(
        "By `{model}`.\n\n| case | R_a | R_b | paper: R_a | R_b | acceptance | total absorbed within 30° |\n|---|---|---|---|---|---|---|\n"
    );
    for case in study["cases"].as_array().into_iter().flatten() {
        let degrees = |v: &Value| figure(v, 1, "°");
        let side = case["side"].as_str().filter(|s| *s != "both");
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "| {}{} | {} | {} | {} | {} | {} | {:.3} |",
            case["case"].as_str().unwrap_or("?"),
            side.map_or(String::new(), |s| format!(", {s}")),
            degrees(&case["r_a_deg"]),
            degrees(&case["r_b_deg"]),
            degrees(&case["paper"][0]),
            degrees(&case["paper"][1]),
            degrees(&case["acceptance_deg"]),
            case["total"].as_f64().unwrap_or(f64::NAN)
        );
    }
    text
}

/// The two experiments of Fig. 8.
fn experiments(validation: &Value) -> String {
    let mut text = String::new();
    for (name, what) in [
        ("experiment_1_moving_disk", "1, a small disk far away"),
        (
            "experiment_2_masked_plane",
            "2, a plane, light taken by its angle",
        ),
    ] {
        if let Some(experiment) = validation.get(name) {
            let number = |key: &str| experiment[key].as_f64().unwrap_or(f64::NAN);
            let _ = writeln!(
                text,
                "- Experiment {what}: {:.1e} RMS, {:.1e} at most, of the peak.",
                number("rms"),
                number("maximum")
            );
        }
    }
    text
}

/// The rows of Fig. 12.
fn sizes(size: &Value) -> String {
    let mut text = String::new();
    for shot in size["shots"].as_array().into_iter().flatten() {
        let number = |key: &str| figure(&shot[key], 3, "");
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            number("pitch_um"),
            shot["mode"].as_str().unwrap_or("–"),
            number("defocus_px"),
            number("amplitude_per_px_of_defocus"),
            number("of_classic"),
            number("difference_rms")
        );
    }
    text
}

/// Our sharpness beside that of the paper's Table 2.
fn table_2(paper: &Paper, table: &Value) -> String {
    let mut text = String::new();
    for row in &paper.table2 {
        let printed = |p: &Printed| format!("{} → {} ({} %)", p.raw, p.corrected, p.gain);
        let _ = write!(
            text,
            "| {} | {}{}",
            row.setup,
            row.metric,
            if row.metric == "Wee" { " (1e-12)" } else { "" }
        );
        for (position, paper) in [(POSITIONS[0].0, &row.centre), (POSITIONS[1].0, &row.corner)] {
            for (light, ..) in LIGHT {
                let ours = sharpness(table, row, light, position);
                let _ = write!(text, " | {}", ours.as_deref().unwrap_or("–"));
            }
            let _ = write!(text, " | {}", printed(paper));
        }
        text += " |\n";
    }
    text
}

/// What was measured of a row at a position, if it was.
fn sharpness(table: &Value, row: &Table2Row, light: &str, position: &str) -> Option<String> {
    let rows = table["rows"].as_array().into_iter().flatten();
    let measured = rows
        .into_iter()
        .find(|r| r["setup"] == format!("{}, {light}", row.setup) && r["position"] == position)?;
    let key = row.metric.to_lowercase();
    let raw = measured["sharpness"]["raw"][&key].as_f64()?;
    let corrected = measured["sharpness"]["corrected"][&key].as_f64()?;
    let scale = if row.metric == "Wee" { 1e12 } else { 1.0 };
    Some(format!(
        "{:.4} → {:.4} ({:+.2} %)",
        raw * scale,
        corrected * scale,
        100.0 * (corrected / raw - 1.0)
    ))
}

/// View A of both charts, and the alphabet's sum; a row by rays, a row by waves.
fn figure_10(tools: &Tools) -> Result<Vec<Vec<quadpixel::image::Image>>, Box<dyn Error>> {
    let row = |(_, light, _): (&str, &str, &str)| {
        let panel = |name: &str, view: &str| {
            let file = format!("{name}-{light}-views/{view}.exr");
            pictures::panel(&tools.work.join(file), 480)
        };
        Ok(vec![
            panel("fig10-resolution", "view_A")?,
            panel("fig10-alphabet", "view_A")?,
            panel("fig10-alphabet", "sum_all")?,
        ])
    };
    LIGHT.into_iter().map(row).collect()
}

/// Per setup and light the middle of the sums, raw and corrected, at the centre and in the corner.
fn figure_15(tools: &Tools) -> Result<Vec<Vec<quadpixel::image::Image>>, Box<dyn Error>> {
    const SIDE_PX: usize = 75;
    let rows = SETUPS.iter().flat_map(|(_, setup)| {
        LIGHT
            .iter()
            .map(move |(_, light, _)| format!("{setup}-{light}"))
    });
    let row = |setup: String| {
        let files = POSITIONS.iter().flat_map(|(_, place, _)| {
            ["views/sum_all.exr", "corrected/corrected.exr"]
                .map(|file| format!("{setup}-{place}-alphabet-{file}"))
        });
        files
            .map(|file| pictures::panel(&tools.work.join(file), SIDE_PX))
            .collect()
    };
    rows.map(row).collect()
}
