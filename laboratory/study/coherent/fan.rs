//! The products G_i(k, k') of the fields of a fan of plane waves.

use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::{PhotodiodeFields, RcwaModel, RcwaSettings};
use quadpixel::units::um_from_nm;
use rayon::prelude::*;
use rustfft::num_complex::Complex64;

use crate::error::LaboratoryError;

/// Period of the array of spots, at least, µm: many times the light between the first dark places at F/8.
const PERIOD_UM: f64 = 24.0;
/// Memory that the fields may take, GB.
const MOST_GB: f64 = 8.0;
/// Bytes of a number of a field.
const BYTES: f64 = 8.0;

/// Fields' products in the halves of a pixel, x < 0 and x > 0.
pub(super) struct Fan {
    pub pitch_um: f64,
    pub wavelength_um: f64,
    /// Pixels from spot to spot, an even number.
    pub pixels: usize,
    /// Waves to each side of the axis; wave j has u = (j − side) λ/(pixels · pitch).
    pub side: usize,
    /// `[polarization][half]`: G by rows of k.
    pub products: [[Vec<Complex64>; 2]; 2],
}

impl Fan {
    /// Whether the fan of a pixel can be computed: pixels between two spots, waves to each side.
    ///
    /// # Errors
    /// A pixel without two halves, without a mirror, or whose fields take too much memory.
    pub fn check(
        stack: &PixelStack,
        wavelength_nm: f64,
        f_number: f64,
        settings: &RcwaSettings,
    ) -> Result<(usize, usize), LaboratoryError> {
        if stack.subpixels.m() != 2 {
            return Err(LaboratoryError::OneColumn {
                pixel: stack.name.clone(),
                subpixels: stack.subpixels,
            });
        }
        let pixels = 2 * (0.5 * PERIOD_UM / stack.pitch_um).ceil() as usize;
        let step = um_from_nm(wavelength_nm) / (pixels as f64 * stack.pitch_um);
        let side = (0.5 / f_number / step).ceil() as usize;
        let count = PhotodiodeFields::count(stack, wavelength_nm, settings)?;
        let gb = 1e-9 * BYTES * (count * (2 * side + 1)) as f64;
        if gb > MOST_GB {
            return Err(LaboratoryError::Memory {
                what: format!("{}: fields of {} plane waves", stack.name, 2 * side + 1),
                gb,
                most_gb: MOST_GB,
            });
        }
        Ok((pixels, side))
    }

    /// Of a pixel with its lens centred, for lenses of `f_number` and more.
    ///
    /// # Errors
    /// As of [`Self::check`], or waves that are not found.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        f_number: f64,
        settings: &RcwaSettings,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, LaboratoryError> {
        let (pixels, side) = Self::check(stack, wavelength_nm, f_number, settings)?;
        let centred = stack.with_lens_shift([0.0; 2]);
        let model = RcwaModel::new(&centred, wavelength_nm, settings)?;
        let wavelength_um = um_from_nm(wavelength_nm);
        let step = wavelength_um / (pixels as f64 * stack.pitch_um);
        let done = AtomicUsize::new(0);
        let half: Vec<PhotodiodeFields> = (0..=side)
            .into_par_iter()
            .map(|j| {
                let fields = model.photodiode_fields(j as f64 * step, 0.0);
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, side + 1);
                fields
            })
            .collect::<Result<_, _>>()?;
        let other = half[1..].iter().rev().map(PhotodiodeFields::mirrored_x);
        let waves: Vec<PhotodiodeFields> =
            other.collect::<Vec<_>>().into_iter().chain(half).collect();
        Ok(Self {
            pitch_um: stack.pitch_um,
            wavelength_um,
            pixels,
            side,
            products: [0, 1].map(|polarization| products(&waves, polarization)),
        })
    }

    /// Waves.
    pub fn count(&self) -> usize {
        2 * self.side + 1
    }

    /// u of wave `j`.
    pub fn u(&self, j: usize) -> f64 {
        (j as f64 - self.side as f64) * self.wavelength_um / self.period_um()
    }

    /// From spot to spot.
    pub fn period_um(&self) -> f64 {
        self.pixels as f64 * self.pitch_um
    }
}

/// G of the left and the right half: columns of photodiodes are the even and the odd ones.
fn products(waves: &[PhotodiodeFields], polarization: usize) -> [Vec<Complex64>; 2] {
    let n = waves.len();
    let rows: Vec<Vec<[Complex64; 2]>> = (0..n)
        .into_par_iter()
        .map(|a| {
            let product = |b: usize| {
                let each = waves[a].product(&waves[b], polarization);
                [0, 1].map(|half| each.iter().skip(half).step_by(2).sum())
            };
            (a..n).map(product).collect()
        })
        .collect();
    [0, 1].map(|half| {
        let at = |k: usize| match (k / n, k % n) {
            (a, b) if b >= a => rows[a][b - a][half],
            (a, b) => rows[b][a - b][half].conj(),
        };
        (0..n * n).map(at).collect()
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn fields_beyond_memory_are_refused_before_the_first() {
        let stack = PixelStack::builtin("3.5um").unwrap();
        let check = |f_number| Fan::check(&stack, 550.0, f_number, &RcwaSettings::draft());
        assert_eq!(check(1.7).unwrap(), (8, 15));
        // Cones of 510 waves to a side, as of a period of many more pixels.
        let error = check(0.05).unwrap_err();
        assert!(error.is_input());
        let said = error.to_string();
        assert!(
            said.contains("1021 plane waves") && said.contains("allowed: 8 GB"),
            "{said}"
        );
    }
}
