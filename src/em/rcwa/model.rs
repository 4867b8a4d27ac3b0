//! From a pixel and a direction to powers.

use std::f64::consts::PI;

use super::basis::{Lattice, Parity, Sector};
use super::column::{Column, Pixel};
use super::lens::LensSlices;
use super::linear::{C, Matrix, flux, solve};
use super::powers::{balance, check_finite, order_zero, powers};
use super::shifts;
use super::supercell;
use super::uniform::Uniform;
use super::{RcwaSettings, SolverError};
use crate::em::PixelStack;
use crate::em::light::{Light, Powers, largest};
use crate::range::{OutOfRange, within};
use crate::units::um_from_nm;

/// Name and version of the model: part of every table's key, so a change of the physics changes the key.
pub const MODEL: &str = "rcwa-1";

/// sin θ up to which a wave is taken for a plane wave in air.
const STEEPEST: f64 = 0.999;

/// Functions of one matrix that are still computed: 0.6 GB each, of which a direction holds some dozen.
const MOST_FUNCTIONS: f64 = 6000.0;

/// A pixel at one wavelength, ready to be lit from any direction.
pub struct RcwaModel(Pixel);

impl RcwaModel {
    pub(super) fn pixel(&self) -> &Pixel {
        &self.0
    }

    /// The pixel at one wavelength.
    ///
    /// # Errors
    /// A pixel, settings or a wavelength out of range, or more functions than a matrix can hold.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &RcwaSettings,
    ) -> Result<Self, SolverError> {
        stack.check()?;
        settings.check()?;
        let indices = stack.indices(wavelength_nm)?;
        let k0_per_um = 2.0 * PI / um_from_nm(wavelength_nm);
        let step = 2.0 * PI / (stack.period_um() * k0_per_um);
        let step_of_microlens = 2.0 * PI / (stack.pitch_um * k0_per_um);
        check_walls(stack)?;
        // Two components for every order in a circle, in silicon parted into classes.
        let functions = |cutoff: f64| 2.0 * PI * (cutoff / step).powi(2);
        let above = match stack.metal {
            Some(_) => settings.wall_cutoff.max(settings.lens_cutoff),
            None => settings.lens_cutoff,
        };
        // Without trenches silicon couples no orders: those that come down are all.
        let silicon_cutoff = match stack.trench_um > 0.0 {
            true => indices.silicon.re + settings.silicon_margin * step_of_microlens,
            false => above,
        };
        let in_class = functions(silicon_cutoff) / stack.photodiodes() as f64;
        for (field, functions) in [
            ("functions of a class in silicon (pitch, orders)", in_class),
            (
                "functions above the silicon (pitch, orders)",
                functions(above),
            ),
        ] {
            within("rcwa", field, functions.round(), 0.0..=MOST_FUNCTIONS)?;
        }
        // The sum of two order numbers of a microlens, each up to (cutoff + 1)/step.
        let most = 2 * ((settings.lens_cutoff + 1.0) / step_of_microlens).ceil() as usize;
        Ok(Self(Pixel {
            stack: stack.clone(),
            settings: *settings,
            k0_per_um,
            step,
            silicon_cutoff,
            slices: LensSlices::new(stack, indices.lens, um_from_nm(settings.slice_nm), most),
            indices,
        }))
    }

    /// Where the light of a plane wave of direction cosines (u, v) goes.
    ///
    /// # Errors
    /// √(u² + v²) above 0.999, or modes that are not found.
    pub fn solve(&self, u: f64, v: f64) -> Result<Light, SolverError> {
        check_direction(u, v)?;
        // cos 90° in binary is not quite 0, and a mirror is worth a factor of four.
        let bloch = [u, v].map(|x| if x.abs() < 1e-12 { 0.0 } else { x });
        let mirrors =
            [0, 1].map(|axis| bloch[axis] == 0.0 && self.0.stack.lens.shift_um[axis] == 0.0);
        let [s, p] = incident(bloch);
        let ((s, p), functions) = if mirrors == [false, false] {
            let ([s, p], functions) = self.light(bloch, sector_of(s, mirrors), [s, p])?;
            ((s, p), functions)
        } else {
            let one = |wave| self.light(bloch, sector_of(wave, mirrors), [wave]);
            let (([s], of_s), ([p], of_p)) = (one(s)?, one(p)?);
            ((s, p), of_s.max(of_p))
        };
        Ok(answer([s, p], functions))
    }

    /// [`Self::solve`] for each of several lens shifts (µm) in place of the stack's own. Silicon, layers and lens are
    /// solved once for all; no mirror is used, so fewer than four shifts of a direction in a plane of symmetry are
    /// better solved one by one. Not for mosaics.
    ///
    /// # Errors
    /// As of [`Self::solve`], or a mosaic.
    pub fn solve_shifts(
        &self,
        u: f64,
        v: f64,
        shifts_um: &[[f64; 2]],
    ) -> Result<Vec<Light>, SolverError> {
        check_direction(u, v)?;
        if self.0.stack.mosaic.is_some() {
            let allowed = "none for many lens shifts at once";
            return Err(OutOfRange::new("rcwa", "mosaic", "of several colours", allowed).into());
        }
        let (bloch, step) = ([u, v], self.0.step);
        let pitches: Vec<[f64; 2]> = shifts_um
            .iter()
            .map(|s| s.map(|s| s / self.0.stack.pitch_um))
            .collect();
        let lattice = Lattice { bloch, step };
        let (all, functions) = shifts::light(&self.0, lattice, incident(bloch), &pitches)?;
        Ok(all
            .into_iter()
            .map(|both| answer(both, functions))
            .collect())
    }

    /// Powers of incident waves (E_x, E_y of order 0) of a sector, and the functions followed in silicon.
    fn light<const N: usize>(
        &self,
        bloch: [f64; 2],
        sector: Sector,
        waves: [[f64; 2]; N],
    ) -> Result<([Powers; N], usize), SolverError> {
        let pixel = &self.0;
        let lattice = Lattice {
            bloch,
            step: pixel.step,
        };
        let (powers, functions) = match pixel.indices.mosaic {
            Some(filters) => supercell::light(pixel, lattice, sector, waves, filters.n)?,
            None => {
                let column = Column::new(pixel, lattice, sector)?;
                (light(&column, waves), column.functions())
            }
        };
        check_finite(&powers)?;
        Ok((powers, functions))
    }
}

pub(super) fn check_direction(u: f64, v: f64) -> Result<(), OutOfRange> {
    let field = "sine of the angle of incidence";
    within("rcwa", field, u.hypot(v), 0.0..=STEEPEST)
}

/// Fields at the top of a column, a column per wave.
pub(super) struct Top {
    /// E and h of the incident waves.
    pub incident: Matrix,
    pub h_incident: Matrix,
    /// E of all.
    pub e: Matrix,
}

impl Top {
    /// Of incident waves of the column's sector.
    pub fn new(column: &Column, waves: &[[f64; 2]]) -> Self {
        let air = Uniform::new(&column.basis, C::ONE);
        let incident = order_zero(&column.basis, waves);
        let h_incident = air.times(&incident);
        let twice = h_incident.clone() * faer::Scale(C::from(2.0));
        let e = solve(&(air.matrix() + &column.admittance), &twice);
        Self {
            incident,
            h_incident,
            e,
        }
    }
}

/// Powers of incident waves of the column's sector.
fn light<const N: usize>(column: &Column, waves: [[f64; 2]; N]) -> [Powers; N] {
    let Top {
        incident,
        h_incident,
        e,
    } = Top::new(column, &waves);
    let h = &column.admittance * &e;
    let up = &e - &incident;
    let h_up = Uniform::new(&column.basis, C::ONE).times(&up);
    let inside = column.absorb(&e);
    std::array::from_fn(|j| {
        let unit = 1.0 / flux(incident.as_ref(), h_incident.as_ref(), j);
        let entering = flux(e.as_ref(), h.as_ref(), j);
        let reflected = flux(up.as_ref(), h_up.as_ref(), j);
        powers(&inside[j], entering, reflected, unit)
    })
}

/// What is answered of s and p; the residual is the largest difference of what the photodiodes absorb by volume and by
/// flux.
fn answer([s, p]: [Powers; 2], functions: usize) -> Light {
    let off = |p: &Powers| (p.absorbed.iter().sum::<f64>() - p.sum_by_flux()).abs();
    Light {
        residual: off(&s).max(off(&p)),
        imbalance: largest([&s, &p].map(|p| balance(p) - 1.0)),
        functions: Some(functions),
        ..Light::from_polarizations(s, p)
    }
}

/// Walls above the filters of a mosaic would couple the classes that the lens keeps apart.
fn check_walls(stack: &PixelStack) -> Result<(), SolverError> {
    let (Some(_), Some((filter, _)), Some(metal)) =
        (&stack.mosaic, stack.filter_layer(), &stack.metal)
    else {
        return Ok(());
    };
    match stack.layers.iter().position(|l| l.name == metal.layer) {
        Some(walls) if walls < filter => {
            let (layer, allowed) = (
                format!("`{}`", metal.layer),
                "a layer below the filters of a mosaic",
            );
            Err(OutOfRange::new("rcwa", "metal.layer", layer, allowed).into())
        }
        _ => Ok(()),
    }
}

/// Tangential E of s and p, of unit strength.
fn incident([u, v]: [f64; 2]) -> [[f64; 2]; 2] {
    let sine = u.hypot(v);
    let [c, s] = if sine > 0.0 {
        [u / sine, v / sine]
    } else {
        [1.0, 0.0]
    };
    let cosine = (1.0 - sine * sine).sqrt();
    [[-s, c], [c * cosine, s * cosine]]
}

/// The parities of E_x that a wave makes, where there are mirrors. Its E lies along or across each of them.
pub(super) fn sector_of([ex, _]: [f64; 2], mirrors: [bool; 2]) -> Sector {
    let [x, y] = mirrors.map(|mirror| match (mirror, ex != 0.0) {
        (false, _) => Parity::None,
        (true, true) => Parity::Even,
        (true, false) => Parity::Odd,
    });
    Sector { x, y }
}
