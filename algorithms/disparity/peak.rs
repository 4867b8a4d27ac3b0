//! The best shift on a surface of correlations, and whether it can be believed.

use super::matches::Verdict;
use super::settings::Limits;

/// A summit farther than this from the largest value, px, is not believed.
const FARTHEST: f64 = 0.75;

/// Correlations at the whole-pixel shifts `centre + (i − rx, j − ry)`, row-major; NaN where the window leaves B.
pub(super) struct Surface<'a> {
    /// One each `step` numbers.
    pub zncc: &'a [f32],
    pub step: usize,
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
    /// Its shift, px.
    pub fn position(&self) -> [f64; 2] {
        [0, 1].map(|i| f64::from(self.whole[i]) + self.fraction[i])
    }

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
        let value = self.value(((j + ry) * (2 * rx + 1) + i + rx) as usize);
        (!value.is_nan()).then_some(value)
    }

    fn value(&self, index: usize) -> f32 {
        self.zncc[index * self.step]
    }

    /// All entries with their index.
    pub fn values(&self) -> impl Iterator<Item = (usize, f32)> {
        (self.zncc.iter().step_by(self.step).copied()).enumerate()
    }

    /// Shift of entry `index` from the centre.
    fn place(&self, index: usize) -> (i32, i32) {
        let (index, columns) = (index as i32, 2 * self.radius[0] + 1);
        (
            index % columns - self.radius[0],
            index / columns - self.radius[1],
        )
    }

    /// Largest value, and what speaks against it.
    pub fn peak(&self, free: [bool; 2], limits: &Limits) -> Peak {
        let mut best: Option<usize> = None;
        for (index, value) in self.values() {
            // NaN loses every comparison.
            if value > best.map_or(f32::NEG_INFINITY, |b| self.value(b)) {
                best = Some(index);
            }
        }
        match best {
            Some(index) => self.judge(index, None, free, limits),
            None => Peak::none(Verdict::Outside),
        }
    }

    /// The peak at entry `index`, which is the largest; on the way out: too low, at the edge along a `free` axis, or
    /// with a rival. `high` counts the values above [`high`], where they have been counted.
    pub fn judge(&self, index: usize, high: Option<u32>, free: [bool; 2], limits: &Limits) -> Peak {
        let (height, (i, j)) = (self.value(index), self.place(index));
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
            if self.has_rival([i, j], height, high, limits) {
                peak.verdict = Verdict::Ambiguous;
            }
            if let Some(fraction) = self.summit([i, j], free, peak.fraction) {
                peak.fraction = fraction;
            }
        }
        peak
    }

    /// Whether another local maximum is nearly as high.
    fn has_rival(
        &self,
        [i, j]: [i32; 2],
        height: f32,
        count: Option<u32>,
        limits: &Limits,
    ) -> bool {
        // Most surfaces hold nothing as high away from the peak: a count of all saves looking at each.
        if let Some(count) = count {
            let limit = high(height, limits);
            let near = (-1..=1).flat_map(|l| (-1..=1).map(move |k| (k, l)));
            let near = near.filter(|(k, l)| self.at(i + k, j + l).is_some_and(|v| v > limit));
            if count as usize == near.count() {
                return false;
            }
        }
        let rival = f64::from(height) * limits.second_peak;
        self.values().any(|(other, value)| {
            let (k, l) = self.place(other);
            f64::from(value) > rival
                && (k - i).abs().max((l - j).abs()) > 1
                && self.is_local_maximum(k, l, value)
        })
    }

    /// Maximum of the polynomial through the 5 × 5 values about the peak: one step of Newton's method from the vertices
    /// of the parabolas. It errs by 0.01 px on texture where they err by 0.04 px. `None` at the rim and where there is
    /// no maximum.
    fn summit(&self, [i, j]: [i32; 2], free: [bool; 2], start: [f64; 2]) -> Option<[f64; 2]> {
        let basis = [0, 1].map(|axis| basis(free[axis], start[axis]));
        let mut along = [[0.0f64; 5]; 3];
        for (l, dy) in (-2..=2).enumerate() {
            if !free[1] && dy != 0 {
                continue;
            }
            for (k, dx) in (-2..=2).enumerate() {
                if !free[0] && dx != 0 {
                    continue;
                }
                let value = f64::from(self.at(i + dx, j + dy)?);
                for (sum, weights) in along.iter_mut().zip(&basis[0]) {
                    sum[l] += weights[k] * value;
                }
            }
        }
        let down = |x: usize, y: usize| -> f64 {
            (along[x].iter().zip(&basis[1][y]))
                .map(|(v, w)| v * w)
                .sum()
        };
        let (x, y) = (down(1, 0), down(0, 1));
        let (xx, xy, yy) = (down(2, 0), down(1, 1), down(0, 2));
        let step = match free {
            [true, true] => {
                let determinant = xx * yy - xy * xy;
                if xx >= 0.0 || determinant <= 0.0 {
                    return None;
                }
                [
                    (xy * y - yy * x) / determinant,
                    (xy * x - xx * y) / determinant,
                ]
            }
            [true, false] if xx < 0.0 => [-x / xx, 0.0],
            [false, true] if yy < 0.0 => [0.0, -y / yy],
            _ => return None,
        };
        let summit = [start[0] + step[0], start[1] + step[1]];
        summit.iter().all(|d| d.abs() <= FARTHEST).then_some(summit)
    }

    fn is_local_maximum(&self, i: i32, j: i32, value: f32) -> bool {
        (-1..=1).all(|l| (-1..=1).all(|k| self.at(i + k, j + l).is_none_or(|v| v <= value)))
    }
}

/// A height that every rival of a peak of `height` lies above.
pub(super) fn high(height: f32, limits: &Limits) -> f32 {
    // Rounded to f32 it may lie above the limit by half a unit in the last place.
    height * (limits.second_peak * (1.0 - 1e-6)) as f32
}

/// Weights of the values at −2..2 in their polynomial at `t` (Lagrange), in its slope and in its curvature; on an axis
/// that is not `free`, the value in the middle alone.
fn basis(free: bool, t: f64) -> [[f64; 5]; 3] {
    if !free {
        return [[0.0, 0.0, 1.0, 0.0, 0.0], [0.0; 5], [0.0; 5]];
    }
    let t2 = t * t;
    [
        [
            t * (t2 - 1.0) * (t - 2.0) / 24.0,
            -t * (t - 1.0) * (t2 - 4.0) / 6.0,
            (t2 - 1.0) * (t2 - 4.0) / 4.0,
            -t * (t + 1.0) * (t2 - 4.0) / 6.0,
            t * (t2 - 1.0) * (t + 2.0) / 24.0,
        ],
        [
            (t * (4.0 * t2 - 6.0 * t - 2.0) + 2.0) / 24.0,
            -(t * (4.0 * t2 - 3.0 * t - 8.0) + 4.0) / 6.0,
            t * (4.0 * t2 - 10.0) / 4.0,
            -(t * (4.0 * t2 + 3.0 * t - 8.0) - 4.0) / 6.0,
            (t * (4.0 * t2 + 6.0 * t - 2.0) - 2.0) / 24.0,
        ],
        [
            (12.0 * t2 - 12.0 * t - 2.0) / 24.0,
            -(12.0 * t2 - 6.0 * t - 8.0) / 6.0,
            (12.0 * t2 - 10.0) / 4.0,
            -(12.0 * t2 + 6.0 * t - 8.0) / 6.0,
            (12.0 * t2 + 12.0 * t - 2.0) / 24.0,
        ],
    ]
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
                step: 1,
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
