//! Depth by a camera's own description: its disparity against distance with the lens's aberrations, at each place of
//! the picture, and what a matcher finds in its place.
//!
//! A matched shift M is taken back to the distance of the centroids, D = g(M) ([`MatchingCurve`]); D = c₀ + c₁ t + c₂
//! t² gives t = 1/(Z + p) ([`DisparityCurve`]). g holds for natural textures in the middle of the window: finer
//! textures give more and coarser ones less, down to M = D, so half of M − D counts as a standard deviation beside the
//! matcher's.

use quadpixel_datasets::{CameraDescription, DisparityCurve, DisparityCurves, MatchingCurve};

use super::curve::Depth;
use super::curve_error::CurveError;
use super::halves::Measured;

/// Part of M − D by which a texture may differ from that of the matching curve, one standard deviation.
const TEXTURE: f64 = 0.5;

/// The curves of a camera's reference channel; see the module.
#[derive(Clone, Debug, PartialEq)]
pub struct DescribedCurve {
    size_px: [u32; 2],
    pupil_behind_vertex_m: f64,
    /// Of left and right, of top and bottom.
    directions: [Option<Direction>; 2],
}

#[derive(Clone, Debug, PartialEq)]
struct Direction {
    disparity: DisparityCurve,
    matching: Option<MatchingCurve>,
}

/// The direction of a shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// x_L − x_R.
    LeftRight,
    /// y_T − y_B.
    TopBottom,
}

/// t = 1/(Z + p) of a shift, 1/m, and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Nearness {
    per_m: f64,
    sigma_per_m: f64,
}

impl DescribedCurve {
    /// The curve for shifts that are those of centroids: nothing is to be taken back.
    pub fn of_centroids(mut self) -> Self {
        for direction in self.directions.iter_mut().flatten() {
            direction.matching = None;
        }
        self
    }

    /// By a camera's description; `channel` is the one that is matched.
    ///
    /// # Errors
    /// The description has no curve, or one whose nodes do not fit.
    pub fn new(camera: &CameraDescription, channel: &str) -> Result<Self, CurveError> {
        let curves = &camera.disparity;
        let matching = &camera.matching;
        let direction = |curves: &[DisparityCurve], matching: &Option<MatchingCurve>| {
            let Some(disparity) = DisparityCurves::of_channel(curves, channel) else {
                return Ok(None);
            };
            let sound =
                disparity.is_sound() && matching.as_ref().is_none_or(MatchingCurve::is_sound);
            sound
                .then(|| {
                    Some(Direction {
                        disparity: disparity.clone(),
                        matching: matching.clone(),
                    })
                })
                .ok_or(CurveError::Nodes)
        };
        let directions = [
            direction(&curves.left_right, &matching.left_right)?,
            direction(&curves.top_bottom, &matching.top_bottom)?,
        ];
        if directions.iter().all(Option::is_none) {
            return Err(CurveError::NoRatio);
        }
        Ok(Self {
            size_px: [camera.width_px, camera.height_px],
            pupil_behind_vertex_m: camera.intrinsics.pinhole_behind_vertex_m,
            directions,
        })
    }

    /// Depth of what both directions say at column x and row y, weighted by their certainty; `None` where neither says
    /// anything.
    pub fn depth(
        &self,
        at: [usize; 2],
        left_right: Option<Measured>,
        top_bottom: Option<Measured>,
    ) -> Option<Depth> {
        let said = [
            (Along::LeftRight, left_right),
            (Along::TopBottom, top_bottom),
        ];
        let (mut weights, mut sum) = (0.0, 0.0);
        for (along, measured) in said {
            let Some(n) = measured.and_then(|m| self.nearness(along, at, m)) else {
                continue;
            };
            let weight = 1.0 / (n.sigma_per_m * n.sigma_per_m);
            weights += weight;
            sum += weight * n.per_m;
        }
        if weights <= 0.0 {
            return None;
        }
        let (per_m, sigma) = (sum / weights, (1.0 / weights).sqrt());
        Some(Depth::of_nearness(per_m, sigma, self.pupil_behind_vertex_m))
    }

    fn nearness(&self, along: Along, [x, y]: [usize; 2], measured: Measured) -> Option<Nearness> {
        let direction = self.directions[along as usize].as_ref()?;
        let [c0, c1, c2] = direction.disparity.at([x as f64, y as f64], self.size_px)?;
        let matched = measured.disparity_px;
        let centroid = match &direction.matching {
            Some(curve) => curve.centroid_of(matched),
            None => matched,
        };
        // The root next to the straight line's.
        let discriminant = c1 * c1 - 4.0 * c2 * (c0 - centroid);
        if c1 == 0.0 || discriminant < 0.0 {
            return None;
        }
        let per_m = 2.0 * (centroid - c0) / (c1 + c1.signum() * discriminant.sqrt());
        let slope = (c1 + 2.0 * c2 * per_m).abs();
        // The matcher's own error grows as its answers are compressed.
        let scale = if matched == 0.0 {
            1.0
        } else {
            (centroid / matched).abs().min(1.0)
        };
        let texture = TEXTURE * (matched - centroid);
        let fit = direction.disparity.fit_error_px;
        let sigma_px = ((scale * measured.sigma_px).powi(2) + texture * texture + fit * fit).sqrt();
        (slope > 0.0 && per_m.is_finite()).then(|| Nearness {
            per_m,
            sigma_per_m: sigma_px / slope,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn direction(c: [f64; 3], matching: Option<MatchingCurve>) -> DescribedCurve {
        let nodes = [Some(c); 4];
        DescribedCurve {
            size_px: [10, 10],
            pupil_behind_vertex_m: 0.002,
            directions: [
                Some(Direction {
                    disparity: DisparityCurve::new("G", [2, 2], &nodes, 0.0).unwrap(),
                    matching,
                }),
                None,
            ],
        }
    }

    #[test]
    fn depth_undoes_the_parabola_and_the_matchers_curve() {
        let c = [0.3, -2.0, 0.05];
        let matching = MatchingCurve::new(2.0, 21.0, &[[-2.0, -2.6], [0.0, 0.0], [2.0, 2.6]]);
        for (matching, stretch) in [(None, 1.0), (matching, 1.3)] {
            let curve = direction(c, matching);
            for z in [0.3, 0.75, 2.0, 9.0] {
                let t = 1.0 / (z + 0.002);
                let d = c[0] + c[1] * t + c[2] * t * t;
                if d.abs() > 2.0 {
                    continue;
                }
                let measured = Measured {
                    disparity_px: stretch * d,
                    sigma_px: 0.01,
                };
                let depth = curve.depth([3, 4], Some(measured), None).unwrap();
                assert!((depth.z_m / z - 1.0).abs() < 1e-9, "{z}: {}", depth.z_m);
                // What the texture may do is in the standard deviation.
                let least =
                    0.5 * (stretch - 1.0) * d.abs() / (c[1] + 2.0 * c[2] * t).abs() / (t * t);
                assert!(depth.sigma_m >= least);
            }
        }
    }

    #[test]
    fn a_shift_that_no_distance_has_tells_none() {
        let curve = direction([0.0, 1.0, 0.5], None);
        let measured = |disparity_px| {
            Some(Measured {
                disparity_px,
                sigma_px: 0.01,
            })
        };
        assert!(curve.depth([0, 0], measured(-0.6), None).is_none());
        // Behind infinity.
        assert_eq!(
            curve.depth([0, 0], measured(-0.2), None).unwrap().z_m,
            f64::INFINITY
        );
        assert!(curve.depth([0, 0], None, None).is_none());
    }
}
