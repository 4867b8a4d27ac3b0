//! What charge does in the silicon before it is collected.

use quadpixel_datasets::Subpixels;
use serde::{Deserialize, Serialize};

use super::wandering::{CollectedAt, Wandering};
use crate::range::{OutOfRange, require};

/// Charge that wanders by a Gaussian of deviation σ before it is collected (E. G. Stevens, IEEE Trans. Electron Devices
/// 39, 2621 (1992)) is collected as if the photodiodes stood elsewhere under the light: as the mean over lens shifts s
/// with that Gaussian. P of a gapless lens array is periodic in s, so its harmonic f is damped,
///
/// ```text
/// P_i(u, v; s) = Σ_f c_f exp(2π i f·s/pitch)  ─▶  c_f exp(−(2π |f| σ/pitch)²/2)
/// ```
/// or by the mean of that over the depths that the charge is made at, where these count ([`Wandering`]; of both axes
/// the product is taken). Part of what each sub-pixel then has is shared evenly by the others of its pixel: crosstalk
/// that no direction changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Charge {
    /// σ, µm, RMS over all charge at 550 nm.
    #[serde(default)]
    pub diffusion_um: f64,
    /// Where it is collected, which says how σ goes with the depth that it is made at.
    #[serde(default, skip_serializing_if = "is_anywhere")]
    pub collected_at: CollectedAt,
    /// Part that the others have, 0 to 1.
    #[serde(default)]
    pub crosstalk: f64,
}

fn is_anywhere(collected_at: &CollectedAt) -> bool {
    *collected_at == CollectedAt::Anywhere
}

impl Charge {
    /// Whether it stays where the light is.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Checks the bounds.
    ///
    /// # Errors
    /// A deviation that is negative or not finite, a part beyond 0 to 1.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let refused = |field: &'static str, value: f64, allowed: &'static str| {
            OutOfRange::new("response", field, value, allowed)
        };
        let Self {
            diffusion_um,
            crosstalk,
            ..
        } = *self;
        require(diffusion_um >= 0.0 && diffusion_um.is_finite(), || {
            refused("diffusion_um", diffusion_um, "finite and at least 0")
        })?;
        require((0.0..=1.0).contains(&crosstalk), || {
            refused("crosstalk", crosstalk, "0 to 1")
        })
    }

    /// What is left of a harmonic of the lens shift: f periods per pitch along one axis.
    pub(crate) fn kept(&self, wandering: &Wandering, harmonic: usize, pitch_um: f64) -> f64 {
        wandering.kept(std::f64::consts::TAU * harmonic as f64 * self.diffusion_um / pitch_um)
    }

    /// Shares the sub-pixels' parts of `[direction][sub-pixel]`.
    pub(crate) fn share(&self, subpixels: Subpixels, plane: &mut [f32]) {
        let count = subpixels.count();
        if self.crosstalk == 0.0 || count < 2 {
            return;
        }
        let part = self.crosstalk as f32;
        for all in plane.chunks_exact_mut(count) {
            let sum: f32 = all.iter().sum();
            for p in all {
                *p = (1.0 - part) * *p + part * (sum - *p) / (count - 1) as f32;
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn crosstalk_keeps_the_sum_and_a_half_makes_halves_alike() {
        let mut plane = vec![0.6, 0.2, 0.1, 0.5];
        let charge = Charge {
            crosstalk: 0.5,
            ..Charge::default()
        };
        charge.share(Subpixels::DUAL_X, &mut plane);
        for (p, wanted) in plane.iter().zip([0.4, 0.4, 0.3, 0.3]) {
            assert!((p - wanted).abs() < 1e-6);
        }
        let mut four = vec![0.4, 0.1, 0.2, 0.0];
        Charge {
            crosstalk: 0.3,
            ..Charge::default()
        }
        .share(Subpixels::new(2, 2).unwrap(), &mut four);
        assert!((four.iter().sum::<f32>() - 0.7).abs() < 1e-6 && (four[3] - 0.07).abs() < 1e-6);
    }

    #[test]
    fn numbers_that_cannot_be_are_named() {
        for (diffusion_um, crosstalk, field) in [
            (-0.1, 0.0, "diffusion_um"),
            (f64::NAN, 0.0, "diffusion_um"),
            (0.1, 1.5, "crosstalk"),
            (0.1, f64::NAN, "crosstalk"),
        ] {
            let charge = Charge {
                diffusion_um,
                crosstalk,
                ..Charge::default()
            };
            assert!(charge.check().unwrap_err().to_string().contains(field));
        }
    }
}
