//! Light enters the silicon between the trenches and is absorbed there.
//!
//! The field at the top of the silicon is continuous with its z derivative: for the wave ψ_d that comes down in the
//! last layer `(β + Bᵀ Y B) c = 2 Bᵀ Y ψ_d`, with c the mode amplitudes, B the Fourier orders of the modes
//! ([`super::modes`]), β their propagation constants, and Y the admittance of that layer, chosen per order so that onto
//! plain silicon it reflects the mean power of s and p. Below, `E = Σ c e^(iβz) φ_i(x) φ_j(y)`, and sub-pixel (a, b)
//! collects `k0² Im ε ∫ |E|²` over its own silicon (trenches absorb nothing, isolation collects nothing).

use std::sync::Arc;

use rustfft::num_complex::Complex64;

use super::absorption::Falling;
use super::krylov::{System, gmres};
use super::modes::AxisModes;
use super::planar::{kz, reflection};
use super::spectral::Order;

type C = Complex64;

/// Indices on both sides of the silicon's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    /// Of the last layer.
    pub above: C,
    pub silicon: C,
}

/// The silicon at one angle.
pub(super) struct Silicon {
    n: Surface,
    k0: f64,
    x: Arc<AxisModes>,
    y: Arc<AxisModes>,
    /// Admittance of the last layer per Fourier order, [a][b].
    admittance: Vec<C>,
    /// β of the modes, [i][j].
    beta: Vec<C>,
}

impl Silicon {
    pub fn new(
        n: Surface,
        k0: f64,
        pitch_um: f64,
        bloch: [f64; 2],
        [x, y]: [Arc<AxisModes>; 2],
    ) -> Self {
        let g = 2.0 * std::f64::consts::PI / pitch_um;
        let eps = n.silicon * n.silicon;
        let mut admittance = Vec::with_capacity(x.count * y.count);
        let mut beta = Vec::with_capacity(x.count * y.count);
        let share = |m: &AxisModes, i: usize| -> f64 {
            // Modes not kept carry next to nothing; they take the loss of plain silicon.
            m.in_silicon.get(i).copied().unwrap_or(1.0)
        };
        for i in 0..x.count {
            for j in 0..y.count {
                let kx = bloch[0] + g * (x.first + i as i64) as f64;
                let ky = bloch[1] + g * (y.first + j as i64) as f64;
                admittance.push(admittance_above(&n, k0, kx * kx + ky * ky));
                let loss = eps.im * share(&x, i) * share(&y, j);
                let b = C::new(k0 * k0 * eps.re + x.lambda[i] + y.lambda[j], k0 * k0 * loss).sqrt();
                beta.push(b);
            }
        }
        Self {
            n,
            k0,
            x,
            y,
            admittance,
            beta,
        }
    }

    /// Mode amplitudes for the power amplitudes `down` of `orders` in the last layer, and what goes back up into those
    /// orders.
    pub fn enter(&self, orders: &[Order], down: &[C], tolerance: f64) -> (Vec<C>, Vec<C>) {
        let (nx, ny) = (self.x.count, self.y.count);
        let place = |o: &Order| {
            let (a, b) = (o.a - self.x.first, o.b - self.y.first);
            let inside = (0..nx as i64).contains(&a) && (0..ny as i64).contains(&b);
            inside.then(|| a as usize * ny + b as usize)
        };
        let mut source = vec![C::ZERO; nx * ny];
        for (o, &d) in orders.iter().zip(down) {
            if let Some(at) = place(o) {
                source[at] = 2.0 * self.admittance[at].sqrt() * d;
            }
        }
        let mut right = vec![C::ZERO; nx * ny];
        let mut half = vec![C::ZERO; nx * ny];
        self.modes_from_orders(&source, &mut right, &mut half);
        let mut matching = Matching {
            silicon: self,
            plain: (0..nx * ny)
                .map(|m| {
                    let k2 = -(self.x.lambda[m / ny] + self.y.lambda[m % ny]).min(0.0);
                    self.beta[m] + admittance_above(&self.n, self.k0, k2)
                })
                .collect(),
            grid: vec![C::ZERO; nx * ny],
            half,
        };
        let mut c = vec![C::ZERO; nx * ny];
        gmres(&mut matching, &right, &mut c, tolerance, 60);
        let Matching {
            mut grid, mut half, ..
        } = matching;
        self.orders_from_modes(&c, &mut grid, &mut half);
        let up = orders
            .iter()
            .zip(down)
            .map(|(o, &d)| match place(o) {
                Some(at) => grid[at] * self.admittance[at].sqrt() - d,
                None => C::ZERO,
            })
            .collect();
        (c, up)
    }

    /// Flux that the modes take into the silicon.
    pub fn flux(&self, c: &[C]) -> f64 {
        c.iter()
            .zip(&self.beta)
            .map(|(c, b)| b.re * c.norm_sqr())
            .sum()
    }

    /// Flux of the modes below the first `depth_um`.
    pub fn flux_below(&self, c: &[C], depth_um: f64) -> f64 {
        let left = |b: &C| (-2.0 * b.im * depth_um).exp();
        let both = c.iter().zip(&self.beta);
        both.map(|(c, b)| b.re * c.norm_sqr() * left(b)).sum()
    }

    /// Power absorbed per sub-pixel (row-major, rows along y) in the first `depth_um`, by the mid-point rule on
    /// `planes` planes.
    pub fn absorbed(&self, c: &[C], depth_um: f64, planes: usize) -> Vec<f64> {
        let (kx, ky, ny) = (self.x.absorbing, self.y.absorbing, self.y.count);
        let dz = depth_um / planes as f64;
        let kept = (0..kx).flat_map(|i| (0..ky).map(move |j| i * ny + j));
        let upper = kept.clone().map(|m| {
            let half = (C::I * self.beta[m] * (0.5 * dz)).exp();
            c[m] * half
        });
        let step = kept.map(|m| (C::I * self.beta[m] * dz).exp());
        let falling = Falling {
            size: [kx, ky],
            upper: upper.collect(),
            step: step.collect(),
            planes,
        };
        let mut absorbed = falling.sums(&self.x.overlap, &self.y.overlap);
        let eps = self.n.silicon * self.n.silicon;
        for a in &mut absorbed {
            *a *= self.k0 * self.k0 * eps.im * dz;
        }
        absorbed
    }

    /// Bᵀ · orders · B along both axes; real matrices.
    fn modes_from_orders(&self, orders: &[C], modes: &mut [C], half: &mut [C]) {
        let (nx, ny) = (self.x.count, self.y.count);
        half.fill(C::ZERO);
        for a in 0..nx {
            let source = &orders[a * ny..(a + 1) * ny];
            if source.iter().all(|s| *s == C::ZERO) {
                continue;
            }
            for i in 0..nx {
                let w = self.x.amplitude[a * nx + i];
                for (h, s) in half[i * ny..(i + 1) * ny].iter_mut().zip(source) {
                    *h += s * w;
                }
            }
        }
        modes.fill(C::ZERO);
        for i in 0..nx {
            let row = &mut modes[i * ny..(i + 1) * ny];
            for b in 0..ny {
                let h = half[i * ny + b];
                for (m, w) in row.iter_mut().zip(&self.y.amplitude[b * ny..(b + 1) * ny]) {
                    *m += h * w;
                }
            }
        }
    }

    /// B · modes · Bᵀ along both axes.
    fn orders_from_modes(&self, modes: &[C], orders: &mut [C], half: &mut [C]) {
        let (nx, ny) = (self.x.count, self.y.count);
        half.fill(C::ZERO);
        for a in 0..nx {
            let row = &mut half[a * ny..(a + 1) * ny];
            for i in 0..nx {
                let w = self.x.amplitude[a * nx + i];
                for (h, m) in row.iter_mut().zip(&modes[i * ny..(i + 1) * ny]) {
                    *h += m * w;
                }
            }
        }
        for a in 0..nx {
            let source = &half[a * ny..(a + 1) * ny];
            for b in 0..ny {
                let w = &self.y.amplitude[b * ny..(b + 1) * ny];
                orders[a * ny + b] = source.iter().zip(w).map(|(h, &w)| h * w).sum();
            }
        }
    }
}

/// (β + Bᵀ Y B) c, preconditioned by the same sum for modes taken as single orders.
struct Matching<'a> {
    silicon: &'a Silicon,
    plain: Vec<C>,
    grid: Vec<C>,
    half: Vec<C>,
}

impl System<f64> for Matching<'_> {
    fn apply(&mut self, x: &[C], y: &mut [C]) {
        let s = self.silicon;
        s.orders_from_modes(x, &mut self.grid, &mut self.half);
        for (g, a) in self.grid.iter_mut().zip(&s.admittance) {
            *g *= a;
        }
        s.modes_from_orders(&self.grid, y, &mut self.half);
        for ((y, x), b) in y.iter_mut().zip(x).zip(&s.beta) {
            *y += b * x;
        }
    }
    fn precondition(&mut self, x: &[C], y: &mut [C]) {
        for ((y, x), p) in y.iter_mut().zip(x).zip(&self.plain) {
            *y = x / p;
        }
    }
}

fn admittance_above(n: &Surface, k0: f64, k_perp_squared: f64) -> C {
    let r = reflection(n.above, n.silicon, k0, k_perp_squared);
    kz(n.silicon, k0, k_perp_squared) * (1.0 + r) / (1.0 - r)
}
