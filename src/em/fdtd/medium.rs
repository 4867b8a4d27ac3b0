//! Matter on the grid: ε(ω) = ε∞ + iσ/ω + Σ s / (ω0² − ω² − iγω), time convention e^(−iωt), with c = ε0 = μ0 = 1, so
//! that ω and σ are in 1/µm. A Drude term has ω0 = 0.
//!
//! The stepper integrates σ and the poles by the trapezoid rule: what it solves at ω is ε(ω) with σ and the poles
//! taken at Ω = (2/dt) tan(ω dt/2). The rule keeps passivity, so a passive medium cannot grow, whatever the sign of Re
//! ε.

use rustfft::num_complex::Complex64;

use super::SolverError;
use super::YeeGrid;
use super::error::{refused, within};

/// A Lorentz term s / (ω0² − ω² − iγω).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// s in 1/µm². It may be negative if the whole medium is passive.
    pub strength: f64,
    /// Resonance ω0 in 1/µm; 0 for Drude.
    pub resonance: f64,
    /// Damping γ in 1/µm.
    pub damping: f64,
}

/// One medium.
#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    permittivity: f64,
    conductivity: f64,
    poles: Vec<Pole>,
}

impl Medium {
    /// Vacuum.
    pub const VACUUM: Self = Self {
        permittivity: 1.0,
        conductivity: 0.0,
        poles: Vec::new(),
    };

    /// A medium of ε∞ (0.01 to 1e4), conductivity in 1/µm (0 to 1e6) and poles.
    ///
    /// # Errors
    /// A value out of range, or a medium that amplifies at some frequency.
    pub fn new(
        permittivity: f64,
        conductivity: f64,
        poles: Vec<Pole>,
    ) -> Result<Self, SolverError> {
        within("permittivity", permittivity, 0.01, 1e4)?;
        within("conductivity", conductivity, 0.0, 1e6)?;
        for pole in &poles {
            within("pole strength", pole.strength, -1e6, 1e6)?;
            within("pole resonance", pole.resonance, 0.0, 1e3)?;
            within("pole damping", pole.damping, 0.0, 1e4)?;
        }
        let medium = Self {
            permittivity,
            conductivity,
            poles,
        };
        medium.check_passive()?;
        Ok(medium)
    }

    /// The medium that has the refractive index n + ik (k ≥ 0) at angular frequency `omega` in 1/µm: a conductivity
    /// where Re ε ≥ 1, else ε∞ = 1 and a Drude term.
    ///
    /// # Errors
    /// As of [`Self::new`], or `omega` outside 1e-3 to 1e3.
    pub fn from_index(index: Complex64, omega: f64) -> Result<Self, SolverError> {
        within("omega", omega, 1e-3, 1e3)?;
        Self::from_permittivity(index * index, omega)
    }

    /// As [`Self::from_index`], from ε (Im ε ≥ 0).
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn from_permittivity(epsilon: Complex64, omega: f64) -> Result<Self, SolverError> {
        if epsilon.re >= 1.0 {
            return Self::new(epsilon.re, omega * epsilon.im, Vec::new());
        }
        let deficit = 1.0 - epsilon.re;
        let damping = omega * epsilon.im / deficit;
        let pole = Pole {
            strength: deficit * (omega * omega + damping * damping),
            resonance: 0.0,
            damping,
        };
        Self::new(1.0, 0.0, vec![pole])
    }

    /// ε∞.
    pub fn permittivity(&self) -> f64 {
        self.permittivity
    }

    /// σ in 1/µm.
    pub fn conductivity(&self) -> f64 {
        self.conductivity
    }

    /// The poles.
    pub fn poles(&self) -> &[Pole] {
        &self.poles
    }

    /// ε(ω).
    pub fn epsilon(&self, omega: f64) -> Complex64 {
        self.permittivity + self.susceptibility(omega)
    }

    /// The ε that the stepper solves at ω with time step `dt_um` in a field stepped by the leapfrog rule: with the
    /// operator −i(2/dt) sin(ω dt/2) for ∂t, (curl H) = that operator × this ε × E.
    pub fn stepped_epsilon(&self, omega: f64, dt_um: f64) -> Complex64 {
        self.permittivity + self.susceptibility(2.0 / dt_um * (0.5 * omega * dt_um).tan())
    }

    fn susceptibility(&self, omega: f64) -> Complex64 {
        let poles: Complex64 = self
            .poles
            .iter()
            .map(|p| {
                let w2 = omega * omega;
                p.strength / Complex64::new(p.resonance * p.resonance - w2, -p.damping * omega)
            })
            .sum();
        poles + Complex64::new(0.0, self.conductivity / omega)
    }

    /// Im ε ≥ 0 on a fine logarithmic scale of frequencies and at each resonance.
    fn check_passive(&self) -> Result<(), SolverError> {
        if self.poles.iter().all(|p| p.strength >= 0.0) {
            return Ok(());
        }
        let scale = (-4000..=6000).map(|i| 10f64.powf(i as f64 * 1e-3));
        let resonances = self.poles.iter().map(|p| p.resonance).filter(|w| *w > 0.0);
        for omega in scale.chain(resonances) {
            // ω Im χ is the loss; round-off of cancelling poles is not gain.
            let size: f64 = self.poles.iter().map(|p| p.strength.abs()).sum();
            if (omega * self.susceptibility(omega).im) < -1e-9 * size / omega.max(1.0) {
                return Err(refused(
                    "medium",
                    format!("amplifying at omega {omega:.4} /µm"),
                    "Im ε ≥ 0 at every frequency",
                ));
            }
        }
        Ok(())
    }
}

/// Which medium each E node has: an index into `media`.
///
/// Component maps have (nx+1)(ny+1)(nz+1) entries, x fastest, at [`MaterialMap::index`]; node places are those of
/// [`YeeGrid`]. The far column and row (i = nx, j = ny) are nodes of mirrored sides and are not read under Bloch sides;
/// entries beyond the grid (Ex at i = nx, Ey at j = ny, Ez at k = nz) are never read.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialMap {
    media: Vec<Medium>,
    components: [Vec<u16>; 3],
    size: [usize; 3],
}

impl MaterialMap {
    /// From the media and the number of each node's, by component.
    ///
    /// # Errors
    /// Components of another size than the grid, or a number that is no medium's.
    pub fn new(
        grid: &YeeGrid,
        media: Vec<Medium>,
        ex: Vec<u16>,
        ey: Vec<u16>,
        ez: Vec<u16>,
    ) -> Result<Self, SolverError> {
        let size = [grid.nx() + 1, grid.ny() + 1, grid.nz() + 1];
        let nodes = size.iter().product::<usize>();
        within("media", media.len() as f64, 1.0, 65_536.0)?;
        for (field, map) in [("ex", &ex), ("ey", &ey), ("ez", &ez)] {
            if map.len() != nodes {
                return Err(refused(
                    field,
                    format!("{} entries", map.len()),
                    format!("{nodes}, (nx+1)(ny+1)(nz+1)"),
                ));
            }
            if let Some(index) = map.iter().find(|m| usize::from(**m) >= media.len()) {
                return Err(refused(
                    field,
                    index,
                    format!("an index of the {} media", media.len()),
                ));
            }
        }
        Ok(Self {
            media,
            components: [ex, ey, ez],
            size,
        })
    }

    /// The same medium everywhere in each layer k of the grid: Ex, Ey of plane k and Ez above it.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn layered(
        grid: &YeeGrid,
        media: Vec<Medium>,
        medium_of_layer: impl Fn(usize) -> u16,
    ) -> Result<Self, SolverError> {
        let plane = (grid.nx() + 1) * (grid.ny() + 1);
        let map: Vec<u16> = (0..=grid.nz())
            .flat_map(|k| std::iter::repeat_n(medium_of_layer(k), plane))
            .collect();
        Self::new(grid, media, map.clone(), map.clone(), map)
    }

    /// Place of node (i, j, k) in a component's map.
    pub fn index(&self, i: usize, j: usize, k: usize) -> usize {
        (k * self.size[1] + j) * self.size[0] + i
    }

    /// The media.
    pub fn media(&self) -> &[Medium] {
        &self.media
    }

    /// Indices of one component's nodes (0, 1, 2: Ex, Ey, Ez).
    pub fn component(&self, axis: usize) -> &[u16] {
        &self.components[axis]
    }

    /// Medium number of a node.
    pub fn at(&self, axis: usize, i: usize, j: usize, k: usize) -> usize {
        usize::from(self.components[axis][self.index(i, j, k)])
    }

    /// Whether the map was made for a grid of this size.
    pub(super) fn fits(&self, grid: &YeeGrid) -> bool {
        self.size == [grid.nx() + 1, grid.ny() + 1, grid.nz() + 1]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn media_made_from_an_index_have_it() {
        for index in [
            Complex64::new(1.56, 0.0),
            Complex64::new(5.6, 0.3),
            Complex64::new(3.5, 2.7),
            Complex64::new(0.3, 2.9), // a metal, Re ε = -8.3
            Complex64::new(0.8, 0.1),
        ] {
            let medium = Medium::from_index(index, 11.4).unwrap();
            assert!((medium.epsilon(11.4) - index * index).norm() < 1e-12);
        }
    }

    #[test]
    fn gain_is_refused_and_a_passive_sum_of_signs_is_not() {
        let pole = |strength, resonance, damping| Pole {
            strength,
            resonance,
            damping,
        };
        assert!(Medium::new(2.0, 0.0, vec![pole(-1.0, 10.0, 0.5)]).is_err());
        assert!(Medium::new(2.0, 1.0, vec![pole(-1.0, 10.0, 5.0)]).is_ok());
        assert!(Medium::new(0.0, 0.0, vec![]).is_err());
        assert!(Medium::new(2.0, f64::NAN, vec![]).is_err());
        assert!(Medium::from_index(Complex64::new(1.5, -0.1), 11.0).is_err());
        assert!(Medium::from_index(Complex64::new(0.5, -0.1), 11.0).is_err());
    }
}
