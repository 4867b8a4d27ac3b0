//! How well a pixel parts light from the left and from the right (section 2.1.2 of Chataignier et al., Opt. Express 27,
//! 30486 (2019)).
//!
//! For light that aims at one side the rejection ratio is P of the other side over P of that side (eq. 1). It is above
//! the threshold 0.2 about the normal, where diffraction mixes the sub-pixels, and again beyond the angle at which
//! light goes over to the neighbour:
//!
//! ```text
//! ratio 1 ┤╲            ╱
//!     0.2 ┤┄┄╲┄┄┄┄┄┄┄┄╱┄┄┄
//!         ┤    ╲____╱
//!         └────┴────┴──── θ
//!         0   R_a  R_a + R_b = acceptance
//! ```

/// The threshold of the paper: the sub-pixel aimed at gets five times the other.
pub const REJECTION_THRESHOLD: f64 = 0.2;
/// The ratio at which light has gone over to the neighbour: the acceptance ends before it.
const CROSSTALK: f64 = 2.0 * REJECTION_THRESHOLD;

/// Ranges of one side of a rejection curve, in degrees.
///
/// Interference in the layers makes fine curves wavy, and some graze the threshold: R_b then ends at the first graze,
/// however small. The acceptance does not: it looks on for angles below the threshold until the ratio passes twice the
/// threshold. For a smooth curve it is R_a + R_b.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RejectionRanges {
    /// R_a: from the start of the curve to where the ratio first falls below the threshold; `None` if it never does.
    pub r_a_deg: Option<f64>,
    /// R_b: the width beyond it in which the ratio stays below; 0 if it never falls.
    pub r_b_deg: f64,
    /// The angle up to which the pixel parts the light, grazes passed over: where the ratio last rises above the
    /// threshold.
    pub acceptance_deg: Option<f64>,
    /// Whether the ratio stays below the threshold to the end of the curve: R_b and the acceptance are at least so
    /// wide.
    pub open: bool,
}

impl RejectionRanges {
    /// The ranges of a curve given from its centre outwards: angles in degrees, increasing, and the ratio at each.
    /// Linear between them. A ratio that is no number (no light on either side) counts as crosstalk.
    pub fn from_curve(theta_deg: &[f64], ratio: &[f64]) -> Self {
        let curve: Vec<(f64, f64)> = theta_deg
            .iter()
            .copied()
            .zip(ratio.iter().copied())
            .collect();
        let below = |p: (f64, f64)| p.1 < REJECTION_THRESHOLD;
        let Some(first) = curve.iter().position(|p| below(*p)) else {
            return Self {
                r_a_deg: None,
                r_b_deg: 0.0,
                acceptance_deg: None,
                open: false,
            };
        };
        let start = curve[0].0;
        let falls = match first.checked_sub(1) {
            Some(before) => crossing(curve[first], curve[before]),
            None => start,
        };
        // Where each stretch below the threshold ends; the first one's end closes R_b.
        let (mut inside, mut first_end, mut last) = (true, None, falls);
        for pair in curve[first..].windows(2) {
            let (here, next) = (pair[0], pair[1]);
            if inside && !below(next) {
                last = crossing(here, next);
                first_end = first_end.or(Some(last));
            }
            inside = below(next);
            if next.1.is_nan() || next.1 >= CROSSTALK {
                break;
            }
        }
        if let (true, Some(end)) = (inside, curve.last()) {
            last = end.0;
        }
        Self {
            r_a_deg: Some(falls - start),
            r_b_deg: first_end.unwrap_or(last) - falls,
            acceptance_deg: Some(last - start),
            open: first_end.is_none(),
        }
    }
}

/// Where the line between a point below the threshold and one above it meets it; at the one below if the other is not
/// finite.
fn crossing(low: (f64, f64), high: (f64, f64)) -> f64 {
    if !high.1.is_finite() {
        return low.0;
    }
    low.0 + (high.0 - low.0) * (REJECTION_THRESHOLD - low.1) / (high.1 - low.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(step: f64, f: impl Fn(f64) -> f64) -> RejectionRanges {
        let theta: Vec<f64> = (0..)
            .map(|i| f64::from(i) * step)
            .take_while(|t| *t <= 40.0)
            .collect();
        let ratio: Vec<f64> = theta.iter().map(|t| f(*t)).collect();
        RejectionRanges::from_curve(&theta, &ratio)
    }

    #[test]
    fn a_parabola_of_known_roots_gives_its_ranges() {
        // 0.1 + 0.01 (θ − 17)² / 9 is 0.2 at θ = 17 ± √90.
        let f = |t: f64| 0.1 + 0.01 * (t - 17.0) * (t - 17.0) / 9.0;
        let root = 90f64.sqrt();
        for (step, error) in [(2.0, 0.06), (0.5, 0.004)] {
            let r = sampled(step, f);
            // A chord lies off a parabola of curvature c by at most c h²/8; over the slope there, that in θ.
            let a = r.r_a_deg.unwrap_or(f64::NAN);
            assert!((a - (17.0 - root)).abs() < error, "{r:?}");
            assert!((r.r_b_deg - 2.0 * root).abs() < 2.0 * error, "{r:?}");
            assert!(!r.open);
        }
    }

    #[test]
    fn straight_lines_are_met_exactly() {
        let r = sampled(4.0, |t| (1.0 - t / 10.0).max(t / 100.0 - 0.1));
        assert_eq!(r.r_a_deg.map(|a| (a * 1e9).round()), Some(8e9));
        assert_eq!(r.acceptance_deg.map(|a| (a * 1e9).round()), Some(30e9));
        assert!((r.r_b_deg - 22.0).abs() < 1e-9);
    }

    #[test]
    fn a_graze_ends_r_b_but_not_the_acceptance_which_crosstalk_ends() {
        // Below 0.2 from 10 to 16 and 17 to 25, a graze up to 0.22 between; clearly above at 30, and below again
        // beyond.
        let nodes = [
            (0.0, 0.6),
            (10.0, 0.2),
            (13.0, 0.15),
            (16.0, 0.2),
            (16.5, 0.22),
            (17.0, 0.2),
            (20.0, 0.1),
            (25.0, 0.2),
            (30.0, 0.8),
            (35.0, 0.2),
            (40.0, 0.1),
        ];
        let f = |t: f64| {
            let i = nodes
                .iter()
                .position(|n| n.0 >= t)
                .unwrap_or(nodes.len() - 1)
                .max(1);
            let (a, b) = (nodes[i - 1], nodes[i]);
            a.1 + (b.1 - a.1) * (t - a.0) / (b.0 - a.0)
        };
        let r = sampled(0.25, f);
        let close = |a: Option<f64>, b: f64| (a.unwrap_or(f64::NAN) - b).abs() < 1e-9;
        assert!(
            close(r.r_a_deg, 10.0) && close(r.acceptance_deg, 25.0),
            "{r:?}"
        );
        assert!((r.r_b_deg - 6.0).abs() < 1e-9 && !r.open, "{r:?}");
    }

    #[test]
    fn curves_that_never_fall_never_rise_or_start_below() {
        let never = sampled(1.0, |_| 0.5);
        assert_eq!((never.r_a_deg, never.r_b_deg), (None, 0.0));
        assert_eq!(never.acceptance_deg, None);
        let stays = sampled(1.0, |t| 1.0 - t / 20.0);
        assert!(stays.open && (stays.r_b_deg - 24.0).abs() < 1e-9);
        let ideal = sampled(1.0, |t| if t < 15.5 { 0.0 } else { f64::NAN });
        assert_eq!(
            (ideal.r_a_deg, ideal.r_b_deg, ideal.open),
            (Some(0.0), 15.0, false)
        );
        assert_eq!(RejectionRanges::from_curve(&[], &[]).r_a_deg, None);
    }
}
