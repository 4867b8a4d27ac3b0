//! The `wave` level: scalar waves through the whole pixel, with absorption per sub-pixel.
//!
//! ```text
//!   plane wave (u, v)
//!   ─────────────────  lens.rs     full scalar field in the lens by FFT (Lippmann-Schwinger), reflections included
//!   ─────────────────  planar.rs   resin, filter, oxide: each plane-wave order through the flat stack (transfer matrix)
//!   █│████│████│█████  silicon.rs  modes of the trenched silicon; absorption of each photodiode
//! ```
//! Bloch-periodic: neighbours' light is in it. One scalar run stands for the mean of both polarizations: interfaces
//! reflect the mean power of s and p. Against the vector solution this leaves the errors that `tests/response` states.
//! After Brenner & Singer, Appl. Opt. 32, 4984 (1993) in spirit (FFT propagation through a microlens); the volume equation keeps what
//! a one-way method loses.

mod krylov;
mod lens;
mod modes;
mod planar;
mod settings;
mod silicon;
mod surface;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use rustfft::num_complex::Complex64;

pub use settings::WaveSettings;

use self::lens::{LensRegion, Order};
use self::modes::{AxisModes, Trenches};
use self::planar::{Layers, kz, reflection};
use self::silicon::Silicon;
use super::stack::Indices;
use super::{PixelStack, StackError};

type C = Complex64;

/// Name and version of the model: part of every table's key, so a change of the physics changes the key.
pub const MODEL: &str = "wave-1";

/// Where the light of one plane wave goes, as parts of the incident power.
#[derive(Clone, Debug, PartialEq)]
pub struct WavePowers {
    /// Absorbed per sub-pixel (see [`crate::sensor::Subpixels`] for the order).
    pub absorbed: Vec<f64>,
    /// Reflected into all orders in air.
    pub reflected: f64,
    /// Absorbed in the colour filter.
    pub filter: f64,
    /// Entering the silicon.
    pub into_silicon: f64,
    /// What was missing (< 0) or too much (> 0) before the powers were scaled to a sum of one.
    pub imbalance: f64,
    /// Relative residual of the lens field.
    pub residual: f64,
}

/// A pixel at one wavelength, ready to be lit from any direction.
pub struct WaveModel {
    stack: PixelStack,
    settings: WaveSettings,
    n: Indices,
    k0: f64,
    lens: LensRegion,
    /// Modes by Bloch wavenumber (bits) and axis: angles on a grid share them.
    modes: Mutex<HashMap<(u64, usize), Arc<AxisModes>>>,
}

impl WaveModel {
    /// Checks pixel, settings and wavelength.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &WaveSettings,
    ) -> Result<Self, StackError> {
        stack.check()?;
        settings.check()?;
        let n = stack.indices(wavelength_nm)?;
        let k0 = 2.0 * std::f64::consts::PI / (wavelength_nm * 1e-3);
        let reach = settings.order_cutoff * k0 * stack.pitch_um / (2.0 * std::f64::consts::PI);
        let grid = smooth_size((2.5 * reach).ceil() as usize + 2);
        let lens = LensRegion::new(stack, &n, k0, settings.slice_nm * 1e-3, grid);
        Ok(Self {
            stack: stack.clone(),
            settings: *settings,
            n,
            k0,
            lens,
            modes: Mutex::new(HashMap::new()),
        })
    }

    /// Where the light of a plane wave of direction cosines (u, v) goes. Needs u² + v² < 1.
    pub fn solve(&self, u: f64, v: f64) -> Result<WavePowers, StackError> {
        if !(u * u + v * v < 1.0) {
            return Err(StackError::value(
                "(u, v)",
                format!("({u}, {v})"),
                "u² + v² < 1",
            ));
        }
        let bloch = [u * self.k0, v * self.k0];
        let orders = self.orders(bloch);
        let incident = orders
            .iter()
            .position(|o| o.a == 0 && o.b == 0)
            .unwrap_or(0);
        let (n, k0) = (&self.n, self.k0);
        let resin_um =
            self.stack.planarization_um + self.stack.lens.height_um - self.stack.sag_um();
        let layers: Vec<Layers> = orders
            .iter()
            .map(|o| {
                Layers::new(
                    n,
                    resin_um,
                    self.stack.filter_um,
                    self.stack.oxide_um,
                    k0,
                    o.k_perp_squared,
                )
            })
            .collect();
        // The lens sees plain silicon; what the trenches send back otherwise is added as a source, `bounces` times.
        let plain: Vec<C> = orders
            .iter()
            .map(|o| reflection(n.oxide, n.silicon, k0, o.k_perp_squared))
            .collect();
        let seen: Vec<C> = layers
            .iter()
            .zip(&plain)
            .map(|(l, &r)| l.top + l.through * l.through * r / (1.0 - l.bottom * r))
            .collect();
        let root: Vec<C> = orders
            .iter()
            .map(|o| kz(n.resin, k0, o.k_perp_squared).sqrt())
            .collect();
        let silicon = Silicon::new(
            *n,
            k0,
            self.stack.pitch_um,
            bloch,
            self.axis_modes(bloch[0], self.stack.subpixels.m()),
            self.axis_modes(bloch[1], self.stack.subpixels.n()),
        );
        let mut extra = vec![C::ZERO; orders.len()];
        let mut field = Vec::new();
        let mut bounce = 0;
        loop {
            let rising: Vec<C> = (0..orders.len())
                .map(|i| {
                    layers[i].through * extra[i] / (1.0 - layers[i].bottom * plain[i]) / root[i]
                })
                .collect();
            // Passes before the last only find what the trenches throw back, a few per cent: a rough field is enough.
            let last = bounce == self.settings.bounces;
            let tolerance = if last {
                self.settings.tolerance
            } else {
                5.0 * self.settings.tolerance
            };
            let f = self.lens.solve(
                &orders, incident, n.resin, &seen, &rising, &mut field, tolerance,
            );
            let mut down = Vec::with_capacity(orders.len());
            let mut resin_flux = 0.0;
            for i in 0..orders.len() {
                let d = (f.at_bottom[i] - rising[i]) / (1.0 + seen[i]);
                let u = f.at_bottom[i] - d;
                let k = root[i] * root[i];
                // Net flux Im(ψ* ∂z ψ) of both waves, evanescent pairs included.
                resin_flux += ((d + u).conj() * (d - u) * k).re;
                let l = &layers[i];
                down.push(
                    (l.through * d * root[i] + l.bottom * extra[i]) / (1.0 - l.bottom * plain[i]),
                );
            }
            let (c, up) = silicon.enter(&orders, &down, 1e-4);
            if !last {
                for i in 0..orders.len() {
                    extra[i] = up[i] - plain[i] * down[i];
                }
                bounce += 1;
                continue;
            }
            let air = |i: usize| kz(C::ONE, k0, orders[i].k_perp_squared).re;
            let power = air(incident);
            let reflected = (0..orders.len())
                .map(|i| {
                    let back = f.at_top[i] - if i == incident { C::ONE } else { C::ZERO };
                    air(i) * back.norm_sqr()
                })
                .sum::<f64>()
                / power;
            let into_silicon = silicon.flux(&c, 0.0) / power;
            let mut absorbed =
                silicon.absorbed(&c, self.stack.silicon_um, self.settings.absorption_planes);
            let resin_flux = resin_flux / power;
            // Reflected and entering light add up to one but for the slices and the residual; the powers are scaled so that they do.
            let found = reflected + resin_flux;
            // The scalar field was reflected by the lens as s light is; the mean of s and p loses less.
            let gain = surface::transmission_gain(&self.stack, n.resin.re, u, v);
            let scale = gain / found;
            for a in &mut absorbed {
                *a *= scale / power;
            }
            return Ok(WavePowers {
                absorbed,
                reflected: 1.0 - resin_flux * scale,
                filter: (resin_flux - into_silicon) * scale,
                into_silicon: into_silicon * scale,
                imbalance: found - 1.0,
                residual: f.residual,
            });
        }
    }

    fn orders(&self, bloch: [f64; 2]) -> Vec<Order> {
        let g = 2.0 * std::f64::consts::PI / self.stack.pitch_um;
        let most = self.settings.order_cutoff * self.k0;
        let reach = (most / g).ceil() as i64 + 1 + (self.k0 / g).ceil() as i64;
        let mut orders = Vec::new();
        for a in -reach..=reach {
            for b in -reach..=reach {
                let (kx, ky) = (bloch[0] + g * a as f64, bloch[1] + g * b as f64);
                let k_perp_squared = kx * kx + ky * ky;
                if k_perp_squared <= most * most {
                    orders.push(Order {
                        a,
                        b,
                        k_perp_squared,
                    });
                }
            }
        }
        orders
    }

    fn axis_modes(&self, bloch: f64, parts: usize) -> Arc<AxisModes> {
        let key = (bloch.to_bits(), parts);
        // A poisoned lock only means that another thread stopped; the map is whole between insertions.
        if let Some(found) = self
            .modes
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&key)
        {
            return Arc::clone(found);
        }
        let (si, ox) = (self.n.silicon, self.n.oxide);
        let trenches = Trenches {
            pitch_um: self.stack.pitch_um,
            width_um: self.stack.trench_um,
            parts,
            barrier: self.k0 * self.k0 * ((si * si).re - (ox * ox).re),
        };
        let made = Arc::new(AxisModes::new(
            &trenches,
            bloch,
            self.settings.silicon_cutoff * si.re * self.k0,
            si.re * self.k0,
        ));
        self.modes
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .insert(key, Arc::clone(&made));
        made
    }
}

/// The next number ≥ n whose only prime factors are 2, 3 and 5, even.
fn smooth_size(n: usize) -> usize {
    let mut size = n + n % 2;
    loop {
        let mut rest = size;
        for f in [2, 3, 5] {
            while rest % f == 0 {
                rest /= f;
            }
        }
        if rest == 1 {
            return size;
        }
        size += 2;
    }
}
