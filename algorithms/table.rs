//! The form of the quad-pixel paper's Table 2: setup × metric down, positions across, in each raw → corrected and the
//! gain.
//!
//! ```text
//! gain = 100 (corrected/raw − 1) %
//! ```

use serde::Deserialize;
use std::fmt::Write;
use std::path::PathBuf;

use crate::calibrated_camera::{CalibratedCamera, PitchError};
use crate::calibration::{Calibration, CalibrationError, CalibrationSettings};
use crate::capture::Capture;
use crate::correct::{BeforeAfter, CorrectError, correct};
use crate::metrics::sharpness::{SharpnessError, SharpnessSettings};

/// The list of captures, as TOML.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableList {
    /// The measurements, in the order of the table.
    pub row: Vec<Entry>,
}

/// One measurement; paths are relative to the list's folder.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Name of the setup.
    pub setup: String,
    /// Name of the position.
    pub position: String,
    /// Capture of the calibration chart.
    pub calibration: PathBuf,
    /// Capture to correct.
    pub capture: PathBuf,
}

/// A measured entry.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Row {
    /// Name of the setup.
    pub setup: String,
    /// Name of the position.
    pub position: String,
    /// Sharpness.
    pub sharpness: BeforeAfter,
}

/// A row that cannot be measured: which capture, and why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RowError {
    /// The pitch of one of the captures is not known.
    #[error(transparent)]
    Pitch(#[from] PitchError),
    /// The chart gives no calibration.
    #[error(transparent)]
    Chart(#[from] CalibrationError),
    /// The capture cannot be corrected by it.
    #[error(transparent)]
    Correct(#[from] CorrectError),
    /// The capture's sharpness cannot be measured.
    #[error(transparent)]
    Sharpness(#[from] SharpnessError),
}

/// Calibrates by `chart`, corrects `capture`, and measures its reference channel before and after.
///
/// # Errors
/// A chart that gives no calibration, a capture of another camera, or one without a valid pixel.
pub fn measure(
    chart: &Capture,
    capture: &Capture,
    settings: &CalibrationSettings,
    sharpness: &SharpnessSettings,
) -> Result<BeforeAfter, RowError> {
    let chart_camera = CalibratedCamera::from_capture(chart, None)?;
    let camera = CalibratedCamera::from_capture(capture, None)?;
    let calibration = Calibration::from_chart(&chart.views, &chart_camera, settings)?;
    let corrected = correct(&capture.views, &camera, &calibration)?;
    let c = capture.reference_channel();
    Ok(BeforeAfter::measure(
        &capture.views,
        &corrected,
        c,
        sharpness,
    )?)
}

impl Row {
    /// Name, raw and corrected value of the three metrics, in the paper's order.
    pub fn metrics(&self) -> [(&'static str, f64, f64); 3] {
        let (a, b) = (&self.sharpness.raw, &self.sharpness.corrected);
        [
            ("gradient", a.gradient, b.gradient),
            ("De", a.de, b.de),
            ("Wee", a.wee, b.wee),
        ]
    }
}

/// 100 (corrected/raw − 1); `None` where raw is 0.
pub fn gain_percent(raw: f64, corrected: f64) -> Option<f64> {
    (raw != 0.0).then(|| 100.0 * (corrected / raw - 1.0))
}

/// Markdown: a cell that was not measured is empty.
pub fn markdown(rows: &[Row]) -> String {
    let setups = unique(rows.iter().map(|r| r.setup.as_str()));
    let positions = unique(rows.iter().map(|r| r.position.as_str()));
    let mut text = String::from("| setup | metric |");
    for position in &positions {
        text += &format!(" {position} | gain |");
    }
    text += "\n|---|---|";
    text += &"---|---|".repeat(positions.len());
    text.push('\n');
    for setup in &setups {
        for (index, metric) in ["gradient", "De", "Wee"].iter().enumerate() {
            let first = if index == 0 { setup } else { "" };
            text += &format!("| {first} | {metric} |");
            for position in &positions {
                let row = rows
                    .iter()
                    .find(|r| r.setup == *setup && r.position == *position);
                text += &row.map_or(" | |".to_owned(), |row| {
                    let (_, raw, corrected) = row.metrics()[index];
                    let gain = gain_percent(raw, corrected);
                    let gain = gain.map_or(String::new(), |g| format!("{g:+.2} %"));
                    format!(" {} → {} | {gain} |", number(raw), number(corrected))
                });
            }
            text.push('\n');
        }
    }
    text
}

/// CSV (RFC 4180): one line a setup, position and metric, numbers in full.
pub fn csv(rows: &[Row]) -> String {
    let mut text = String::from("setup,position,metric,raw,corrected,gain_percent\n");
    for row in rows {
        for (metric, raw, corrected) in row.metrics() {
            let gain = gain_percent(raw, corrected).map_or(String::new(), |g| g.to_string());
            let (setup, position) = (quoted(&row.setup), quoted(&row.position));
            // Writing into a String cannot fail.
            let _ = writeln!(text, "{setup},{position},{metric},{raw},{corrected},{gain}");
        }
    }
    text
}

fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

fn number(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-3 {
        format!("{value:.4e}")
    } else {
        format!("{value:.4}")
    }
}

fn quoted(text: &str) -> String {
    if text.contains(['"', ',', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::metrics::sharpness::Sharpness;

    fn row(setup: &str, position: &str, factor: f64) -> Row {
        let at = |f: f64| Sharpness {
            de: 0.25 * f,
            de_count: 1,
            wee: 5e-13 * f,
            gradient: 0.5 * f,
        };
        Row {
            setup: setup.to_owned(),
            position: position.to_owned(),
            sharpness: BeforeAfter {
                raw: at(1.0),
                corrected: at(factor),
                margin_px: 3,
            },
        }
    }

    #[test]
    fn the_table_has_the_papers_form_and_empty_cells_where_nothing_was_measured() {
        let rows = [
            row("classic", "centre", 1.01),
            row("classic", "10°/45°", 1.16),
            row("ML-2", "10°/45°", 0.5),
        ];
        let text = markdown(&rows);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[0],
            "| setup | metric | centre | gain | 10°/45° | gain |"
        );
        assert_eq!(
            lines[2],
            "| classic | gradient | 0.5000 → 0.5050 | +1.00 % | 0.5000 → 0.5800 | +16.00 % |"
        );
        assert_eq!(
            lines[7],
            "|  | Wee | | | 5.0000e-13 → 2.5000e-13 | -50.00 % |"
        );
        assert_eq!(lines.len(), 8);
        assert!(
            lines
                .iter()
                .all(|l| l.matches('|').count() == lines[0].matches('|').count())
        );
    }

    #[test]
    fn csv_quotes_what_would_split_a_line() {
        let text = csv(&[row("a, \"b\"", "centre", 2.0)]);
        assert_eq!(
            text.lines().nth(2),
            Some("\"a, \"\"b\"\"\",centre,De,0.25,0.5,100")
        );
        assert_eq!(gain_percent(0.0, 1.0), None);
    }
}
