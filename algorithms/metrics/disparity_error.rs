//! Errors of a disparity map against the truth, as the field quotes them.
//!
//! ```text
//! EPE = mean |e|     bad-t = fraction with |e| > t px     e = estimate − truth (a vector where disparity is one)
//! AIWE(p) = min over a, b of (Σ w |truth − (a · estimate + b)|^p / Σ w)^(1/p),   p = 1, 2
//! 1 − |ρ|,  ρ = Pearson's correlation of the ranks (Spearman), ties sharing their mean rank
//! ```
//!
//! AIWE and 1 − |ρ|: R. Garg et al., "Learning single camera depth estimation using dual-pixels", ICCV 2019; w is a
//! weight, as the confidence of the truth. ρ is not weighted: pairs of weight 0 do not count, all others count alike.

/// End-point errors over the pixels that have both an estimate and a truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct EndPointError {
    /// Pixels compared.
    pub pixels: usize,
    /// Mean, px.
    pub epe_px: f64,
    /// Root of the mean square, px.
    pub rms_px: f64,
    /// Fraction above 0.1 px.
    pub bad_01: f64,
    /// Fraction above 0.5 px.
    pub bad_05: f64,
    /// Fraction above 1 px.
    pub bad_1: f64,
}

impl EndPointError {
    /// From the lengths |e| in px of the errors; those that are not finite (no estimate or no truth) are passed over.
    /// `None` where none is left.
    pub fn from_lengths(lengths_px: impl IntoIterator<Item = f64>) -> Option<Self> {
        let lengths: Vec<f64> = lengths_px
            .into_iter()
            .filter(|e| e.is_finite())
            .map(f64::abs)
            .collect();
        let n = lengths.len() as f64;
        let bad = |limit: f64| lengths.iter().filter(|e| **e > limit).count() as f64 / n;
        (!lengths.is_empty()).then(|| Self {
            pixels: lengths.len(),
            epe_px: lengths.iter().sum::<f64>() / n,
            rms_px: (lengths.iter().map(|e| e * e).sum::<f64>() / n).sqrt(),
            bad_01: bad(0.1),
            bad_05: bad(0.5),
            bad_1: bad(1.0),
        })
    }
}

/// An estimate beside its truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// What was found.
    pub estimate: f64,
    /// What is.
    pub truth: f64,
    /// Weight, 0 or more.
    pub weight: f64,
}

/// Errors that do not see an affine change of the estimate.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct AffineInvariantError {
    /// Pairs compared.
    pub pairs: usize,
    /// AIWE(1), in units of the truth.
    pub aiwe_1: f64,
    /// AIWE(2), in units of the truth.
    pub aiwe_2: f64,
    /// 1 − |Spearman's ρ|; 1 where the estimate or the truth is constant.
    pub one_minus_spearman: f64,
}

impl AffineInvariantError {
    /// From pairs; those with a number that is not finite or without weight are passed over. `None` where fewer than
    /// two are left.
    pub fn from_pairs(pairs: &[Pair]) -> Option<Self> {
        let mut counted: Vec<Pair> = pairs
            .iter()
            .filter(|p| p.estimate.is_finite() && p.truth.is_finite())
            .filter(|p| p.weight > 0.0 && p.weight.is_finite())
            .copied()
            .collect();
        if counted.len() < 2 {
            return None;
        }
        let total: f64 = counted.iter().map(|p| p.weight).sum();
        counted.iter_mut().for_each(|p| p.weight /= total);
        let (slope, aiwe_2) = least_squares(&counted);
        Some(Self {
            pairs: counted.len(),
            aiwe_1: least_deviations(&counted, slope, aiwe_2),
            aiwe_2,
            one_minus_spearman: 1.0 - spearman(&counted).abs(),
        })
    }
}

/// Mean of `value` over the pairs, whose weights add up to 1.
fn mean(pairs: &[Pair], value: impl Fn(&Pair) -> f64) -> f64 {
    pairs.iter().map(|p| p.weight * value(p)).sum()
}

/// (a, AIWE(2)).
fn least_squares(pairs: &[Pair]) -> (f64, f64) {
    let (x0, y0) = (mean(pairs, |p| p.estimate), mean(pairs, |p| p.truth));
    let xx = mean(pairs, |p| (p.estimate - x0).powi(2));
    let xy = mean(pairs, |p| (p.estimate - x0) * (p.truth - y0));
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    let left = mean(pairs, |p| {
        (p.truth - y0 - slope * (p.estimate - x0)).powi(2)
    });
    (slope, left.sqrt())
}

/// AIWE(1): for a slope the best offset is the weighted median of what is left, and the error that leaves is convex in
/// the slope, so that its least value lies in an interval whose ends are both higher than its inside; golden section
/// narrows it.
fn least_deviations(pairs: &[Pair], slope: f64, rms: f64) -> f64 {
    let x0 = mean(pairs, |p| p.estimate);
    let spread = mean(pairs, |p| (p.estimate - x0).abs());
    let mut left: Vec<(f64, f64)> = Vec::with_capacity(pairs.len());
    let mut error = |slope: f64| {
        left.clear();
        left.extend(
            pairs
                .iter()
                .map(|p| (p.truth - slope * (p.estimate - x0), p.weight)),
        );
        let offset = weighted_median(&mut left);
        left.iter()
            .map(|(v, w)| w * (v - offset).abs())
            .sum::<f64>()
    };
    let mut best = error(slope);
    if !(spread > 0.0 && rms > 0.0) {
        return best;
    }
    // At slope ± reach the error is at least reach · spread/2 − rms, which is above the least-squares one's ≤ rms.
    let reach = 4.0 * rms / spread;
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let (mut low, mut high) = (slope - reach, slope + reach);
    let mut at = [high - golden * (high - low), low + golden * (high - low)];
    let mut errors = [error(at[0]), error(at[1])];
    for _ in 0..80 {
        if errors[0] <= errors[1] {
            high = at[1];
            at = [high - golden * (high - low), at[0]];
            errors = [error(at[0]), errors[0]];
        } else {
            low = at[0];
            at = [at[1], low + golden * (high - low)];
            errors = [errors[1], error(at[1])];
        }
        best = best.min(errors[0]).min(errors[1]);
    }
    best
}

/// The value at which half of the weight is reached; reorders `values` (value, weight), which is not empty.
fn weighted_median(values: &mut [(f64, f64)]) -> f64 {
    let half = values.iter().map(|v| v.1).sum::<f64>() / 2.0;
    let mut below = 0.0;
    let (mut start, mut end) = (0, values.len());
    while end - start > 1 {
        let part = &mut values[start..end];
        let middle = part.len() / 2; // 1 or more: both sides shrink
        part.select_nth_unstable_by(middle, |a, b| a.0.total_cmp(&b.0));
        let lower: f64 = part[..middle].iter().map(|v| v.1).sum();
        if below + lower >= half {
            end = start + middle;
        } else {
            below += lower;
            start += middle;
        }
    }
    values[start].0
}

fn spearman(pairs: &[Pair]) -> f64 {
    let x = ranks(&pairs.iter().map(|p| p.estimate).collect::<Vec<_>>());
    let y = ranks(&pairs.iter().map(|p| p.truth).collect::<Vec<_>>());
    let middle = (pairs.len() as f64 - 1.0) / 2.0;
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let terms = a.iter().zip(b).map(|(a, b)| (a - middle) * (b - middle));
        terms.sum()
    };
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    if scale > 0.0 {
        product(&x, &y) / scale
    } else {
        0.0
    }
}

/// Ranks from 0; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut start = 0;
    for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let rank = start as f64 + (group.len() as f64 - 1.0) / 2.0;
        group.iter().for_each(|i| ranks[*i] = rank);
        start += group.len();
    }
    ranks
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn pairs(count: usize, seed: u64) -> Vec<Pair> {
        let mut random = crate::random::Lcg(seed);
        let mut next = || random.uniform();
        (0..count)
            .map(|_| Pair {
                estimate: next(),
                truth: next(),
                weight: 0.1 + next(),
            })
            .collect()
    }

    #[test]
    fn end_point_errors_count_what_is_there() {
        let found =
            EndPointError::from_lengths([0.05, -0.2, 0.6, 3.0, f64::NAN, f64::INFINITY]).unwrap();
        assert_eq!(found.pixels, 4);
        assert!((found.epe_px - 3.85 / 4.0).abs() < 1e-15);
        assert!((found.rms_px - (9.4025f64 / 4.0).sqrt()).abs() < 1e-15);
        assert_eq!([found.bad_01, found.bad_05, found.bad_1], [0.75, 0.5, 0.25]);
        assert_eq!(EndPointError::from_lengths([f64::NAN]), None);
    }

    #[test]
    fn an_affine_change_of_the_truth_has_no_error() {
        for (a, b) in [(2.0, -1.0), (-0.3, 7.0), (1e6, 0.0)] {
            let mut pairs = pairs(50, 1);
            pairs.iter_mut().for_each(|p| p.estimate = a * p.truth + b);
            let found = AffineInvariantError::from_pairs(&pairs).unwrap();
            assert!(found.aiwe_1 < 1e-9 && found.aiwe_2 < 1e-9, "{found:?}");
            assert!(found.one_minus_spearman < 1e-12);
        }
    }

    #[test]
    fn aiwe_2_is_the_residual_that_no_line_can_explain() {
        // ±0.25 in the pattern + − − + has neither a mean nor a slope over 0, 1, 2, 3.
        let truth = [0.0, 2.0, 4.0, 6.0].iter().zip([0.25, -0.25, -0.25, 0.25]);
        let list: Vec<Pair> = (0..)
            .zip(truth)
            .map(|(i, (line, ripple))| Pair {
                estimate: f64::from(i),
                truth: line + ripple,
                weight: 3.0,
            })
            .collect();
        let found = AffineInvariantError::from_pairs(&list).unwrap();
        assert!((found.aiwe_2 - 0.25).abs() < 1e-15);
    }

    #[test]
    fn aiwe_1_is_that_of_the_best_line_through_two_of_the_points() {
        // A least-deviation line can always be chosen to pass through two points, so trying all pairs is exact.
        for seed in 1..=20 {
            let list = pairs(11, seed);
            let total: f64 = list.iter().map(|p| p.weight).sum();
            let mut wanted = f64::INFINITY;
            for p in &list {
                for q in &list {
                    let a = (q.truth - p.truth) / (q.estimate - p.estimate);
                    let b = p.truth - a * p.estimate;
                    let error = list
                        .iter()
                        .map(|r| r.weight * (r.truth - a * r.estimate - b).abs());
                    let error = error.sum::<f64>() / total;
                    if error < wanted {
                        wanted = error;
                    }
                }
            }
            let found = AffineInvariantError::from_pairs(&list).unwrap().aiwe_1;
            assert!(
                (found / wanted - 1.0).abs() < 1e-9,
                "{found} is not {wanted}"
            );
        }
    }

    #[test]
    fn spearman_follows_its_closed_form_and_ties_share_their_rank() {
        let list = pairs(40, 3);
        let rank =
            |of: fn(&Pair) -> f64, p: &Pair| list.iter().filter(|q| of(q) < of(p)).count() as f64;
        let squares: f64 = list
            .iter()
            .map(|p| (rank(|p| p.estimate, p) - rank(|p| p.truth, p)).powi(2))
            .sum();
        let wanted = 1.0 - 6.0 * squares / (40.0 * (1600.0 - 1.0));
        assert!((spearman(&list) - wanted).abs() < 1e-14);
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 0.0]), [2.5, 1.0, 2.5, 0.0]);
    }

    #[test]
    fn constant_or_missing_estimates_are_no_information() {
        let mut list = pairs(9, 5);
        list.iter_mut().for_each(|p| p.estimate = 0.7);
        let found = AffineInvariantError::from_pairs(&list).unwrap();
        assert_eq!(found.one_minus_spearman, 1.0);
        assert!(found.aiwe_1 > 0.0 && found.aiwe_1 <= found.aiwe_2);
        list.iter_mut().for_each(|p| p.estimate = f64::NAN);
        assert_eq!(AffineInvariantError::from_pairs(&list), None);
    }
}
