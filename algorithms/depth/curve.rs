//! From a disparity to a depth, by the camera's own numbers.

/// A place beyond infinity, or nearer than the lens, by more standard deviations than this is no noise: what was
/// matched is wrong, or the curve is another camera's.
const POSSIBLE_SIGMAS: f64 = 3.0;

/// Depth and its standard deviation, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Depth {
    /// Z; +inf at infinity and where the noise leads beyond it, 0 where it leads nearer than the lens.
    pub z_m: f64,
    /// Standard deviation of Z.
    pub sigma_m: f64,
    /// Whether a point could be there: not by more than three standard deviations beyond infinity or nearer than the
    /// lens.
    pub is_possible: bool,
}

impl Depth {
    /// Of n = 1/(Z + p) and its standard deviation, 1/m, with p the pupil's place behind the first vertex, m:
    /// Z = 1/n − p, σ_Z = σ_n/n².
    pub fn of_nearness(per_m: f64, sigma_per_m: f64, pupil_behind_vertex_m: f64) -> Self {
        let margin = POSSIBLE_SIGMAS * sigma_per_m;
        if per_m <= 0.0 {
            return Self {
                z_m: f64::INFINITY,
                sigma_m: f64::INFINITY,
                is_possible: per_m >= -margin,
            };
        }
        let d = 1.0 / per_m;
        Self {
            z_m: (d - pupil_behind_vertex_m).max(0.0),
            sigma_m: d * d * sigma_per_m,
            is_possible: (per_m - margin) * pupil_behind_vertex_m < 1.0,
        }
    }
}

/// A camera's own relation of disparity and depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthCurve {
    /// 1/d_f, 1/m; 0: focused at infinity.
    pub inverse_focus_per_m: f64,
    /// κ · fx · A, px·m; above 0.
    pub gain_px_m: f64,
    /// p, m.
    pub pupil_behind_vertex_m: f64,
}

impl DepthCurve {
    /// Depth of a disparity with its standard deviation, px.
    pub fn depth(&self, disparity_px: f64, sigma_px: f64) -> Depth {
        let inverse = self.inverse_focus_per_m + disparity_px / self.gain_px_m;
        Depth::of_nearness(
            inverse,
            sigma_px / self.gain_px_m,
            self.pupil_behind_vertex_m,
        )
    }

    /// Disparity of a depth, px.
    pub fn disparity_px(&self, z_m: f64) -> f64 {
        self.gain_px_m * (1.0 / (z_m + self.pupil_behind_vertex_m) - self.inverse_focus_per_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURVE: DepthCurve = DepthCurve {
        inverse_focus_per_m: 1.0 / 0.75,
        gain_px_m: 0.25 * 2660.0 * 0.0017,
        pupil_behind_vertex_m: 0.001,
    };

    #[test]
    fn depth_and_disparity_are_inverse_and_near_is_positive() {
        for z in [0.2, 0.5, 0.749, 1.5, 10.0] {
            let disparity = CURVE.disparity_px(z);
            assert_eq!(disparity > 0.0, z < 0.749);
            assert!((CURVE.depth(disparity, 0.01).z_m / z - 1.0).abs() < 1e-12);
        }
        assert_eq!(CURVE.depth(-1e3, 0.01).z_m, f64::INFINITY);
    }

    #[test]
    fn what_no_noise_explains_is_not_possible() {
        let at = |inverse: f64| CURVE.depth((inverse - 1.0 / 0.75) * CURVE.gain_px_m, 0.01);
        let sigma = 0.01 / CURVE.gain_px_m;
        let lens = 1.0 / CURVE.pupil_behind_vertex_m;
        for (inverse, z_m, is_possible) in [
            (-2.9 * sigma, f64::INFINITY, true),
            (-3.1 * sigma, f64::INFINITY, false),
            (lens + 2.9 * sigma, 0.0, true),
            (lens + 3.1 * sigma, 0.0, false),
        ] {
            let depth = at(inverse);
            assert_eq!(
                (depth.z_m, depth.is_possible),
                (z_m, is_possible),
                "{inverse}"
            );
        }
        assert!(at(1.0).is_possible);
    }

    #[test]
    fn sigma_of_depth_is_the_slope_times_sigma_of_disparity() {
        let step = 1e-6;
        let at = |d: f64| CURVE.depth(d, 0.01);
        let slope = (at(0.3 + step).z_m - at(0.3 - step).z_m) / (2.0 * step);
        assert!((at(0.3).sigma_m / (0.01 * slope.abs()) - 1.0).abs() < 1e-6);
    }
}
