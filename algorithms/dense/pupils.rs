//! How the pupil is parted at each pixel: groups of pixels whose kernels are alike.
//!
//! Candidates stand for depths: one has the same blur everywhere, and at each pixel the disparity that the pixel's κ
//! makes of it. They are named by the disparity of a pixel whose κ is the mean.

use std::collections::BTreeMap;

use super::kernels::{Kernels, steepness};
use super::ratio::BlurRatio;
use super::ray_pupil::RayPupil;

/// Step of ln κ within which pixels share their kernels: it moves the disparity by about half of that, in parts of it.
const STEP: f64 = 0.02;

/// ε of [`super::cost`] for the family's disk, and for the camera's own rays.
const MODEL_ERROR: [f64; 2] = [0.05, 0.03];

/// Groups of pixels by their pupils.
#[derive(Clone, Debug)]
pub(super) struct Pupils {
    /// κ of each group, the least first.
    ratios: Vec<f64>,
    shape: Shape,
    /// Number of each pixel's group, row by row; empty: all are of the only one.
    of_pixel: Vec<u16>,
    size: (usize, usize),
    mean: f64,
}

/// What the pupil's image is.
#[derive(Clone, Debug)]
enum Shape {
    /// The family's disk, with the steepness of each group's shares.
    Disk(Vec<f64>),
    /// The rays of the pixel in the middle of the views, and its κ.
    Rays { pupil: RayPupil, ratio: f64 },
}

impl Pupils {
    /// Of views of `size` and their κ; `mean`: κ of the pixels whose disparity names the candidates. `rays`: of the
    /// camera's own pixel, where they are known.
    pub fn new(ratio: &BlurRatio, mean: f64, size: (usize, usize), rays: Option<RayPupil>) -> Self {
        let key = |ratio: &f32| (f64::from(*ratio).ln() / STEP).round() as i32;
        let (ratios, of_pixel) = match ratio {
            BlurRatio::Whole(ratio) => (vec![*ratio], Vec::new()),
            BlurRatio::Field(field) => {
                let keys: Vec<i32> = field.data().iter().map(key).collect();
                let mut numbers: BTreeMap<i32, u16> = keys.iter().map(|key| (*key, 0)).collect();
                (numbers.values_mut().zip(0..)).for_each(|(own, number)| *own = number);
                let of_key = |key: &i32| (f64::from(*key) * STEP).exp();
                let ratios = numbers.keys().map(of_key).collect();
                (ratios, keys.iter().map(|key| numbers[key]).collect())
            }
        };
        let shape = match rays {
            Some(pupil) => Shape::Rays {
                pupil,
                ratio: ratio.at(size.1 / 2 * size.0 + size.0 / 2),
            },
            None => Shape::Disk(ratios.iter().map(|ratio| steepness(*ratio)).collect()),
        };
        Self {
            ratios,
            shape,
            of_pixel,
            size,
            mean,
        }
    }

    /// The kernels of a candidate for each group, at level `k`.
    pub fn kernels(&self, candidate_px: f64, k: usize) -> Vec<Kernels> {
        let unit = f64::from(1u32 << k);
        match &self.shape {
            Shape::Disk(steepness) => {
                let blur_px = candidate_px / self.mean / unit;
                let steepness = steepness.iter();
                steepness.map(|p| Kernels::new(blur_px, *p)).collect()
            }
            Shape::Rays { pupil, ratio } => {
                let kernels = pupil.kernels(candidate_px * ratio / self.mean, unit);
                let ratios = self.ratios.iter();
                ratios.map(|own| kernels.parted(own / ratio)).collect()
            }
        }
    }

    /// Part of the energy that differs in spite of the right candidate.
    pub fn model_error(&self) -> f64 {
        MODEL_ERROR[usize::from(self.rays().is_some())]
    }

    /// The rays of the camera's own pixel, if the blurs are theirs.
    pub fn rays(&self) -> Option<&RayPupil> {
        match &self.shape {
            Shape::Disk(_) => None,
            Shape::Rays { pupil, .. } => Some(pupil),
        }
    }

    /// R of a candidate's kernels at level `k`.
    pub fn radius(&self, candidate_px: f64, k: usize) -> usize {
        let unit = f64::from(1u32 << k);
        match &self.shape {
            Shape::Disk(_) => Kernels::radius(candidate_px.abs() / self.mean / unit),
            Shape::Rays { pupil, ratio } => pupil.radius(candidate_px * ratio / self.mean, unit),
        }
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
        let pupils = Pupils::new(&field, field.mean(), (6, 4), None);
        assert_eq!(pupils.runs(0, 6, 3), [(2, 0), (6, 1)]);
        assert_eq!(pupils.runs(1, 3, 1), [(1, 0), (3, 1)]);
        let kernels = pupils.kernels(1.5, 0);
        assert_eq!(kernels.len(), 2);
        let radius = pupils.radius(1.5, 0);
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
