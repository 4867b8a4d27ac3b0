//! The blurs of a pair of opposite views by the rays of a camera's own pixel: lens, aberrations, diffraction and
//! response as they are, where [`Kernels::new`] has a sharp disk.
//!
//! Ray k sees what lies a_k + b_k t ± d_km beside the pixel, t = 1/(Z + p) less its value in focus ([`BlurRays`]), so
//! it shows a point on the other side. Candidates are named by disparities. That of the centroids without d is linear
//! in t, which gives the t of a candidate.

use quadpixel_datasets::BlurRays;

use super::kernels::{Kernels, LEAST_RATIO, LOBES, Taps};

/// Part of the light that a kernel holds: diffraction sends single rays far away.
const HELD: f64 = 0.95;
/// Parts of a px to which the reach of light is known, and all of them: farther than any kernel.
const PARTS_PER_PX: f64 = 16.0;
const MOST_PARTS: usize = 2048;
/// Widest kernel in focus, px: beyond is no camera's.
const MOST_IN_FOCUS_PX: usize = 32;

/// A pair's rays, one of each displacement to either side.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RayPupil {
    rays: Vec<Ray>,
    /// Disparity at t of the pair that names the candidates, px: the constant and the slope.
    naming: [f64; 2],
    /// By how much the views were moved towards each other, px.
    aligned_px: f64,
}

/// a and b along the pair's direction and across it, d in both, and the ray's part in the light of each view.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ray {
    along: [f64; 2],
    across: [f64; 2],
    displaced: [f64; 2],
    parts: [f64; 2],
}

impl RayPupil {
    /// Of left and right, or of top and bottom (`is_turned`, with columns as rows). `None` where they have no rays, or
    /// their disparity does not depend on the distance.
    pub fn new(blur: &BlurRays, is_turned: bool) -> Option<Self> {
        let (along, across, pair) = match is_turned {
            false => (&blur.x_px, &blur.y_px, [&blur.left, &blur.right]),
            true => (&blur.y_px, &blur.x_px, [&blur.top, &blur.bottom]),
        };
        if !blur.is_sound() || pair.iter().any(|half| half.is_empty()) {
            return None;
        }
        let light = pair.map(|half| half.iter().sum::<f64>());
        let none = [[0.0; 2]];
        let rays = (0..along.len()).flat_map(|k| {
            let draws = blur.displaced_px.get(k).map_or(&none[..], |draws| draws);
            let both = draws.iter().flat_map(|&[x, y]| [[x, y], [-x, -y]]);
            both.map(move |[x, y]| Ray {
                along: along[k],
                across: across[k],
                displaced: if is_turned { [y, x] } else { [x, y] },
                parts: [0, 1].map(|i| 0.5 * pair[i][k] / light[i] / draws.len() as f64),
            })
        });
        let rays: Vec<Ray> = rays.collect();
        let naming = [0, 1].map(|i| {
            let terms = rays.iter().map(|r| r.along[i] * (r.parts[1] - r.parts[0]));
            terms.sum::<f64>()
        });
        let pupil = Self {
            rays,
            naming,
            aligned_px: 0.0,
        };
        pupil.is_a_cameras().then_some(pupil)
    }

    /// Top and bottom beside `first`, whose disparities name the candidates. `is_aligned`: the views were moved so that
    /// they have no disparity where those of `first` have none.
    pub fn beside(self, first: &Self, is_aligned: bool) -> Option<Self> {
        let [constant, slope] = self.naming;
        let in_focus = constant + slope * first.nearness(0.0);
        let pupil = Self {
            naming: first.naming,
            aligned_px: if is_aligned { in_focus } else { 0.0 },
            ..self
        };
        pupil.is_a_cameras().then_some(pupil)
    }

    /// Whether disparities have a distance, and kernels are no wider than a pupil's.
    fn is_a_cameras(&self) -> bool {
        let of_one_px = (0.5 / LEAST_RATIO) as usize;
        let is_narrow = |candidate_px, most| self.radius(candidate_px, 1.0) <= most;
        self.naming[1] != 0.0
            && is_narrow(0.0, MOST_IN_FOCUS_PX)
            && [-1.0, 1.0]
                .iter()
                .all(|one| is_narrow(*one, MOST_IN_FOCUS_PX + of_one_px))
    }

    /// R of a candidate's kernels at a resolution of 1/`unit`.
    pub fn radius(&self, candidate_px: f64, unit: f64) -> usize {
        let t = self.nearness(candidate_px);
        let mut light = vec![0.0; MOST_PARTS];
        for ray in &self.rays {
            let reach = ray.at(t).map(f64::abs).into_iter().fold(0.0, f64::max);
            let part = ((reach * PARTS_PER_PX) as usize).min(MOST_PARTS - 1);
            light[part] += 0.5 * (ray.parts[0] + ray.parts[1]);
        }
        let mut held = 0.0;
        let last = light.iter().position(|light| {
            held += light;
            held >= HELD
        });
        let reach = (last.unwrap_or(MOST_PARTS - 1) + 1) as f64 / PARTS_PER_PX;
        ((reach + 0.5 * self.aligned_px.abs()) / unit + LOBES).floor() as usize
    }

    /// The kernels of a candidate at a resolution of 1/`unit`.
    pub fn kernels(&self, candidate_px: f64, unit: f64) -> Kernels {
        let radius = self.radius(candidate_px, unit);
        let (side, t) = (2 * radius + 1, self.nearness(candidate_px));
        let mut views = [0, 1].map(|_| vec![0.0f64; side * side]);
        for ray in &self.rays {
            let [x, y] = ray.at(t);
            let down = Taps::new(-y / unit, radius);
            let mut across = None;
            for (i, kernel) in views.iter_mut().enumerate() {
                let moved = [-0.5, 0.5][i] * self.aligned_px;
                // Both views are as one where they were not moved.
                let own = || Taps::new((moved - x) / unit, radius);
                let across = match self.aligned_px == 0.0 {
                    true => *across.get_or_insert_with(own),
                    false => own(),
                };
                for (j, weight) in down.weights().iter().enumerate() {
                    let line = (down.first + j) * side + across.first;
                    let line = &mut kernel[line..][..across.weights().len()];
                    let weight = ray.parts[i] * weight;
                    let both = line.iter_mut().zip(across.weights());
                    both.for_each(|(to, w)| *to += weight * w);
                }
            }
        }
        for kernel in &mut views {
            let sum: f64 = kernel.iter().sum();
            kernel.iter_mut().for_each(|v| *v /= sum);
        }
        Kernels::of_views(radius, views)
    }

    /// t of a candidate.
    fn nearness(&self, candidate_px: f64) -> f64 {
        (candidate_px - self.naming[0]) / self.naming[1]
    }
}

impl Ray {
    /// Where it looks, along and across, px.
    fn at(&self, t: f64) -> [f64; 2] {
        let [along, across] = [self.along, self.across].map(|[a, b]| a + b * t);
        [along + self.displaced[0], across + self.displaced[1]]
    }
}
