//! The page: each figure of the paper beside ours, and a sentence on each difference.

use std::fmt::Write;
use std::path::Path;

use quadpixel::command::CommandError;
use quadpixel::file;
use serde_json::Value;

use crate::captures::{Captures, POSITIONS, SETUPS};
use crate::pictures;
use crate::studies::Studies;
use crate::tools::Tools;

const INTRODUCTION: &str = include_str!("introduction.md");
const REASONS: [(&str, &str); 7] = [
    ("rejection", include_str!("why_rejection.md")),
    ("tungsten", include_str!("why_tungsten.md")),
    ("cra", include_str!("why_cra.md")),
    ("pitch", include_str!("why_pitch.md")),
    ("wavelength", include_str!("why_wavelength.md")),
    ("size", include_str!("why_size.md")),
    ("table2", include_str!("why_table2.md")),
];
/// The paper's Table 2: setup, metric, then raw, corrected, gain in % at the centre and at 10°/45°.
const TABLE_2: [(&str, &str, [&str; 3], [&str; 3]); 9] = [
    (
        "ML-1 classic",
        "gradient",
        ["0.5048", "0.5079", "+0.6"],
        ["0.2573", "0.30", "+16.2"],
    ),
    (
        "ML-1 classic",
        "De",
        ["0.2378", "0.2384", "+0.25"],
        ["0.0703", "0.0875", "+25.5"],
    ),
    (
        "ML-1 classic",
        "Wee",
        ["0.5700", "0.5811", "+1.96"],
        ["0.3415", "0.4027", "+17.9"],
    ),
    (
        "ML-1 diffractive",
        "gradient",
        ["0.5428", "0.5424", "-0.09"],
        ["0.3361", "0.3672", "+9.3"],
    ),
    (
        "ML-1 diffractive",
        "De",
        ["0.2534", "0.2514", "-0.79"],
        ["0.0909", "0.1055", "+16.1"],
    ),
    (
        "ML-1 diffractive",
        "Wee",
        ["0.7657", "0.7696", "+0.5"],
        ["1.132", "1.210", "+6.94"],
    ),
    (
        "ML-2 diffractive, Table 1 defects",
        "gradient",
        ["0.5530", "0.5823", "+5.3"],
        ["0.2173", "0.2398", "+10.3"],
    ),
    (
        "ML-2 diffractive, Table 1 defects",
        "De",
        ["0.2059", "0.2283", "+10.9"],
        ["0.0361", "0.0465", "+28.8"],
    ),
    (
        "ML-2 diffractive, Table 1 defects",
        "Wee",
        ["1.018", "1.132", "+11.1"],
        ["0.4398", "0.5571", "+26.7"],
    ),
];

struct Page<'a> {
    out: &'a Path,
    tools: &'a Tools,
    text: String,
}

/// Writes the page and its pictures into `out`.
pub fn write(
    out: &Path,
    tools: &Tools,
    studies: &Studies,
    captures: &Captures,
) -> Result<(), CommandError> {
    file::create_folder(out).map_err(CommandError::failed)?;
    let mut page = Page {
        out,
        tools,
        text: INTRODUCTION.to_owned(),
    };
    if tools.quick {
        page.text += "\n**This is the quick page: coarse angles, the wave level, few rays, no Fig. 3(b).**\n";
    }
    page.pixel(studies)?;
    page.images(studies)?;
    page.table2(&captures.table)?;
    file::write_aside(&out.join("README.md"), page.text.as_bytes()).map_err(CommandError::failed)
}

/// A number of a table, if there is one.
fn figure(value: &Value, places: usize, unit: &str) -> String {
    let known = value.as_f64();
    known.map_or("–".to_owned(), |x| format!("{x:.places$}{unit}"))
}

impl Page<'_> {
    /// Figs. 2, 3, 5, 8, 11, 13.
    fn pixel(&mut self, studies: &Studies) -> Result<(), CommandError> {
        self.text += "\n## Figs. 2 and 3(a): angular response and rejection ratio\n\n";
        self.ranges(&studies.rejection);
        self.picture(
            "rejection/rejection.svg",
            "fig2-3a.svg",
            "P of left and right, and the rejection ratio",
        )?;
        self.reason("rejection");
        let _ = write!(
            self.text,
            "\nThe nine microlenses of section 2.1.2, ranked by the paper's four criteria:\n\n```text\n{}```\n",
            studies.microlens
        );
        self.picture(
            "microlens/microlens.svg",
            "section-2.1.2.svg",
            "Nine microlenses",
        )?;
        if let Some(tungsten) = &studies.tungsten {
            self.text += "\n## Fig. 3(b): tungsten walls\n\n";
            self.ranges(tungsten);
            self.picture(
                "tungsten/tungsten.svg",
                "fig3b.svg",
                "2.8 µm pixel without and with walls",
            )?;
            self.reason("tungsten");
        }
        self.text += "\n## Fig. 5: responses under shifted microlenses\n\n";
        self.picture(
            "cra/cra.svg",
            "fig5.svg",
            "P of sub-pixel A by chief-ray angle",
        )?;
        self.reason("cra");
        self.text += "\n## Fig. 8: the response put into the renderer and what comes back\n\n";
        for (name, what) in [
            ("experiment_1_moving_disk", "1, a small disk far away"),
            (
                "experiment_2_masked_plane",
                "2, a plane, light taken by its angle",
            ),
        ] {
            if let Some(e) = studies.validation.get(name) {
                let of = |key: &str| e[key].as_f64().unwrap_or(f64::NAN);
                let _ = writeln!(
                    self.text,
                    "- Experiment {what}: {:.1e} RMS, {:.1e} at most, of the peak.",
                    of("rms"),
                    of("maximum")
                );
            }
        }
        self.picture(
            "validation/validation.png",
            "fig8.png",
            "Put in, experiment 1, experiment 2",
        )?;
        self.text += "The paper shows its pictures side by side and names local differences from its bilinear interpolation and noise.\n";
        self.text += "\n## Fig. 11: pitch\n\n";
        self.picture(
            "pitch/pitch.svg",
            "fig11.svg",
            "R_a and R_b from 1.2 to 6 µm",
        )?;
        self.reason("pitch");
        self.text += "\n## Fig. 13: wavelength\n\n";
        self.ranges(&studies.wavelength);
        self.picture(
            "wavelength/wavelength.svg",
            "fig13.svg",
            "400, 532 and 700 nm, centred and shifted lens",
        )?;
        self.reason("wavelength");
        Ok(())
    }

    /// Figs. 10 and 12.
    fn images(&mut self, studies: &Studies) -> Result<(), CommandError> {
        self.text += "\n## Fig. 10: synthetic images\n\n";
        let work = &self.tools.work;
        let of = |name: &str, view: &str| {
            pictures::panel(&work.join(format!("{name}-views/{view}.exr")), 480)
        };
        let row = vec![
            of("fig10-resolution", "view_A")?,
            of("fig10-alphabet", "view_A")?,
            of("fig10-alphabet", "sum_all")?,
        ];
        pictures::write(&self.out.join("fig10.jpg"), &[row], 1)?;
        self.text += "![View A of a resolution chart and of the alphabet, and the alphabet's sum](fig10.jpg)\n\n\
            The middle of the sensor with sub-pixels of 1.75 µm, charts at 750 mm, diffractive mode. Our own resolution chart stands for ISO 12233. A \
            path-traced scene in the place of San Miguel: `benches/runs/2026-11-21/worlds.md`. The bright lines of the paper's views and what became of \
            them: `benches/runs/2026-11-21/cra.md`.\n";
        self.text += "\n## Fig. 12: pixel size\n\n";
        self.size(&studies.size);
        self.picture(
            "size/size.jpg",
            "fig12.jpg",
            "Views A and D, classic and diffractive, and their difference",
        )?;
        self.reason("size");
        Ok(())
    }

    fn size(&mut self, size: &Value) {
        self.text += "| pixel, µm | mode | defocus, px | disparity a px of defocus | of the classic one | difference of view A, RMS |\n|---|---|---|---|---|---|\n";
        for shot in size["shots"].as_array().into_iter().flatten() {
            let number = |key: &str| figure(&shot[key], 3, "");
            let _ = writeln!(
                self.text,
                "| {} | {} | {} | {} | {} | {} |",
                number("pitch_um"),
                shot["mode"].as_str().unwrap_or("–"),
                number("defocus_px"),
                number("amplitude_per_px_of_defocus"),
                number("of_classic"),
                number("difference_rms")
            );
        }
        self.text += "\n";
    }

    /// Fig. 15 and Table 2.
    fn table2(&mut self, table: &Value) -> Result<(), CommandError> {
        self.text += "\n## Fig. 15 and Table 2: aberrations taken out\n\n\
            | setup | metric | centre: ours | paper | 10°/45°: ours | paper |\n|---|---|---|---|---|---|\n";
        for (setup, metric, centre, corner) in TABLE_2 {
            let ours = |position: &str| {
                let rows = table["rows"].as_array().into_iter().flatten();
                let row = rows
                    .into_iter()
                    .find(|r| r["setup"] == setup && r["position"] == position)?;
                let key = metric.to_lowercase();
                let raw = row["sharpness"]["raw"][&key].as_f64()?;
                let corrected = row["sharpness"]["corrected"][&key].as_f64()?;
                let scale = if metric == "Wee" { 1e12 } else { 1.0 };
                Some(format!(
                    "{:.4} → {:.4} ({:+.2} %)",
                    raw * scale,
                    corrected * scale,
                    100.0 * (corrected / raw - 1.0)
                ))
            };
            let paper =
                |[raw, corrected, gain]: [&str; 3]| format!("{raw} → {corrected} ({gain} %)");
            let cell = |position: &str| ours(position).unwrap_or_else(|| "–".to_owned());
            let _ = writeln!(
                self.text,
                "| {setup} | {metric}{} | {} | {} | {} | {} |",
                if metric == "Wee" { " (1e-12)" } else { "" },
                cell(POSITIONS[0].0),
                paper(centre),
                cell(POSITIONS[1].0),
                paper(corner)
            );
        }
        let work = &self.tools.work;
        let side = 75;
        let mut rows = Vec::new();
        for (_, setup) in SETUPS {
            let mut row = Vec::new();
            for (_, place, _) in POSITIONS {
                let name = format!("{setup}-{place}-alphabet");
                row.push(pictures::panel(
                    &work.join(format!("{name}-views/sum_all.exr")),
                    side,
                )?);
                row.push(pictures::panel(
                    &work.join(format!("{name}-corrected/corrected.exr")),
                    side,
                )?);
            }
            rows.push(row);
        }
        pictures::write(&self.out.join("fig15.jpg"), &rows, 3)?;
        self.text += "\n![Middle of the sum, raw and corrected, at the centre, then at 10°/45°; a row a setup](fig15.jpg)\n\n";
        self.reason("table2");
        Ok(())
    }

    /// R_a and R_b beside the paper's.
    fn ranges(&mut self, study: &Value) {
        let _ = writeln!(
            self.text,
            "By `{}`.\n",
            study["model"].as_str().unwrap_or("?")
        );
        self.text += "| case | R_a | R_b | paper: R_a | R_b | acceptance | total absorbed within 30° |\n|---|---|---|---|---|---|---|\n";
        for case in study["cases"].as_array().into_iter().flatten() {
            let degrees = |v: &Value| figure(v, 1, "°");
            let side = case["side"].as_str().filter(|s| *s != "both");
            let _ = writeln!(
                self.text,
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
        self.text += "\n";
    }

    /// Copies a step's picture beside the page, and shows it.
    fn picture(&mut self, from: &str, to: &str, what: &str) -> Result<(), CommandError> {
        let path = self.tools.work.join(from);
        let bytes = file::read(&path).map_err(CommandError::failed)?;
        file::write_aside(&self.out.join(to), &bytes).map_err(CommandError::failed)?;
        let _ = writeln!(self.text, "![{what}]({to})\n");
        Ok(())
    }

    fn reason(&mut self, of: &str) {
        for (name, text) in REASONS {
            if name == of && !self.tools.quick {
                self.text += text;
            }
        }
    }
}
