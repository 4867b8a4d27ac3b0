//! The seam of all pixel solvers: plane waves in, where their light goes out.
//!
//! ```text
//!   Incidence (u, v, lens shift) ─┐
//!   wavelengths of the solver ────┴▶ PixelSolver::light ─▶ Light: absorbed, reflected, transmitted, elsewhere,
//!                                                                 and how well it is known
//! ```
//! A batch of incidences is asked at once, for a solver may share work among them: one that works in diffraction orders
//! among the lens shifts of one direction, one that works in time among the wavelengths of one transverse wavevector
//! k∥.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::PixelStack;
pub use super::error::SolverError;
use super::mosaic::FilterColour;
use crate::sensor::MovingFrame;

/// One plane wave on a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Incidence {
    /// Direction cosines (u, v), u² + v² < 1; of a batch at several wavelengths those at the first, and all have its
    /// k∥.
    pub direction: [f64; 2],
    /// Shift (s_x, s_y) of the microlens in µm.
    pub shift_um: [f64; 2],
}

/// Where the light of a plane wave of one polarization (or the mean of both) goes, as parts of the power that falls on
/// the period.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Powers {
    /// Absorbed per photodiode of the period (see [`crate::sensor::Subpixels`] for the order; of a mosaic microlens by
    /// microlens, [`super::mosaic`]).
    pub absorbed: Vec<f64>,
    /// The photodiodes' absorption found in a second way, by the flux through their faces: one value per photodiode, or
    /// one for all together; empty of a solver that has no second way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub absorbed_by_flux: Vec<f64>,
    /// Reflected into all orders in air.
    pub reflected: f64,
    /// Passing below the counted silicon.
    pub transmitted: f64,
    /// Absorbed elsewhere: in lens, layers, walls, trenches and isolation; of the geometric pixel, light that
    /// misses it.
    pub elsewhere: f64,
}

impl Powers {
    /// Sum of all powers; 1 of an exact solution.
    pub fn balance(&self) -> f64 {
        self.reflected + self.absorbed.iter().sum::<f64>() + self.transmitted + self.elsewhere
    }

    /// The photodiodes' absorption by flux, all together.
    pub fn sum_by_flux(&self) -> f64 {
        self.absorbed_by_flux.iter().sum()
    }

    /// Mean of both polarizations.
    pub fn mean(s: &Self, p: &Self) -> Self {
        let half = |a: f64, b: f64| 0.5 * (a + b);
        let halves = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| half(*a, *b)).collect();
        Self {
            absorbed: halves(&s.absorbed, &p.absorbed),
            absorbed_by_flux: halves(&s.absorbed_by_flux, &p.absorbed_by_flux),
            reflected: half(s.reflected, p.reflected),
            transmitted: half(s.transmitted, p.transmitted),
            elsewhere: half(s.elsewhere, p.elsewhere),
        }
    }
}

/// What a solver answers to one plane wave at one wavelength.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// Mean of s and p.
    pub mean: Powers,
    /// s (E across the plane of incidence; along y at u = v = 0), then p, of a solver that knows them apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub polarized: Option<[Powers; 2]>,
    /// Relative residual of the solution.
    pub residual: f64,
    /// Power found beyond (> 0) or short of (< 0) the incident one, of the polarization where it is largest. Of the
    /// wave level also: by what part a sum below the lens was more than the light that came to it, if that is larger.
    pub imbalance: f64,
    /// Time steps, of a solver in time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steps: Option<usize>,
    /// Functions followed for one polarization, of a solver by modes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub functions: Option<usize>,
    /// What is wrong with the solution, of a solver that can tell; empty if nothing is.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Light {
    /// Of both polarizations.
    pub fn from_polarizations(s: Powers, p: Powers) -> Self {
        Self {
            mean: Powers::mean(&s, &p),
            polarized: Some([s, p]),
            ..Self::default()
        }
    }

    /// Powers of s; the mean, of a solver that does not know it apart.
    pub fn s(&self) -> &Powers {
        self.polarized.as_ref().map_or(&self.mean, |[s, _]| s)
    }

    /// Powers of p; the mean, of a solver that does not know it apart.
    pub fn p(&self) -> &Powers {
        self.polarized.as_ref().map_or(&self.mean, |[_, p]| p)
    }

    /// Of a pixel in a mosaic, P of the microlens of its colour (of green the mean of both) per light on that one
    /// microlens. The others stay means over the mosaic, `elsewhere` being what is then missing to one: absorbed in
    /// filters, or gone over to neighbours; below 0 if more came from them. Without a mosaic nothing changes.
    #[must_use]
    pub fn on_microlens(mut self, stack: &PixelStack) -> Self {
        let Some(mosaic) = &stack.mosaic else {
            return self;
        };
        let polarized = self.polarized.iter_mut().flatten();
        for powers in polarized.chain([&mut self.mean]) {
            powers.absorbed = stack.share_of(mosaic.colour, &powers.absorbed);
            let known = powers.reflected + powers.transmitted;
            powers.elsewhere = 1.0 - known - powers.absorbed.iter().sum::<f64>();
        }
        self
    }

    /// Only the mean over the polarizations, which is what a table is made of.
    #[must_use]
    pub fn unpolarized(self) -> Self {
        Self {
            polarized: None,
            ..self
        }
    }
}

/// The value of largest size; 0 of none.
pub(crate) fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    values.into_iter().fold(0.0, larger)
}

/// How far a solver in time has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolverProgress {
    /// Simulated time in µm/c.
    pub time_um: f64,
    /// Largest change of a photodiode's P in the last check; infinite before there are two values.
    pub residual: f64,
}

/// What a solver is made for.
#[derive(Clone, Copy, Debug)]
pub struct SolverTask<'a> {
    /// The pixel.
    pub stack: &'a PixelStack,
    /// Wavelengths in nm, increasing.
    pub wavelengths_nm: &'a [f64],
    /// Whether it will be asked for other lens shifts than the pixel's own.
    pub any_shift: bool,
    /// Where a solver may keep what it has to find out first.
    pub folder: Option<&'a Path>,
}

/// A pixel at one wavelength, or at several that are answered for at once, ready to be lit.
pub trait PixelSolver: Send + Sync {
    /// The pixel.
    fn stack(&self) -> &PixelStack;

    /// Its wavelengths in nm; more than one only of a solver that answers for all of them in one run at one k∥.
    fn wavelengths_nm(&self) -> &[f64];

    /// Where the light of each plane wave goes at the first `wavelengths` of the solver's: `[incidence][wavelength]`.
    /// `watch` hears how far a solver in time has come.
    ///
    /// An answer is of all photodiodes of the period; it may hang, in the last bits, on the lens shifts that it was
    /// asked with.
    ///
    /// # Errors
    /// A wave that does not travel in air, or a solution that was not found.
    fn light(
        &self,
        waves: &[Incidence],
        wavelengths: usize,
        watch: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError>;

    /// [`Self::light`] at the first wavelength, on the microlens of the pixel's colour ([`Light::on_microlens`]): of a
    /// solver that finds one colour without the others.
    ///
    /// # Errors
    /// As there.
    fn light_on_microlens(&self, waves: &[Incidence]) -> Result<Vec<Light>, SolverError> {
        let answers = self.light(waves, 1, &|_| ())?.into_iter().flatten();
        Ok(answers.map(|l| l.on_microlens(self.stack())).collect())
    }

    /// How a lens shift moves the response, to first order.
    ///
    /// # Errors
    /// A material that does not know the wavelength.
    fn frame(&self) -> Result<MovingFrame, SolverError> {
        let first_nm = self.wavelengths_nm().first().copied().unwrap_or(f64::NAN);
        Ok(self.stack().moving_frame(first_nm)?)
    }

    /// How well a correction that the solver makes fits the runs it was made from; `None` of one that makes none.
    fn correction_fit(&self) -> Option<CorrectionFit> {
        None
    }
}

impl dyn PixelSolver + '_ {
    /// Light from direction cosines (u, v) under the pixel's own lens shift, at the first wavelength: of all
    /// photodiodes of the period.
    ///
    /// # Errors
    /// As of [`PixelSolver::light`].
    pub fn on_period(&self, u: f64, v: f64) -> Result<Light, SolverError> {
        self.on_period_watched(u, v, &|_| ())
    }

    /// `on_period`, and tells how far a solver in time has come.
    ///
    /// # Errors
    /// As there.
    pub fn on_period_watched(
        &self,
        u: f64,
        v: f64,
        watch: &dyn Fn(SolverProgress),
    ) -> Result<Light, SolverError> {
        let wave = Incidence {
            direction: [u, v],
            shift_um: self.stack().lens.shift_um,
        };
        let answers = self.light(&[wave], 1, watch)?;
        let first = answers.into_iter().flatten().next();
        first.ok_or_else(|| SolverError::value("answers", 0, "one per plane wave"))
    }

    /// `on_period` of the microlens of the pixel's colour ([`Light::on_microlens`]).
    ///
    /// # Errors
    /// As there.
    pub fn on_microlens(&self, u: f64, v: f64) -> Result<Light, SolverError> {
        Ok(self.on_period(u, v)?.on_microlens(self.stack()))
    }

    /// Light on the microlens of the pixel's colour from (u, v) under each of these lens shifts (µm), at the first
    /// wavelength.
    ///
    /// # Errors
    /// As of [`PixelSolver::light`].
    pub fn under_shifts(
        &self,
        u: f64,
        v: f64,
        shifts_um: &[[f64; 2]],
    ) -> Result<Vec<Light>, SolverError> {
        let wave = |&shift_um| Incidence {
            direction: [u, v],
            shift_um,
        };
        let waves: Vec<Incidence> = shifts_um.iter().map(wave).collect();
        self.light_on_microlens(&waves)
    }
}

/// How far a model was from the runs of an exact one that correct it, and what is left where a run is left out of the
/// fit: of P, not in parts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CorrectionFit {
    /// Exact runs.
    pub runs: usize,
    /// RMS of exact less uncorrected.
    pub before_rms: f64,
    /// Largest of exact less uncorrected.
    pub before_max: f64,
    /// RMS of exact less corrected, each run left out in turn.
    pub left_rms: f64,
    /// Largest of exact less corrected, each run left out in turn.
    pub left_max: f64,
}

/// Direction cosines of a wave that travels along (sin θ cos φ, sin θ sin φ, −cos θ).
pub fn direction_cosines(theta_deg: f64, phi_deg: f64) -> [f64; 2] {
    let (sin_phi, cos_phi) = phi_deg.to_radians().sin_cos();
    let sin = theta_deg.to_radians().sin();
    [sin * cos_phi, sin * sin_phi]
}

/// Calls `solve` once per run of neighbouring incidences of one direction, with their lens shifts.
pub(crate) fn by_direction(
    waves: &[Incidence],
    mut solve: impl FnMut([f64; 2], &[[f64; 2]]) -> Result<Vec<Light>, SolverError>,
) -> Result<Vec<Vec<Light>>, SolverError> {
    let mut answers = Vec::with_capacity(waves.len());
    for batch in waves.chunk_by(|a, b| a.direction == b.direction) {
        let shifts: Vec<[f64; 2]> = batch.iter().map(|w| w.shift_um).collect();
        let light = solve(batch[0].direction, &shifts)?;
        answers.extend(light.into_iter().map(|light| vec![light]));
    }
    Ok(answers)
}

/// The colours that a pixel's photodiodes are told apart by: its mosaic's, or the one of the pixel without.
pub fn colours(stack: &PixelStack) -> Vec<FilterColour> {
    match &stack.mosaic {
        Some(_) => FilterColour::ALL.to_vec(),
        None => vec![FilterColour::default()],
    }
}
