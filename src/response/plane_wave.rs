//! One plane wave on a pixel, whatever the model.

use std::path::Path;

use super::{Correction, GeometricResponse, Incidence, PixelModel, ResponseError};
use crate::em::PixelStack;
use crate::em::fdtd::{FdtdAnswer, FdtdPowers, FdtdProgress, FdtdRun, FdtdSettings, solve};
use crate::em::rcwa::{RcwaAnswer, RcwaModel, RcwaPowers};
use crate::em::wave::{WaveModel, WavePowers};

/// Where the light of a plane wave goes, as parts of the power incident on the pixel's whole footprint. They add up to one but for
/// the imbalance. Of a pixel in a mosaic of colour filters: what falls on one microlens of its colour is the unit of P, and the others are means over
/// the mosaic, `elsewhere` being what is then missing to one (absorbed in filters, or gone over to neighbours; below 0 if more came from them).
#[derive(Clone, Debug, PartialEq)]
pub struct Powers {
    /// P of each sub-pixel (see [`crate::sensor::Subpixels`] for the order).
    pub absorbed: Vec<f64>,
    /// Back into the air.
    pub reflected: f64,
    /// Below the counted silicon.
    pub transmitted: f64,
    /// Absorbed outside the photodiodes (filter, trenches, metal); of the geometric model, light that misses the pixel.
    pub elsewhere: f64,
}

/// What a model says of one plane wave.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneWaveAnswer {
    /// Mean of s and p.
    pub mean: Powers,
    /// s, then p, where the model knows them apart.
    pub polarized: Option<[Powers; 2]>,
    /// Relative residual of the solution.
    pub residual: f64,
    /// Power found beyond (> 0) or short of (< 0) the incident one.
    pub imbalance: f64,
    /// Time steps, of a model in time.
    pub steps: Option<usize>,
    /// What is wrong with the run, of a model that can tell; empty if nothing is.
    pub warnings: Vec<String>,
}

/// A pixel at one wavelength, ready to be lit from any direction.
pub struct LitPixel {
    stack: PixelStack,
    lit: Lit,
}

// A program holds a few of these, so the size of the larger variant costs nothing.
#[allow(clippy::large_enum_variant)]
enum Lit {
    Geometric(GeometricResponse),
    Wave(WaveModel),
    Fdtd {
        settings: FdtdSettings,
        wavelength_nm: f64,
    },
    Corrected {
        wave: WaveModel,
        correction: Correction,
    },
    Rcwa(RcwaModel),
}

impl LitPixel {
    /// Checks pixel, model and wavelength. The corrected level makes its exact runs here.
    pub fn new(
        stack: &PixelStack,
        model: &PixelModel,
        wavelength_nm: f64,
    ) -> Result<Self, ResponseError> {
        stack.check()?;
        if let PixelModel::Corrected(_) = model {
            return Self::with_exact_runs_in(None, stack, model, wavelength_nm);
        }
        if let (PixelModel::Geometric { .. }, Some(_)) = (model, &stack.mosaic) {
            return Err(ResponseError::value(
                "mosaic",
                "there",
                "none in the geometric model, which has no neighbours",
            ));
        }
        let lit =
            match model {
                PixelModel::Geometric { focal_length_um } => Lit::Geometric(
                    GeometricResponse::new(stack.subpixels, stack.pitch_um, *focal_length_um)?,
                ),
                PixelModel::Corrected(_) => unreachable!("made above"),
                PixelModel::Wave(settings) => {
                    Lit::Wave(WaveModel::new(stack, wavelength_nm, settings)?)
                }
                PixelModel::Fdtd(settings) => {
                    settings.memory_bytes(stack, &[wavelength_nm], [0.0, 0.0])?;
                    Lit::Fdtd {
                        settings: *settings,
                        wavelength_nm,
                    }
                }
                PixelModel::Rcwa(settings) => {
                    Lit::Rcwa(RcwaModel::new(stack, wavelength_nm, settings)?)
                }
            };
        let stack = stack.clone();
        Ok(Self { stack, lit })
    }

    /// [`Self::new`]; exact runs of the corrected level are kept in `folder` and found there again.
    pub(super) fn with_exact_runs_in(
        folder: Option<&Path>,
        stack: &PixelStack,
        model: &PixelModel,
        wavelength_nm: f64,
    ) -> Result<Self, ResponseError> {
        let PixelModel::Corrected(settings) = model else {
            return Self::new(stack, model, wavelength_nm);
        };
        let wave = WaveModel::new(stack, wavelength_nm, &settings.wave)?;
        let file = format!("{}.exact", settings.exact_key(stack, wavelength_nm, false));
        let path = folder.map(|f| f.join(file));
        let correction = settings.simulate(stack, wavelength_nm, false, path.as_deref())?;
        let stack = stack.clone();
        let lit = Lit::Corrected { wave, correction };
        Ok(Self { stack, lit })
    }

    /// The fit of the corrected level.
    pub fn correction(&self) -> Option<&Correction> {
        match &self.lit {
            Lit::Corrected { correction, .. } => Some(correction),
            _ => None,
        }
    }

    /// Lights the pixel from direction cosines (u, v); u² + v² < 1. Of a mosaic the answer is that of its colour.
    pub fn light(&self, u: f64, v: f64) -> Result<PlaneWaveAnswer, ResponseError> {
        self.light_watched(u, v, &|_| ())
    }

    /// [`Self::light`], and tells how far a model in time has come.
    pub fn light_watched(
        &self,
        u: f64,
        v: f64,
        watch: &dyn Fn(FdtdProgress),
    ) -> Result<PlaneWaveAnswer, ResponseError> {
        let mut answer = self.light_period(u, v, watch)?;
        if self.stack.mosaic.is_some() {
            let polarized = answer.polarized.iter_mut().flatten();
            for powers in polarized.chain([&mut answer.mean]) {
                powers.absorbed = self.stack.own_share(&powers.absorbed);
                let known = powers.reflected + powers.transmitted;
                powers.elsewhere = 1.0 - known - powers.absorbed.iter().sum::<f64>();
            }
        }
        Ok(answer)
    }

    /// [`Self::light_watched`] with P of every photodiode of a period, as parts of the power that falls on the period: of a mosaic all of its
    /// microlenses ([`PixelStack::by_microlens`] takes them apart).
    pub fn light_period(
        &self,
        u: f64,
        v: f64,
        watch: &dyn Fn(FdtdProgress),
    ) -> Result<PlaneWaveAnswer, ResponseError> {
        match &self.lit {
            Lit::Geometric(geometric) => {
                let mut p = vec![0f32; geometric.subpixels().count()];
                geometric.weights(u as f32, v as f32, &mut p);
                let absorbed: Vec<f64> = p.into_iter().map(f64::from).collect();
                Ok(PlaneWaveAnswer {
                    mean: Powers {
                        elsewhere: 1.0 - absorbed.iter().sum::<f64>(),
                        absorbed,
                        reflected: 0.0,
                        transmitted: 0.0,
                    },
                    polarized: None,
                    residual: 0.0,
                    imbalance: 0.0,
                    steps: None,
                    warnings: Vec::new(),
                })
            }
            Lit::Wave(model) => Ok(wave_answer(model.solve(u, v)?)),
            Lit::Corrected { wave, correction } => {
                let incidence = Incidence {
                    direction: [u, v],
                    shift_um: self.stack.lens.shift_um,
                };
                Ok(correction.apply_to(incidence, wave_answer(wave.solve(u, v)?)))
            }
            Lit::Fdtd {
                settings,
                wavelength_nm,
            } => {
                let run = pulse(&self.stack, &[*wavelength_nm], [u, v], settings, watch)?;
                let answer = run.answers.first().ok_or_else(|| {
                    ResponseError::value("answers of the FDTD run", 0, "one a wavelength")
                })?;
                Ok(PlaneWaveAnswer {
                    mean: mean(answer),
                    polarized: Some([&answer.s, &answer.p].map(powers)),
                    residual: run.residual,
                    imbalance: imbalance(&run),
                    steps: Some(run.steps as usize),
                    warnings: run.warnings(),
                })
            }
            Lit::Rcwa(model) => Ok(rcwa_answer(&model.solve(u, v)?)),
        }
    }
}

/// What the wave model says.
pub(super) fn wave_answer(powers: WavePowers) -> PlaneWaveAnswer {
    PlaneWaveAnswer {
        mean: Powers {
            transmitted: powers.into_silicon - powers.absorbed.iter().sum::<f64>(),
            absorbed: powers.absorbed,
            reflected: powers.reflected,
            elsewhere: powers.filter,
        },
        polarized: None,
        residual: powers.residual,
        imbalance: powers.imbalance,
        steps: None,
        warnings: Vec::new(),
    }
}

/// What the Fourier modal model says.
pub(super) fn rcwa_answer(answer: &RcwaAnswer) -> PlaneWaveAnswer {
    let [s, p] = [&answer.s, &answer.p].map(of_modes);
    PlaneWaveAnswer {
        mean: mean_of(&s, &p),
        polarized: Some([s, p]),
        residual: answer.residual(),
        imbalance: largest([&answer.s, &answer.p].map(|p| p.balance() - 1.0)),
        steps: None,
        warnings: Vec::new(),
    }
}

/// An FDTD run at the transverse wavevector that (u, v) is at the first of the wavelengths.
pub(super) fn pulse(
    stack: &PixelStack,
    wavelengths_nm: &[f64],
    [u, v]: [f64; 2],
    settings: &FdtdSettings,
    watch: &dyn Fn(FdtdProgress),
) -> Result<FdtdRun, ResponseError> {
    let first_um = wavelengths_nm.first().map_or(f64::NAN, |nm| nm * 1e-3);
    let k0 = 2.0 * std::f64::consts::PI / first_um;
    Ok(solve(
        stack,
        wavelengths_nm,
        [u * k0, v * k0],
        settings,
        watch,
    )?)
}

/// The deviation from 1 of the sum of all powers, the worst of the run.
pub(super) fn imbalance(run: &FdtdRun) -> f64 {
    let both = run.answers.iter().flat_map(|a| [a.s.balance, a.p.balance]);
    largest(both.map(|balance| balance - 1.0))
}

/// The one of largest size.
fn largest(of: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    of.into_iter().fold(0.0, larger)
}

fn powers(of: &FdtdPowers) -> Powers {
    Powers {
        absorbed: of.absorbed.clone(),
        reflected: of.reflected,
        transmitted: of.transmitted,
        elsewhere: of.elsewhere,
    }
}

fn of_modes(of: &RcwaPowers) -> Powers {
    Powers {
        absorbed: of.absorbed.clone(),
        reflected: of.reflected,
        transmitted: of.transmitted,
        elsewhere: of.elsewhere,
    }
}

/// The mean of s and p.
pub(super) fn mean(answer: &FdtdAnswer) -> Powers {
    mean_of(&powers(&answer.s), &powers(&answer.p))
}

fn mean_of(s: &Powers, p: &Powers) -> Powers {
    let half = |a: f64, b: f64| 0.5 * (a + b);
    let absorbed = s.absorbed.iter().zip(&p.absorbed);
    Powers {
        absorbed: absorbed.map(|(a, b)| half(*a, *b)).collect(),
        reflected: half(s.reflected, p.reflected),
        transmitted: half(s.transmitted, p.transmitted),
        elsewhere: half(s.elsewhere, p.elsewhere),
    }
}

/// Direction cosines of a wave that travels along (sin θ cos φ, sin θ sin φ, −cos θ).
pub fn direction_cosines(theta_deg: f64, phi_deg: f64) -> [f64; 2] {
    let (sin_phi, cos_phi) = phi_deg.to_radians().sin_cos();
    let sin = theta_deg.to_radians().sin();
    [sin * cos_phi, sin * sin_phi]
}
