//! The products G_i(k, k') of the fields of a cone of plane waves.

use std::collections::HashMap;

use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::{PhotodiodeFields, RcwaModel, RcwaSettings};
use quadpixel::units::um_from_nm;
use rayon::prelude::*;
use rustfft::num_complex::Complex64;

use super::{GREEN_NM, Lenses};
use crate::error::LaboratoryError;

/// Memory that the fields may take, GB.
const MOST_GB: f64 = 8.0;
/// Bytes of a number of a field.
const BYTES: f64 = 8.0;

/// Which waves of a cone are summed, and which of them are solved.
pub(super) struct Plan {
    /// Pixels from spot to spot, an even number.
    pixels: usize,
    /// Distance of the waves' direction cosines.
    step: f64,
    /// (j, l) of the waves (u, v) = (j, l) step.
    waves: Vec<[i32; 2]>,
    /// Those that are solved: the others are their images in the pixel's mirrors.
    pub solved: Vec<[i32; 2]>,
    /// Alike along x and along y.
    square: bool,
}

impl Plan {
    /// For the widest of the lenses.
    ///
    /// # Errors
    /// A pixel without two halves, or whose fields take too much memory.
    pub fn new(
        stack: &PixelStack,
        lenses: &Lenses,
        settings: &RcwaSettings,
    ) -> Result<Self, LaboratoryError> {
        if stack.subpixels.m() != 2 {
            return Err(LaboratoryError::OneColumn {
                pixel: stack.name.clone(),
                subpixels: stack.subpixels,
            });
        }
        let pixels = 2 * (0.5 * lenses.period_um / stack.pitch_um).ceil() as usize;
        let step = um_from_nm(GREEN_NM) / (pixels as f64 * stack.pitch_um);
        let widest = lenses
            .f_numbers
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        // Waves whose part of the disk is more than none, as of `size`.
        let reach = 0.5 / widest / step + 0.5;
        let side = reach.ceil() as i32;
        let waves: Vec<[i32; 2]> = (-side..=side)
            .flat_map(|j| (-side..=side).map(move |l| [j, l]))
            .filter(|[j, l]| f64::from(*j).hypot(f64::from(*l)) < reach)
            .collect();
        let quadrant = waves.iter().filter(|[j, l]| *j >= 0 && *l >= 0);
        let count = PhotodiodeFields::count(stack, GREEN_NM, settings)?;
        let gb = 1e-9 * BYTES * (count * quadrant.clone().count()) as f64;
        if gb > MOST_GB {
            return Err(LaboratoryError::Memory {
                what: format!("{}: fields of {} plane waves", stack.name, waves.len()),
                gb,
                most_gb: MOST_GB,
            });
        }
        let square = stack.subpixels.m() == stack.subpixels.n();
        let solved = quadrant.filter(|[j, l]| !square || j >= l).copied();
        Ok(Self {
            pixels,
            step,
            solved: solved.collect(),
            waves,
            square,
        })
    }
}

/// Fields' products in the halves of a pixel, x < 0 and x > 0.
pub(super) struct Cone {
    pub pitch_um: f64,
    pub wavelength_um: f64,
    /// Pixels from spot to spot, along x and along y.
    pub pixels: usize,
    /// (j, l) of each wave: (u, v) = (j, l) λ/(pixels · pitch).
    pub waves: Vec<[i32; 2]>,
    /// `[half]`: G by rows of k, mean of both polarizations.
    pub products: [Vec<Complex64>; 2],
    /// Where each wave stands.
    pub places: HashMap<[i32; 2], usize>,
}

impl Cone {
    /// Of a pixel with its lens centred; `solved` is called after each wave that is solved.
    ///
    /// # Errors
    /// Waves that are not found.
    pub fn new(
        plan: Plan,
        stack: &PixelStack,
        settings: &RcwaSettings,
        solved: &(dyn Fn() + Sync),
    ) -> Result<Self, LaboratoryError> {
        let model = RcwaModel::new(&stack.with_lens_shift([0.0; 2]), GREEN_NM, settings)?;
        let of_wave = |wave: &[i32; 2]| {
            let [u, v] = wave.map(|n| f64::from(n) * plan.step);
            let fields = model.photodiode_fields(u, v);
            solved();
            Ok((*wave, fields?))
        };
        // The slow ones first, one by one: those in no mirror's plane.
        let mut order = plan.solved.clone();
        order.sort_by_key(|[j, l]| *j == 0 || *l == 0);
        let fields = order.par_iter().with_max_len(1).map(of_wave);
        let mut quadrant: HashMap<[i32; 2], PhotodiodeFields> =
            fields.collect::<Result<_, LaboratoryError>>()?;
        if plan.square {
            for [j, l] in order.into_iter().filter(|[j, l]| j > l) {
                let other = quadrant[&[j, l]].transposed();
                quadrant.insert([l, j], other);
            }
        }
        let places = places(&plan.waves);
        Ok(Self {
            pitch_um: stack.pitch_um,
            wavelength_um: um_from_nm(GREEN_NM),
            pixels: plan.pixels,
            products: products(&plan.waves, &places, &quadrant),
            waves: plan.waves,
            places,
        })
    }

    /// Distance of the waves' direction cosines.
    pub fn step(&self) -> f64 {
        self.wavelength_um / self.period_um()
    }

    /// From spot to spot.
    pub fn period_um(&self) -> f64 {
        self.pixels as f64 * self.pitch_um
    }

    /// P of a half for the direction (j, l)/2: of the wave there, or the mean of those beside it that lie in the cone.
    pub fn power(&self, half: usize, twice: [i32; 2]) -> f64 {
        let [x, y] = twice.map(|n| [n.div_euclid(2), (n + 1).div_euclid(2)]);
        let (mut sum, mut count) = (0.0, 0.0);
        for wave in [[x[0], y[0]], [x[0], y[1]], [x[1], y[0]], [x[1], y[1]]] {
            if let Some(k) = self.places.get(&wave) {
                sum += self.products[half][k * self.waves.len() + k].re;
                count += 1.0;
            }
        }
        sum / count
    }
}

/// Where each wave stands.
pub(super) fn places(waves: &[[i32; 2]]) -> HashMap<[i32; 2], usize> {
    waves
        .iter()
        .enumerate()
        .map(|(k, wave)| (*wave, k))
        .collect()
}

/// G of the left and the right half: columns of photodiodes are the even and the odd ones. Of two waves it is that of
/// their mirror images, which a mirror at x = 0 puts into the other half: so one of the two is always of the quadrant.
fn products(
    waves: &[[i32; 2]],
    places: &HashMap<[i32; 2], usize>,
    quadrant: &HashMap<[i32; 2], PhotodiodeFields>,
) -> [Vec<Complex64>; 2] {
    let n = waves.len();
    let firsts: Vec<[i32; 2]> = quadrant.keys().copied().collect();
    let first: HashMap<[i32; 2], usize> = self::places(&firsts);
    let of_second = |wave: &[i32; 2]| -> Vec<[Complex64; 2]> {
        let second = image(&quadrant[&wave.map(i32::abs)], *wave);
        let product = |a: &[i32; 2]| {
            let [x, y] = [0, 1].map(|polarization| quadrant[a].product(&second, polarization));
            let both = |half: usize| x.iter().chain(&y).skip(half).step_by(2).sum::<Complex64>();
            [0, 1].map(|half| 0.5 * both(half))
        };
        firsts.iter().map(product).collect()
    };
    let by_second: Vec<Vec<[Complex64; 2]>> = waves.par_iter().map(of_second).collect();
    [0, 1].map(|half| {
        let at = |k: usize| {
            let (a, b) = (waves[k / n], waves[k % n]);
            let turned = [0, 1].map(|axis| if a[axis] < 0 { -b[axis] } else { b[axis] });
            let half = if a[0] < 0 { 1 - half } else { half };
            by_second[places[&turned]][first[&a.map(i32::abs)]][half]
        };
        (0..n * n).map(at).collect()
    })
}

/// The image of a wave of the quadrant in the mirrors that bring it to `wave`.
fn image(fields: &PhotodiodeFields, wave: [i32; 2]) -> PhotodiodeFields {
    match wave.map(|n| n < 0) {
        [false, false] => fields.clone(),
        [true, false] => fields.mirrored_x(),
        [false, true] => fields.mirrored_y(),
        [true, true] => fields.mirrored_x().mirrored_y(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn fields_beyond_memory_are_refused_before_the_first() {
        let stack = PixelStack::builtin("3.5um").unwrap();
        let plan = |f_numbers| {
            let lenses = Lenses {
                f_numbers,
                period_um: 24.0,
            };
            Plan::new(&stack, &lenses, &RcwaSettings::draft())
        };
        let kept = plan(&[1.7]).unwrap();
        let counts = (kept.pixels, kept.waves.len(), kept.solved.len());
        assert_eq!(counts, (8, 749, 107));
        // As of a period of many more pixels.
        let error = plan(&[0.05]).map(|_| ()).unwrap_err();
        assert!(error.is_input());
        let said = error.to_string();
        assert!(
            said.contains("815853 plane waves") && said.contains("allowed: 8 GB"),
            "{said}"
        );
    }
}
