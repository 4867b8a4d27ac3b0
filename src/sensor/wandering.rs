//! How far charge wanders by how deep in the silicon it is made.
//!
//! Light of the absorption length L is absorbed at the depth z with the density e^(−z/L), down to the depth d that is
//! counted. Charge wanders about as far to the side as it has to go: σ(z) = σ z/z₀ to photodiodes at the side that is
//! lit, σ (d − z)/z₀ to those at the far side of a back-illuminated pixel, where z₀ is the RMS of that way at the
//! reference wavelength. So one σ, that at the reference wavelength, gives all colours theirs: red, which goes deep,
//! mixes the halves of a pixel that is lit from the photodiodes' side more than blue does. That the way to the side is
//! in proportion to the depth is an assumption, which stands in for solving the charge's diffusion.

use serde::{Deserialize, Serialize};

/// Where charge is collected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CollectedAt {
    /// It wanders equally far, wherever it is made.
    #[default]
    Anywhere,
    /// At the side that light comes from: front-illuminated pixels.
    LitSide,
    /// At the other side: back-illuminated pixels.
    FarSide,
}

/// The silicon that light is absorbed in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Silicon {
    /// Depth that is counted, µm.
    pub depth_um: f64,
    /// Absorption length, µm; infinite where it absorbs nothing.
    pub absorption_um: f64,
    /// The same at the reference wavelength.
    pub reference_absorption_um: f64,
}

/// σ of charge, in that at the reference wavelength, and the part of the charge that has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wandering(Vec<(f64, f64)>);

/// Depths of the quadrature.
const DEPTHS: usize = 64;

impl Wandering {
    /// Of all charge equally far.
    pub fn even() -> Self {
        Self(vec![(1.0, 1.0)])
    }

    /// Of charge that is made in this silicon.
    pub fn new(collected_at: CollectedAt, silicon: &Silicon) -> Self {
        let depth = silicon.depth_um;
        let is_silicon = depth > 0.0 && depth.is_finite();
        let lengths = [silicon.absorption_um, silicon.reference_absorption_um];
        let absorbs = lengths.iter().all(|l| *l > 0.0 && l.is_finite());
        if collected_at == CollectedAt::Anywhere || !is_silicon || !absorbs {
            return Self::even();
        }
        let ways = |length_um: f64| {
            // Cells of equal light: the middle of each by its share.
            let absorbed = 1.0 - (-depth / length_um).exp();
            (0..DEPTHS).map(move |k| {
                let share = (k as f64 + 0.5) / DEPTHS as f64;
                let z = match absorbed < 1e-9 {
                    true => depth * share,
                    false => -length_um * (1.0 - absorbed * share).ln(),
                };
                match collected_at {
                    CollectedAt::FarSide => depth - z,
                    _ => z,
                }
            })
        };
        let squares: f64 = ways(lengths[1]).map(|z| z * z).sum();
        let reference = (squares / DEPTHS as f64).sqrt();
        let part = 1.0 / DEPTHS as f64;
        Self(ways(lengths[0]).map(|z| (z / reference, part)).collect())
    }

    /// What is left of a harmonic whose period is 2π/`turns` of σ: the mean of exp(−(turns σ(z)/σ)²/2).
    pub fn kept(&self, turns: f64) -> f64 {
        let terms = self.0.iter();
        terms
            .map(|(sigma, part)| part * (-0.5 * (turns * sigma).powi(2)).exp())
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GREEN: Silicon = Silicon {
        depth_um: 3.0,
        absorption_um: 1.5,
        reference_absorption_um: 1.5,
    };

    /// RMS over σ, by the harmonic's fall at the origin.
    fn rms(wandering: &Wandering) -> f64 {
        let turns = 1e-3;
        (2.0 * (1.0 - wandering.kept(turns))).sqrt() / turns
    }

    #[test]
    fn one_sigma_at_the_reference_gives_red_more_and_blue_less_where_the_lit_side_collects() {
        let of = |collected_at, absorption_um| {
            let silicon = Silicon {
                absorption_um,
                ..GREEN
            };
            rms(&Wandering::new(collected_at, &silicon))
        };
        assert!((of(CollectedAt::LitSide, 1.5) - 1.0).abs() < 1e-3);
        assert!((of(CollectedAt::FarSide, 1.5) - 1.0).abs() < 1e-3);
        // ∫ z² e^(−z/L) dz over [0, d], by parts: L² (2 − e^(−x) (x² + 2x + 2)), x = d/L; over 1 − e^(−x).
        let closed = |l: f64| {
            let x = 3.0 / l;
            let e = (-x).exp();
            (l * l * (2.0 - e * (x * x + 2.0 * x + 2.0)) / (1.0 - e)).sqrt()
        };
        for l in [0.4, 2.5] {
            let found = of(CollectedAt::LitSide, l);
            assert!(
                (found - closed(l) / closed(1.5)).abs() < 0.01,
                "{l}: {found}"
            );
        }
        assert!(of(CollectedAt::FarSide, 0.4) > 1.0 && of(CollectedAt::FarSide, 2.5) < 1.0);
        assert_eq!(of(CollectedAt::Anywhere, 0.4), rms(&Wandering::even()));
        // What absorbs hardly at all does so evenly: the RMS depth is d/√3.
        let weak = of(CollectedAt::LitSide, 1e12);
        assert!(
            (weak - 3.0 / 3f64.sqrt() / closed(1.5)).abs() < 0.01,
            "{weak}"
        );
        assert!((of(CollectedAt::LitSide, f64::INFINITY) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn all_equally_far_is_a_gaussian() {
        assert!((Wandering::even().kept(1.3) - (-0.845f64).exp()).abs() < 1e-15);
    }
}
