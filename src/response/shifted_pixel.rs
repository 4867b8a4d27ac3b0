//! One plane wave on a pixel under several lens shifts.
//!
//! A lens moved by s multiplies each diffraction order (a, b) of its field by `e^(−2πi (a, b)·s / pitch)`. So P is periodic in s, and a
//! model that knows its orders ([`WaveModel::solve_shifts`], [`RcwaModel::solve_shifts`]) answers for all shifts at little more than the
//! cost of one.

use std::path::Path;

use super::plane_wave::{rcwa_answer, wave_answer};
use super::{
    Correction, Incidence, LitPixel, MovingFrame, PixelModel, PlaneWaveAnswer, ResponseError,
};
use crate::em::PixelStack;
use crate::em::rcwa::RcwaModel;
use crate::em::wave::WaveModel;
use crate::sensor::Subpixels;

/// A pixel at one wavelength whose lens is moved about.
pub struct ShiftedPixel {
    stack: PixelStack,
    model: PixelModel,
    wavelength_nm: f64,
    /// The models that share their work among the shifts.
    wave: Option<WaveModel>,
    rcwa: Option<RcwaModel>,
    correction: Option<Correction>,
}

impl ShiftedPixel {
    /// Checks pixel, model and wavelength. The corrected level makes its exact runs here. Refuses the geometric model, whose lens has no neighbours: it is exact in its moving frame.
    pub fn new(
        stack: &PixelStack,
        model: &PixelModel,
        wavelength_nm: f64,
    ) -> Result<Self, ResponseError> {
        Self::with_exact_runs_in(None, stack, model, wavelength_nm)
    }

    /// [`Self::new`]; exact runs of the corrected level are kept in `folder` and found there again.
    pub(super) fn with_exact_runs_in(
        folder: Option<&Path>,
        stack: &PixelStack,
        model: &PixelModel,
        wavelength_nm: f64,
    ) -> Result<Self, ResponseError> {
        if let PixelModel::Geometric { .. } = model {
            return Err(ResponseError::value(
                "model",
                "geometric",
                "a wave-optical one; a shifted geometric pixel is exact in its moving frame",
            ));
        }
        stack.check()?;
        let (mut wave, mut rcwa, mut correction) = (None, None, None);
        match model {
            PixelModel::Wave(settings) => {
                wave = Some(WaveModel::new(stack, wavelength_nm, settings)?);
            }
            PixelModel::Corrected(settings) => {
                wave = Some(WaveModel::new(stack, wavelength_nm, &settings.wave)?);
                let key = settings.exact_key(stack, wavelength_nm, true);
                let path = folder.map(|f| f.join(format!("{key}.exact")));
                correction =
                    Some(settings.simulate(stack, wavelength_nm, true, path.as_deref())?);
            }
            // A mosaic's shifts are solved one by one.
            PixelModel::Rcwa(settings) if stack.mosaic.is_none() => {
                rcwa = Some(RcwaModel::new(stack, wavelength_nm, settings)?);
            }
            // Says what is wrong, if anything is, before a long build.
            _ => drop(LitPixel::new(stack, model, wavelength_nm)?),
        }
        Ok(Self {
            stack: stack.clone(),
            model: model.clone(),
            wavelength_nm,
            wave,
            rcwa,
            correction,
        })
    }

    /// The fit of the corrected level.
    pub fn correction(&self) -> Option<&Correction> {
        self.correction.as_ref()
    }

    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        self.stack.subpixels
    }
    /// Pitch in µm.
    pub fn pitch_um(&self) -> f64 {
        self.stack.pitch_um
    }
    /// How a lens shift moves the response, to first order.
    pub fn frame(&self) -> Result<MovingFrame, ResponseError> {
        MovingFrame::of(&self.stack, self.wavelength_nm)
    }

    /// Lights the pixel from direction cosines (u, v), u² + v² < 1, under each shift (µm) of the lens.
    pub fn light(
        &self,
        u: f64,
        v: f64,
        shifts_um: &[[f64; 2]],
    ) -> Result<Vec<PlaneWaveAnswer>, ResponseError> {
        if let Some(wave) = &self.wave {
            let all = wave.solve_shifts(u, v, shifts_um)?;
            let answers = all.into_iter().map(wave_answer).zip(shifts_um);
            let corrected = |(answer, &shift_um): (PlaneWaveAnswer, &[f64; 2])| {
                let incidence = Incidence {
                    direction: [u, v],
                    shift_um,
                };
                match &self.correction {
                    Some(correction) => correction.apply_to(incidence, answer),
                    None => answer,
                }
            };
            return Ok(answers.map(corrected).collect());
        }
        // One shift alone may have mirrors to halve it by.
        if let Some(rcwa) = self.rcwa.as_ref().filter(|_| shifts_um.len() > 1) {
            let all = rcwa.solve_shifts(u, v, shifts_um)?;
            return Ok(all.iter().map(rcwa_answer).collect());
        }
        let one = |&shift: &[f64; 2]| {
            let stack = shifted(&self.stack, shift);
            LitPixel::new(&stack, &self.model, self.wavelength_nm)?.light(u, v)
        };
        shifts_um.iter().map(one).collect()
    }
}

/// The pixel with its lens elsewhere.
pub(super) fn shifted(stack: &PixelStack, shift_um: [f64; 2]) -> PixelStack {
    let mut stack = stack.clone();
    stack.lens.shift_um = shift_um;
    stack
}
