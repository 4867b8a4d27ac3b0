//! Where a pixel's costs are least, between the candidates, and how sharply they rise from there.

use super::cost::Volume;

/// The least cost of each pixel.
pub(super) struct Minima {
    /// Its place, px of full resolution.
    pub disparity_px: Vec<f64>,
    /// Second difference of the costs there, per step²; a hundredth where the least lies at the end of the range.
    pub curvature: Vec<f64>,
}

/// What counts as no curvature.
const FLAT: f64 = 1e-9;

/// A parabola through the least cost and its neighbours.
pub(super) fn minima(volume: &Volume) -> Minima {
    let n = volume.candidates.count;
    let (disparity_px, curvature) = (volume.costs.chunks_exact(n))
        .map(|costs| {
            let least = (0..n)
                .min_by(|a, b| costs[*a].total_cmp(&costs[*b]))
                .unwrap_or(0);
            let at = least.clamp(1, n - 2);
            let [before, here, behind] = [at - 1, at, at + 1].map(|i| f64::from(costs[i]));
            let bend = (before + behind - 2.0 * here).max(FLAT);
            let off = (0.5 * (before - behind) / bend).clamp(-1.0, 1.0);
            let trust = if at == least { 1.0 } else { 0.01 };
            (
                volume.candidates.disparity_px(at as f64 + off),
                trust * bend,
            )
        })
        .unzip();
    Minima {
        disparity_px,
        curvature,
    }
}

/// The median; 0 where there is none.
pub(super) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    let middle = values.len() / 2;
    match middle < values.len() {
        true => *values.select_nth_unstable_by(middle, f64::total_cmp).1,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dense::cost::Candidates;

    #[test]
    fn finds_the_summit_of_a_parabola_between_candidates() {
        let candidates = Candidates {
            first_px: -2.0,
            step_px: 0.5,
            count: 9,
        };
        let costs = (0..9)
            .map(|i| (candidates.disparity_px(f64::from(i)) - 0.3).powi(2) as f32)
            .collect();
        let found = minima(&Volume {
            width: 1,
            height: 1,
            candidates,
            costs,
        });
        assert!((found.disparity_px[0] - 0.3).abs() < 1e-6);
        assert!((found.curvature[0] - 2.0 * 0.25).abs() < 1e-6);
    }
}
