//! The best shift on a surface of correlations, and whether it can be believed.

use super::{Limits, Verdict};

/// Correlations at the whole-pixel shifts `centre + (i − rx, j − ry)`, row-major; NaN where the window leaves B.
pub(super) struct Surface<'a> {
    pub zncc: &'a [f32],
    pub radius: [i32; 2],
    pub centre: [i32; 2],
}

/// A peak: whole pixels, the parabola's vertex relative to them, its height, and what speaks against it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Peak {
    pub whole: [i32; 2],
    pub fraction: [f64; 2],
    pub zncc: f32,
    pub verdict: Verdict,
}

impl Peak {
    pub fn none(verdict: Verdict) -> Self {
        Self {
            whole: [0; 2],
            fraction: [0.0; 2],
            zncc: f32::NAN,
            verdict,
        }
    }
}

impl Surface<'_> {
    fn at(&self, i: i32, j: i32) -> Option<f32> {
        let [rx, ry] = self.radius;
        if i.abs() > rx || j.abs() > ry {
            return None;
        }
        let value = self.zncc[((j + ry) * (2 * rx + 1) + i + rx) as usize];
        (!value.is_nan()).then_some(value)
    }

    /// Largest value; on the way out: too low, at the edge along a `free` axis, or with a rival.
    pub fn peak(&self, free: [bool; 2], limits: &Limits) -> Peak {
        let columns = 2 * self.radius[0] + 1;
        let place = |index: usize| {
            let index = index as i32;
            (
                index % columns - self.radius[0],
                index / columns - self.radius[1],
            )
        };
        let mut best: Option<usize> = None;
        for (index, &value) in self.zncc.iter().enumerate() {
            // NaN loses every comparison.
            if value > best.map_or(f32::NEG_INFINITY, |b| self.zncc[b]) {
                best = Some(index);
            }
        }
        let Some(index) = best else {
            return Peak::none(Verdict::Outside);
        };
        let (height, (i, j)) = (self.zncc[index], place(index));
        let mut peak = Peak {
            whole: [self.centre[0] + i, self.centre[1] + j],
            fraction: [0.0; 2],
            zncc: height,
            verdict: Verdict::Valid,
        };
        if f64::from(height) < limits.zncc {
            peak.verdict = Verdict::LowCorrelation;
            return peak;
        }
        for (axis, step) in [(0, (1, 0)), (1, (0, 1))] {
            if !free[axis] {
                continue;
            }
            let before = self.at(i - step.0, j - step.1);
            let after = self.at(i + step.0, j + step.1);
            match (before, after) {
                (Some(before), Some(after)) => {
                    peak.fraction[axis] = vertex(before.into(), height.into(), after.into());
                }
                _ => peak.verdict = Verdict::SearchEdge,
            }
        }
        if peak.verdict == Verdict::Valid {
            let rival = f64::from(height) * limits.second_peak;
            let ambiguous = (self.zncc.iter().enumerate()).any(|(other, &value)| {
                f64::from(value) > rival && {
                    let (k, l) = place(other);
                    (k - i).abs().max((l - j).abs()) > 1 && self.is_local_maximum(k, l, value)
                }
            });
            if ambiguous {
                peak.verdict = Verdict::Ambiguous;
            }
        }
        peak
    }

    fn is_local_maximum(&self, i: i32, j: i32, value: f32) -> bool {
        (-1..=1).all(|l| (-1..=1).all(|k| self.at(i + k, j + l).is_none_or(|v| v <= value)))
    }
}

/// Vertex of the parabola through three equidistant values with the largest in the middle, within ±½.
fn vertex(before: f64, middle: f64, after: f64) -> f64 {
    let curvature = before - 2.0 * middle + after;
    if curvature < 0.0 {
        (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertex_of_a_parabola_is_exact() {
        for truth in [-0.4, 0.0, 0.3] {
            let f = |x: f64| 1.0 - 0.2 * (x - truth) * (x - truth);
            assert!((vertex(f(-1.0), f(0.0), f(1.0)) - truth).abs() < 1e-12);
        }
    }

    #[test]
    fn two_equal_peaks_are_ambiguous_and_a_peak_at_the_end_is_an_edge() {
        let one_row = |zncc: &[f32]| {
            let surface = Surface {
                zncc,
                radius: [3, 0],
                centre: [0, 0],
            };
            surface.peak([true, false], &Limits::default()).verdict
        };
        assert_eq!(
            one_row(&[0.1, 0.9, 0.1, 0.0, 0.1, 0.88, 0.1]),
            Verdict::Ambiguous
        );
        assert_eq!(
            one_row(&[0.1, 0.9, 0.1, 0.0, 0.1, 0.5, 0.1]),
            Verdict::Valid
        );
        assert_eq!(
            one_row(&[0.9, 0.8, 0.1, 0.0, 0.1, 0.1, 0.1]),
            Verdict::SearchEdge
        );
        assert_eq!(
            one_row(&[0.1, 0.2, 0.4, 0.1, 0.1, 0.1, 0.1]),
            Verdict::LowCorrelation
        );
        let nan = f32::NAN;
        assert_eq!(
            one_row(&[nan, 0.9, 0.8, 0.1, 0.1, 0.1, 0.1]),
            Verdict::SearchEdge
        );
        assert_eq!(one_row(&[nan; 7]), Verdict::Outside);
    }
}
