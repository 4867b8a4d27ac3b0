//! The data card: `README.md` in a dataset says what it holds, under which licence, and how its quantities are
//! distributed, with plots. Of the samples' descriptions alone, so the same samples give the same bytes.

pub mod gallery;
mod histogram;

use std::collections::BTreeMap;
use std::fmt::Write;

use quadpixel_datasets::{FileEntry, Range, SampleEntry, SampleMeta, Split, paths};

use crate::ledger::Ledger;
use crate::preview::number;

/// A number that every sample has, or may have.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    /// Stem of the plot's file.
    file: &'static str,
    /// Whether its plot is logarithmic.
    log: bool,
    value: fn(&SampleMeta) -> Option<f64>,
}

const QUANTITIES: [Quantity; 9] = [
    Quantity {
        name: "depth in focus",
        unit: "m",
        file: "focus",
        log: true,
        value: |m| m.focus.distance_m,
    },
    Quantity {
        name: "nearest depth",
        unit: "m",
        file: "nearest",
        log: true,
        value: |m| m.ranges.depth_m.map(|r| r.min),
    },
    Quantity {
        name: "farthest depth but the sky",
        unit: "m",
        file: "farthest",
        log: true,
        value: |m| m.ranges.depth_m.map(|r| r.max),
    },
    Quantity {
        name: "largest disparity of a sub-pixel",
        unit: "px",
        file: "disparity",
        log: false,
        value: |m| Some(size(m.ranges.dx_px?).max(size(m.ranges.dy_px?))),
    },
    Quantity {
        name: "largest circle of confusion",
        unit: "px",
        file: "coc",
        log: false,
        value: |m| m.ranges.coc_px.map(size),
    },
    Quantity {
        name: "ratio of disparity to circle of confusion",
        unit: "1",
        file: "ratio",
        log: false,
        value: |m| m.coc_disparity.map(|c| c.traced_ratio),
    },
    Quantity {
        name: "image height of the window",
        unit: "mm",
        file: "height",
        log: false,
        value: |m| Some(m.sensor.centre_mm[0].hypot(m.sensor.centre_mm[1])),
    },
    Quantity {
        name: "F-number",
        unit: "1",
        file: "f_number",
        log: false,
        value: |m| Some(m.lens.f_number),
    },
    Quantity {
        name: "median relative error of a rendered value",
        unit: "%",
        file: "error",
        log: false,
        value: |m| m.statistics.median_relative_error.map(|e| 100.0 * e),
    },
];

fn size(range: Range) -> f64 {
    range.min.abs().max(range.max.abs())
}

/// Rows of a table of the card, at most: a dataset of pictures with depth has a name per picture.
const LONGEST_TABLE: usize = 40;

/// What the samples are, counted.
#[derive(Clone, Debug, Default)]
pub struct Census {
    lenses: BTreeMap<String, u64>,
    responses: BTreeMap<String, u64>,
    charts: BTreeMap<String, u64>,
    windows: BTreeMap<String, u64>,
    effects: Ledger,
    values: [Vec<f64>; QUANTITIES.len()],
}

impl Census {
    /// Counts a sample.
    pub fn count(&mut self, meta: &SampleMeta) {
        let add = |to: &mut BTreeMap<String, u64>, what: String| *to.entry(what).or_default() += 1;
        add(&mut self.lenses, meta.lens.name.clone());
        let response = &meta.response;
        add(
            &mut self.responses,
            format!("{}, {}", response.pixel, response.label()),
        );
        let sensor = &meta.sensor;
        add(
            &mut self.windows,
            format!(
                "{} × {} pixels of {} × {} sub-pixels",
                sensor.width_px,
                sensor.height_px,
                sensor.subpixels.m(),
                sensor.subpixels.n()
            ),
        );
        for chart in &meta.scene.charts {
            add(&mut self.charts, chart.clone());
        }
        self.effects.count(&meta.effects);
        for (values, quantity) in self.values.iter_mut().zip(&QUANTITIES) {
            values.extend((quantity.value)(meta).filter(|v| v.is_finite()));
        }
    }

    /// The quantities that some sample has, with their values in order of size.
    fn distributions(&self) -> Vec<(&'static Quantity, Vec<f64>)> {
        let sorted = |values: &Vec<f64>| {
            let mut values = values.clone();
            values.sort_by(f64::total_cmp);
            values
        };
        let all = QUANTITIES.iter().zip(self.values.iter().map(sorted));
        all.filter(|(_, values)| !values.is_empty()).collect()
    }
}

/// The card and its plots: paths below the dataset's folder, and texts. `files` are those of the samples.
pub(crate) fn pages(
    census: &Census,
    entries: &[SampleEntry],
    files: &[FileEntry],
    licence: &str,
) -> Vec<(String, String)> {
    let distributions = census.distributions();
    let plot = |(quantity, values): &(&Quantity, Vec<f64>)| {
        let title = label(quantity);
        (
            plot_path(quantity),
            histogram::svg(&title, values, quantity.log),
        )
    };
    let mut pages: Vec<(String, String)> = distributions.iter().map(plot).collect();
    let card = text(census, entries, files, licence, &distributions);
    pages.push((paths::CARD.to_string(), card));
    pages
}

fn plot_path(quantity: &Quantity) -> String {
    format!("{}/{}.svg", paths::PLOTS, quantity.file)
}

fn label(quantity: &Quantity) -> String {
    match quantity.unit {
        "1" => quantity.name.to_string(),
        unit => format!("{}, {unit}", quantity.name),
    }
}

fn text(
    census: &Census,
    entries: &[SampleEntry],
    files: &[FileEntry],
    licence: &str,
    distributions: &[(&Quantity, Vec<f64>)],
) -> String {
    let count = |split: Split| entries.iter().filter(|entry| entry.split == split).count();
    let scenes: std::collections::BTreeSet<&str> =
        entries.iter().map(|e| e.scene.as_str()).collect();
    let bytes: u64 = files.iter().map(|file| file.bytes).sum();
    let each = bytes as f64 * 1e-6 / entries.len().max(1) as f64;
    let mut card = String::new();
    let licence_text = cell(licence);
    // Writing to a String cannot fail.
    let _ = write!(
        card,
        "---\nlicense: {}\ntags: [dual-pixel, quad-pixel, depth-estimation, synthetic]\n---\n\n# quadpixel dataset\n\n\
         Simulated images of a camera whose pixels see the pupil in parts, with true depth, disparity and circle of confusion. \
         `{}` holds the configuration, units, frames and signs, and the hash of every file; `{}` shows the samples.\n\n\
         Licence: {licence_text}. Made by qpgen {}. Check it with `qpgen check`.\n\n\
         | | |\n|---|---|\n| samples | {} |\n| train, val, test (by scene) | {}, {}, {} |\n| scenes | {} |\n| files of the samples | {} |\n\
         | their size | {:.1} MB, {each:.2} MB per sample |\n\n",
        spdx(licence).to_lowercase(),
        paths::DATASET,
        paths::INDEX,
        env!("CARGO_PKG_VERSION"),
        entries.len(),
        count(Split::Train),
        count(Split::Val),
        count(Split::Test),
        scenes.len(),
        files.len(),
        bytes as f64 * 1e-6,
    );
    let counted = [
        ("Main lenses", &census.lenses),
        ("Angular responses", &census.responses),
        ("Sensor windows", &census.windows),
        ("Charts, by card", &census.charts),
    ];
    for (title, table) in counted {
        let _ = write!(card, "## {title}\n\n| what | samples |\n|---|---|\n");
        for (what, number) in table.iter().take(LONGEST_TABLE) {
            let _ = writeln!(card, "| {} | {number} |", cell(what));
        }
        if table.len() > LONGEST_TABLE {
            let rest = table.len() - LONGEST_TABLE;
            let samples: u64 = table.values().skip(LONGEST_TABLE).sum();
            let _ = writeln!(card, "| {rest} others | {samples} |");
        }
        card.push('\n');
    }
    card.push_str(
        "## Effects\n\n| effect | simulated, samples | left out, samples | why | estimated error, at most |\n\
         |---|---|---|---|---|\n",
    );
    for (effect, row) in census.effects.rows() {
        let reasons: Vec<String> = row.reasons.iter().map(|reason| cell(reason)).collect();
        let _ = writeln!(
            card,
            "| {} | {} | {} | {} | {} |",
            cell(&effect.to_string()),
            row.simulated,
            row.left_out,
            reasons.join("; "),
            row.estimate()
        );
    }
    card.push_str("\n## Distributions\n\nOne value per sample.\n\n| quantity | samples | min | 5 % | median | 95 % | max |\n|---|---|---|---|---|---|---|\n");
    for (quantity, values) in distributions {
        let at = |part: f64| number(values[((values.len() - 1) as f64 * part).round() as usize]);
        let _ = writeln!(
            card,
            "| {} | {} | {} | {} | {} | {} | {} |",
            label(quantity),
            values.len(),
            at(0.0),
            at(0.05),
            at(0.5),
            at(0.95),
            at(1.0)
        );
    }
    card.push('\n');
    for (quantity, _) in distributions {
        let _ = writeln!(card, "![{}]({})", label(quantity), plot_path(quantity));
    }
    card
}

/// A licence's name as the card's head holds it: the characters that SPDX names are made of.
fn spdx(licence: &str) -> String {
    let allowed = |c: &char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '+' | ' ');
    licence.chars().filter(allowed).collect()
}

/// A text from a configuration, harmless within a table: no cell, link, picture or markup is made of it.
fn cell(text: &str) -> String {
    let plain = |c: char| match c {
        c if c.is_control() => ' ',
        c => c,
    };
    let text: String = text.chars().map(plain).collect();
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '\\' | '|' | '[' | ']' | '`' | '!' => safe.extend(['\\', c]),
            c => safe.push(c),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_from_a_configuration_stays_in_its_cell() {
        assert_eq!(cell("a|b\n| <script>"), "a\\|b \\| &lt;script>");
        assert_eq!(cell("![x](http://y)"), "\\!\\[x\\](http://y)");
        assert_eq!(spdx("CC0-1.0\n---\n<x>"), "CC0-1.0---x");
    }
}
