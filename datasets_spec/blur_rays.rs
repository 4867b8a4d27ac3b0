//! The rays of a pixel as lines in inverse distance: the blurs of opposite halves at every depth.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the rays of the pixel in the middle of the window look beside it, and what each is worth to the halves of
/// the pixel, in green. With t = 1/(Z + `intrinsics.pinhole_behind_vertex_m`), per metre, and t_f that of
/// `focus.distance_m` (0 for infinity), ray k of the pixel p sees what the sum of all sub-pixels shows at
///
/// ```text
/// p + o_km,    o_km = a_k + b_k (t − t_f) ± d_km    px,
/// ```
///
/// so that a point's picture in the left half is Σ left_k δ(x + o_km) over k, the M displacements d_km of each and both
/// signs, divided by 2 M: lens, aberrations, diffraction at the lens's aperture (d, to either side alike) and response
/// are in it. The weights of all sub-pixels' rays add up to 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BlurRays {
    /// a (px) and b (px·m) along x, to the right.
    pub x_px: Vec<[f64; 2]>,
    /// a (px) and b (px·m) along y, downwards.
    pub y_px: Vec<[f64; 2]>,
    /// d along x and y, as many of each ray; empty: none.
    pub displaced_px: Vec<Vec<[f64; 2]>>,
    /// Weights to the left half; empty for a pixel of one column, as `right`.
    pub left: Vec<f64>,
    /// To the right half.
    pub right: Vec<f64>,
    /// To the upper half; empty for a pixel of one row, as `bottom`.
    pub top: Vec<f64>,
    /// To the lower half.
    pub bottom: Vec<f64>,
}

/// Most rays that are read.
const MOST_RAYS: usize = 1 << 16;
/// Most displacements of one.
const MOST_DRAWS: usize = 64;

impl BlurRays {
    /// The same with as many digits as it says anything.
    pub fn rounded(mut self) -> Self {
        let places = self.x_px.iter_mut().chain(&mut self.y_px).flatten();
        let weights = [
            &mut self.left,
            &mut self.right,
            &mut self.top,
            &mut self.bottom,
        ];
        let displaced = self.displaced_px.iter_mut().flatten().flatten();
        let numbers = places.chain(displaced).chain(weights.into_iter().flatten());
        numbers.for_each(|v| *v = format!("{v:.3e}").parse().unwrap_or(*v));
        self
    }

    /// Whether the lists are as long, finite, and each pair of halves has light or is not there.
    pub fn is_sound(&self) -> bool {
        let n = self.x_px.len();
        let places = self.x_px.iter().chain(&self.y_px).flatten();
        let draws = &self.displaced_px;
        let of_each = draws.first().map_or(0, Vec::len);
        let displaced = draws.iter().flatten().flatten();
        let halves = [[&self.left, &self.right], [&self.top, &self.bottom]];
        let is_half = |half: &[f64]| {
            half.len() == n
                && half.iter().all(|w| w.is_finite() && *w >= 0.0)
                && half.iter().sum::<f64>() > 0.0
        };
        (1..=MOST_RAYS).contains(&n)
            && self.y_px.len() == n
            && places.chain(displaced).all(|v| v.is_finite())
            && (draws.is_empty() || draws.len() == n)
            && draws
                .iter()
                .all(|d| d.len() == of_each && (1..=MOST_DRAWS).contains(&of_each))
            && halves.iter().all(|pair| {
                pair.iter().all(|half| half.is_empty()) || pair.iter().all(|half| is_half(half))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_without_light_or_of_other_numbers_are_unsound() {
        let sound = BlurRays {
            x_px: vec![[0.123_456_789, -1.0], [0.5, 2.0]],
            y_px: vec![[0.0, 1.0]; 2],
            left: vec![0.1, 0.4],
            right: vec![0.4, 0.1],
            ..BlurRays::default()
        };
        assert!(sound.is_sound());
        assert_eq!(sound.clone().rounded().x_px[0], [0.1235, -1.0]);
        let faults: [fn(&mut BlurRays); 7] = [
            |r| r.left.clear(),
            |r| r.right[0] = f64::NAN,
            |r| r.left = vec![0.0; 2],
            |r| r.top = vec![0.5; 2],
            |r| r.y_px.truncate(1),
            |r| r.displaced_px = vec![vec![[0.0; 2]], vec![]],
            |r| r.x_px[1][1] = f64::INFINITY,
        ];
        for fault in faults {
            let mut rays = sound.clone();
            fault(&mut rays);
            assert!(!rays.is_sound());
        }
        assert!(!BlurRays::default().is_sound());
    }
}
