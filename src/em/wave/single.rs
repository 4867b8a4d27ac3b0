//! One microlens whose neighbours are all alike.

use rustfft::num_complex::{Complex32, Complex64};

use super::budget::{Budget, at_most};
use super::kept_modes::KeptModes;
use super::lens::{Illumination, LensField, LensRegion};
use super::planar::{FlatLayers, FlatStack};
use super::silicon::{Silicon, Surface};
use super::spectral::{Order, orders_within};
use super::{MATCHING_TOLERANCE, WaveSettings};
use crate::em::light::{
    Incidence, Light, PixelSolver, Powers, SolverError, SolverProgress, by_direction, largest,
};
use crate::em::{PixelStack, StackError};
use crate::units::um_from_nm;

type C = Complex64;

/// What all lens shifts share at one angle.
struct Parts<'a> {
    illumination: &'a Illumination<'a>,
    flat: &'a FlatStack,
    silicon: &'a Silicon,
    /// (u, v).
    direction: [f64; 2],
}

/// A pixel at one wavelength, ready to be lit from any direction.
pub struct WaveModel {
    stack: PixelStack,
    wavelength_nm: [f64; 1],
    settings: WaveSettings,
    flat: FlatLayers,
    pub(super) surface: Surface,
    pub(super) k0: f64,
    /// Largest |k⊥| above the silicon, 1/µm.
    pub(super) cutoff: f64,
    lens: LensRegion,
    modes: KeptModes,
}

/// Light of one direction as it comes down onto silicon without trenches, under a centred lens.
pub(super) struct Falling {
    pub orders: Vec<Order>,
    /// Power amplitudes in the last layer.
    pub down: Vec<C>,
    pub budget: Budget,
    pub residual: f64,
}

impl WaveModel {
    /// The pixel at one wavelength.
    ///
    /// # Errors
    /// A pixel, settings or a wavelength out of range; metal walls and mosaics, which are `WaveMosaic`'s.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &WaveSettings,
    ) -> Result<Self, StackError> {
        stack.check()?;
        settings.check()?;
        if let Some(metal) = &stack.metal {
            return Err(StackError::value(
                "metal",
                format!("a wall in `{}`", metal.layer),
                "none in the wave model (a scalar wave does not know how metal treats each polarization); use the fdtd model, or leave [metal] out",
            ));
        }
        if stack.mosaic.is_some() {
            return Err(StackError::value(
                "mosaic",
                "there",
                "none in the wave model of a single microlens, which others correct; use the wave, the rcwa or the fdtd model itself, or leave [mosaic] out",
            ));
        }
        let n = stack.indices(wavelength_nm)?;
        let flat = FlatLayers::new(stack, &n);
        let k0 = 2.0 * std::f64::consts::PI / um_from_nm(wavelength_nm);
        // All that travels in the layers has to be there, whatever the setting.
        let cutoff = settings.order_cutoff.max(1.01 * flat.densest()) * k0;
        let reach = cutoff * stack.pitch_um / (2.0 * std::f64::consts::PI);
        let grid = fast_length((2.5 * reach).ceil() as usize + 2);
        let lens = LensRegion::new(stack, n.lens, k0, um_from_nm(settings.slice_nm), grid);
        Ok(Self {
            stack: stack.clone(),
            wavelength_nm: [wavelength_nm],
            settings: *settings,
            surface: Surface {
                above: flat.last(),
                silicon: n.silicon,
            },
            modes: KeptModes::new(
                stack,
                [n.silicon, n.trench],
                k0,
                settings.silicon_cutoff * n.silicon.re * k0,
            ),
            flat,
            k0,
            cutoff,
            lens,
        })
    }

    /// Where the light of a plane wave of direction cosines (u, v) goes.
    ///
    /// # Errors
    /// u² + v² of 1 or more.
    pub fn solve(&self, u: f64, v: f64) -> Result<Light, StackError> {
        let shifts = [self.stack.lens.shift_um];
        let mut one = self.solve_shifts(u, v, &shifts)?;
        Ok(one.swap_remove(0))
    }

    /// [`Self::solve`] for each of several lens shifts (µm) in place of the stack's own.
    ///
    /// A lens moved by s multiplies the field's order (a, b) below it by `e^(−i G·s)`, `G = 2π (a, b) / pitch`: all
    /// shifts share the field in the lens, but for the light that the trenches send back into it.
    ///
    /// # Errors
    /// As of [`Self::solve`].
    pub fn solve_shifts(
        &self,
        u: f64,
        v: f64,
        shifts_um: &[[f64; 2]],
    ) -> Result<Vec<Light>, StackError> {
        let bloch = self.bloch(u, v)?;
        let orders = self.orders(bloch);
        let silicon = Silicon::new(
            self.surface,
            self.k0,
            self.stack.pitch_um,
            bloch,
            [
                self.modes.at(bloch[0], self.stack.subpixels.m()),
                self.modes.at(bloch[1], self.stack.subpixels.n()),
            ],
        );
        // The lens sees plain silicon below; what the trenches send back otherwise is added as a source, `bounces`
        // times.
        let flat = FlatStack::new(&self.flat, self.surface.silicon, self.k0, &orders);
        let illumination = self.illumination(&orders, &flat);
        // These passes find a few per cent of the light: a rough field is enough.
        let rough = if self.settings.bounces > 0 { 5.0 } else { 1.0 };
        let dark = vec![C::ZERO; orders.len()];
        let mut field = Vec::new();
        let rising = flat.rising(&dark);
        let tolerance = rough * self.settings.tolerance;
        let first = self
            .lens
            .solve(&illumination, &rising, &mut field, tolerance);
        let parts = Parts {
            illumination: &illumination,
            flat: &flat,
            silicon: &silicon,
            direction: [u, v],
        };
        let one = |&shift| self.under_shift(&parts, shift, &first, &field);
        Ok(shifts_um.iter().map(one).collect())
    }

    /// Light from (u, v) as it comes down onto silicon without trenches, under a centred lens.
    pub(super) fn falling(&self, u: f64, v: f64) -> Result<Falling, StackError> {
        let orders = self.orders(self.bloch(u, v)?);
        let flat = FlatStack::new(&self.flat, self.surface.silicon, self.k0, &orders);
        let illumination = self.illumination(&orders, &flat);
        let dark = vec![C::ZERO; orders.len()];
        let rising = flat.rising(&dark);
        let tolerance = self.settings.tolerance;
        let field = self
            .lens
            .solve(&illumination, &rising, &mut Vec::new(), tolerance);
        let (down, entering) = flat.descend(&field.at_bottom, &rising, &dark);
        let budget = self.budget(&illumination, &field, entering, [u, v]);
        Ok(Falling {
            residual: field.residual,
            orders,
            down,
            budget,
        })
    }

    /// A plane wave from above, flat layers on plain silicon below.
    fn illumination<'a>(&self, orders: &'a [Order], flat: &'a FlatStack) -> Illumination<'a> {
        Illumination {
            orders,
            incident: orders
                .iter()
                .position(|o| o.a == 0 && o.b == 0)
                .unwrap_or(0),
            resin: self.flat.lens,
            stack: &flat.seen,
        }
    }

    /// Bloch wavevector, 1/µm.
    fn bloch(&self, u: f64, v: f64) -> Result<[f64; 2], StackError> {
        let sine_squared = u * u + v * v;
        if sine_squared.is_nan() || sine_squared >= 1.0 {
            return Err(StackError::value(
                "(u, v)",
                format!("({u}, {v})"),
                "u² + v² < 1",
            ));
        }
        Ok([u * self.k0, v * self.k0])
    }

    /// The powers under a shifted lens; `first` is the field that leaves the lens before any light came back from the
    /// trenches.
    fn under_shift(
        &self,
        parts: &Parts,
        shift_um: [f64; 2],
        first: &LensField,
        field: &[Complex32],
    ) -> Light {
        let Parts {
            illumination,
            flat,
            silicon,
            ..
        } = parts;
        let orders = illumination.orders;
        let g = 2.0 * std::f64::consts::PI / self.stack.pitch_um;
        let phases: Vec<C> = orders
            .iter()
            .map(|o| C::cis(-g * (o.a as f64 * shift_um[0] + o.b as f64 * shift_um[1])))
            .collect();
        let seen_by_silicon =
            |down: &[C]| -> Vec<C> { down.iter().zip(&phases).map(|(d, p)| d * p).collect() };
        let mut extra = vec![C::ZERO; orders.len()];
        let mut rising = flat.rising(&extra);
        let mut below: Option<LensField> = None;
        let mut field = if self.settings.bounces > 0 {
            field.to_vec()
        } else {
            Vec::new()
        };
        for bounce in 1..=self.settings.bounces {
            let (down, _) = {
                let f = below.as_ref().unwrap_or(first);
                flat.descend(&f.at_bottom, &rising, &extra)
            };
            let (_, mut up) = silicon.enter(orders, &seen_by_silicon(&down), MATCHING_TOLERANCE);
            for (up, p) in up.iter_mut().zip(&phases) {
                *up *= p.conj();
            }
            extra = flat.beyond_plain(&down, &up);
            rising = flat.rising(&extra);
            let last = bounce == self.settings.bounces;
            let tolerance = if last { 1.0 } else { 5.0 } * self.settings.tolerance;
            below = Some(
                self.lens
                    .solve(illumination, &rising, &mut field, tolerance),
            );
        }
        let f = below.as_ref().unwrap_or(first);
        let (down, entering) = flat.descend(&f.at_bottom, &rising, &extra);
        let (modes, _) = silicon.enter(orders, &seen_by_silicon(&down), MATCHING_TOLERANCE);

        self.powers(parts, f, entering, &modes)
    }

    /// The powers of the field of the lens, of the flux entering the layers and of the modes in the silicon.
    fn powers(&self, parts: &Parts, f: &LensField, entering: f64, modes: &[C]) -> Light {
        let Parts {
            illumination,
            silicon,
            ..
        } = parts;
        let Budget {
            incoming,
            entering,
            balance,
            scale,
        } = self.budget(illumination, f, entering, parts.direction);
        let scale_below = scale / incoming;
        // Each is a sum of its own over a field that is not exact, so one may be more than what it is a part of.
        let (into_silicon, found) = at_most(scale_below * silicon.flux(modes), scale * entering);
        let kept = scale_below / (1.0 + found);
        // Without isolation all that is not absorbed passes below.
        let below = match self.stack.is_isolated() {
            true => kept * silicon.flux_below(modes, self.stack.silicon_um),
            false => 0.0,
        };
        let planes = self.settings.absorption_planes;
        let mut absorbed = silicon.absorbed(modes, self.stack.silicon_um, planes);
        let (in_all, found_below) = at_most(
            kept * absorbed.iter().sum::<f64>(),
            (into_silicon - below).max(0.0),
        );
        for a in &mut absorbed {
            *a *= kept / (1.0 + found_below);
        }
        let transmitted = match self.stack.is_isolated() {
            true => below,
            false => into_silicon - in_all,
        };
        Light {
            mean: Powers {
                transmitted,
                absorbed,
                reflected: 1.0 - scale * entering,
                elsewhere: scale * entering - in_all - transmitted,
                ..Powers::default()
            },
            imbalance: largest([balance - 1.0, found, found_below]),
            residual: f.residual,
            ..Light::default()
        }
    }

    fn budget(
        &self,
        illumination: &Illumination,
        f: &LensField,
        entering: f64,
        direction: [f64; 2],
    ) -> Budget {
        let pixel = (&self.stack, self.flat.lens, self.k0);
        Budget::new(pixel, illumination, f, entering, direction)
    }

    fn orders(&self, bloch: [f64; 2]) -> Vec<Order> {
        orders_within(self.cutoff, self.k0, self.stack.pitch_um, bloch)
    }
}

impl PixelSolver for WaveModel {
    fn stack(&self) -> &PixelStack {
        &self.stack
    }

    fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelength_nm
    }

    fn light(
        &self,
        waves: &[Incidence],
        _: usize,
        _: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError> {
        by_direction(waves, |[u, v], shifts_um| {
            Ok(self.solve_shifts(u, v, shifts_um)?)
        })
    }
}

/// The next FFT length ≥ n of the form 2^k or 3 · 2^k, which have the fastest kernels.
fn fast_length(n: usize) -> usize {
    let two = n.next_power_of_two();
    let three = 3 * n.div_ceil(3).next_power_of_two();
    two.min(three)
}
