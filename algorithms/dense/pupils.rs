//! How the pupil is parted at each pixel: groups of pixels whose kernels are alike.
//!
//! Candidates stand for depths: one has the same blur everywhere, and at each pixel the disparity that the pixel's κ
//! makes of it. They are named by the disparity of a pixel whose κ is the mean.

use std::collections::BTreeMap;

use super::kernels::{Kernels, steepness};
use super::ratio::BlurRatio;

/// Step of ln κ within which pixels share their kernels: it moves the disparity by about half of that, in parts of it.
const STEP: f64 = 0.02;

/// Groups of pixels by their pupils.
#[derive(Clone, Debug)]
pub(super) struct Pupils {
    /// Steepness of the shares of each group, that of the least κ first.
    steepness: Vec<f64>,
    /// Number of each pixel's group, row by row; empty: all are of the only one.
    of_pixel: Vec<u16>,
    size: (usize, usize),
    mean: f64,
}

impl Pupils {
    /// Of views of `size` and their κ; `mean`: κ of the pixels whose disparity names the candidates.
    pub fn new(ratio: &BlurRatio, mean: f64, size: (usize, usize)) -> Self {
        let field = match ratio {
            BlurRatio::Field(field) => field,
            BlurRatio::Whole(ratio) => {
                return Self {
                    steepness: vec![steepness(*ratio)],
                    of_pixel: Vec::new(),
                    size,
                    mean,
                };
            }
        };
        let key = |ratio: &f32| (f64::from(*ratio).ln() / STEP).round() as i32;
        let keys: Vec<i32> = field.data().iter().map(key).collect();
        let mut numbers: BTreeMap<i32, u16> = keys.iter().map(|key| (*key, 0)).collect();
        (numbers.values_mut().zip(0..)).for_each(|(own, number)| *own = number);
        let of_key = |key: &i32| steepness((f64::from(*key) * STEP).exp());
        Self {
            steepness: numbers.keys().map(of_key).collect(),
            of_pixel: keys.iter().map(|key| numbers[key]).collect(),
            size,
            mean,
        }
    }

    /// The kernels of a candidate for each group.
    pub fn kernels(&self, candidate_px: f64) -> Vec<Kernels> {
        let blur_px = candidate_px.signum() * self.blur_px(candidate_px);
        let steepness = self.steepness.iter();
        steepness.map(|p| Kernels::new(blur_px, *p)).collect()
    }

    /// Diameter of a candidate's blur, px.
    pub fn blur_px(&self, candidate_px: f64) -> f64 {
        candidate_px.abs() / self.mean
    }

    /// Runs of pixels of one group in row `y` of level `k`, which has `width` columns: where each ends, and its number.
    /// Pixel i of the level lies at pixel 2ᵏ i.
    pub fn runs(&self, k: usize, width: usize, y: usize) -> Vec<(usize, usize)> {
        if self.of_pixel.is_empty() {
            return vec![(width, 0)];
        }
        let row = (y << k).min(self.size.1 - 1) * self.size.0;
        let number = |x: usize| usize::from(self.of_pixel[row + (x << k).min(self.size.0 - 1)]);
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for x in 0..width {
            match runs.last_mut() {
                Some((end, last)) if *last == number(x) => *end = x + 1,
                _ => runs.push((x + 1, number(x))),
            }
        }
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_of_one_ratio_share_their_kernels_and_a_candidate_has_one_blur() {
        let field = BlurRatio::of_field([6, 4], 0.2, |x, _| if x < 2 { 0.1 } else { 0.2 });
        let pupils = Pupils::new(&field, field.mean(), (6, 4));
        assert_eq!(pupils.runs(0, 6, 3), [(2, 0), (6, 1)]);
        assert_eq!(pupils.runs(1, 3, 1), [(1, 0), (3, 1)]);
        let kernels = pupils.kernels(1.5);
        assert_eq!(kernels.len(), 2);
        let radius = Kernels::radius(pupils.blur_px(1.5));
        let centroid = |k: &Kernels| {
            let side = 2 * k.radius + 1;
            let column = |i: usize| (i % side) as f64 - k.radius as f64;
            let moments = k.odd.iter().enumerate();
            moments.map(|(i, v)| column(i) * f64::from(*v)).sum::<f64>()
        };
        let [least, most] = [0, 1].map(|i| &kernels[i]);
        assert!(least.radius == radius && most.radius == radius);
        assert!((centroid(most) / centroid(least) / 2.0 - 1.0).abs() < 0.03);
    }
}
