//! Media of a run: its permittivities as the grid needs them, each medium numbered once.

use std::collections::HashMap;

use rustfft::num_complex::Complex64;

use super::dispersion::{Layers, Numerics};
use super::error::refused;
use super::fills::Spectrum;
use super::{Medium, SolverError, poles};
use crate::em::Indices;

type C = Complex64;

/// Permittivities and frequencies of a run.
pub(super) struct Spectra<'a> {
    /// Indices of the stack by wavelength.
    pub indices: &'a [Indices],
    /// By wavelength.
    pub numerics: &'a [Numerics],
    /// Which wavelength the correction is made for.
    pub design: usize,
}

impl Spectra<'_> {
    /// Corrected ε of a medium in such layers.
    pub fn corrected(&self, layers: &Layers, index: impl Fn(&Indices) -> C) -> Spectrum {
        let n = index(&self.indices[self.design]);
        let factor = self.numerics[self.design].permittivity(n, layers) / (n * n);
        self.indices
            .iter()
            .map(|i| {
                let n = index(i);
                let e = n * n * factor;
                C::new(e.re, e.im.max(0.0))
            })
            .collect()
    }
}

/// The media met so far.
pub(super) struct Palette<'a> {
    spectra: &'a Spectra<'a>,
    pub media: Vec<Medium>,
    known: HashMap<Vec<[i64; 2]>, u16>,
}

impl<'a> Palette<'a> {
    pub fn new(spectra: &'a Spectra<'a>) -> Self {
        Self {
            spectra,
            media: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// Number of the medium of these ε, rounded to 1/`steps` (∞: not rounded).
    ///
    /// # Errors
    /// More than 65 536 media, or ε that no medium has.
    pub fn number(&mut self, mut epsilon: Spectrum, steps: f64) -> Result<u16, SolverError> {
        if steps.is_finite() {
            for e in &mut epsilon {
                *e = C::new(
                    (e.re * steps).round() / steps,
                    (e.im * steps).round() / steps,
                );
            }
        }
        let bits = |x: f64| (x * 1e9).round() as i64;
        let key: Vec<[i64; 2]> = epsilon.iter().map(|e| [bits(e.re), bits(e.im)]).collect();
        if let Some(id) = self.known.get(&key) {
            return Ok(*id);
        }
        let id = u16::try_from(self.media.len())
            .map_err(|_| refused("media", self.media.len() + 1, "at most 65536"))?;
        self.media.push(self.medium(&epsilon)?);
        self.known.insert(key, id);
        Ok(id)
    }

    fn medium(&self, epsilon: &Spectrum) -> Result<Medium, SolverError> {
        let omegas: Vec<f64> = self
            .spectra
            .numerics
            .iter()
            .map(Numerics::trapezoid_omega)
            .collect();
        match (epsilon.as_slice(), omegas.as_slice()) {
            // Corrected air lies a little below 1 and stays a plain dielectric.
            ([e], [omega]) if e.re >= 0.8 => Medium::new(e.re, omega * e.im, Vec::new()),
            ([e], [omega]) => Medium::from_permittivity(*e, *omega),
            _ => poles::medium(&omegas, epsilon),
        }
    }
}
