//! What the curves say, as tables.

use std::fmt::Write;

use super::measured::Measured;
use quadpixel_algorithms::autofocus::{peak, zero_crossing};

/// A stack in order of focus, with its answers in dioptres (1/m, from the entrance pupil).
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(super) struct Curve {
    pub scene: String,
    /// Peak of the mean gradient.
    pub gradient_peak_per_m: Option<f64>,
    /// Peak of De.
    pub de_peak_per_m: Option<f64>,
    /// Peak of Wee.
    pub wee_peak_per_m: Option<f64>,
    /// Zero of the measured phase difference.
    pub phase_zero_per_m: Option<f64>,
    /// Zero of the true one, the lens's aberrations included.
    pub true_phase_zero_per_m: Option<f64>,
    /// Zero of the true circle of confusion: the focus of the ideal lens.
    pub true_focus_per_m: Option<f64>,
    pub samples: Vec<Measured>,
}

impl Curve {
    pub fn new(scene: String, samples: Vec<Measured>) -> Self {
        let of = |value: &dyn Fn(&Measured) -> Option<f64>| -> Vec<(f64, f64)> {
            let points = samples.iter();
            points
                .filter_map(|m| Some((m.step.focus_per_m, value(m)?)))
                .collect()
        };
        Self {
            gradient_peak_per_m: peak(&of(&|m| Some(m.step.sharpness.gradient))),
            de_peak_per_m: peak(&of(&|m| Some(m.step.sharpness.de))),
            wee_peak_per_m: peak(&of(&|m| Some(m.step.sharpness.wee))),
            phase_zero_per_m: zero_crossing(&of(&|m| m.step.phase.map(|p| p.shift_px))),
            true_phase_zero_per_m: zero_crossing(&of(&|m| m.truth.shift_px)),
            true_focus_per_m: zero_crossing(&of(&|m| m.truth.coc_px)),
            scene,
            samples,
        }
    }

    fn answers(&self) -> [(&'static str, Option<f64>); 6] {
        [
            ("phase_zero", self.phase_zero_per_m),
            ("true_phase_zero", self.true_phase_zero_per_m),
            ("true_focus", self.true_focus_per_m),
            ("gradient_peak", self.gradient_peak_per_m),
            ("de_peak", self.de_peak_per_m),
            ("wee_peak", self.wee_peak_per_m),
        ]
    }
}

fn cell(value: Option<f64>) -> String {
    value.map_or(String::new(), |v| v.to_string())
}

/// A line per sample; an empty cell where there is nothing.
pub(super) fn samples_csv(curves: &[Curve]) -> String {
    let mut text = String::from(
        "scene,sample,focus_per_m,gradient,de,wee,phase_px,phase_spread_px,trusted,true_phase_px,true_coc_px\n",
    );
    for curve in curves {
        for m in &curve.samples {
            let (s, phase) = (&m.step.sharpness, m.step.phase);
            // Writing into a String cannot fail.
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{},{}",
                curve.scene,
                m.sample,
                m.step.focus_per_m,
                s.gradient,
                s.de,
                s.wee,
                cell(phase.map(|p| p.shift_px)),
                cell(phase.map(|p| p.spread_px)),
                cell(phase.map(|p| p.trusted)),
                cell(m.truth.shift_px),
                cell(m.truth.coc_px),
            );
        }
    }
    text
}

/// A line per scene, dioptres.
pub(super) fn scenes_csv(curves: &[Curve]) -> String {
    let mut text = String::from(
        "scene,samples,phase_zero_per_m,true_phase_zero_per_m,true_focus_per_m,gradient_peak_per_m,de_peak_per_m,wee_peak_per_m\n",
    );
    for curve in curves {
        let cells = curve.answers().map(|(_, value)| cell(value));
        let _ = writeln!(
            text,
            "{},{},{}",
            curve.scene,
            curve.samples.len(),
            cells.join(",")
        );
    }
    text
}

/// For people.
pub(super) fn words(curves: &[Curve]) -> String {
    let mut text = String::from("focus in dioptres (1/m from the entrance pupil)\n");
    for curve in curves {
        let each = curve.answers().map(|(name, value)| {
            let value = value.map_or("none".to_owned(), |v| format!("{v:.4}"));
            format!("{} {value}", name.replace('_', " "))
        });
        let _ = writeln!(
            text,
            "{} ({} samples): {}",
            curve.scene,
            curve.samples.len(),
            each.join(", ")
        );
    }
    text
}
