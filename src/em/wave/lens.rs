//! The field in the lens, reflections and all: the Lippmann-Schwinger equation of the scalar wave equation,
//!
//! `(∂z² + ∇⊥² + k0² ε) ψ = 0`,  `ψ = ψ_b + ∫ G V ψ dz`,  `V = k0² (ε − ε_b)`,
//!
//! by FFT in the plane and plane-wave orders in depth. ε_b is a uniform background that fills the region from the apex
//! (z = 0) to the lens's lowest point (z = D), with air above and the flat stack below. For an order of wavenumber k in
//! the background, `G(z, z') = (i/2k) e^(ik|z−z'|)` and what the two ends throw back (r_t at z = 0, r_b at z = D), so
//! every round trip between silicon, stack and lens is in it. Applying G costs one sweep down and one up.
//!
//! Slices are Δz thick with V at half height, of the strength that keeps the phase exact in uniform media
//! ([`sampled_potential`]). Solved by GMRES, preconditioned with beam propagation.

use rustfft::num_complex::{Complex32, Complex64};

use super::krylov::{System, gmres};
use super::planar::kz;
use super::spectral::{Order, Product, Transforms};
use crate::em::PixelStack;

type C = Complex64;
/// The field inside the region is f32: it is solved to 1e-2 or 1e-3, and the solver is bound by memory.
type S = Complex32;

/// Sub-samples per side over which the surface height is averaged in a grid cell.
const SUPERSAMPLING: usize = 4;
/// GMRES steps after which the residual is taken as it is.
const MOST_STEPS: usize = 150;

/// The lens region of one pixel at one wavelength (independent of the angle).
pub(super) struct LensRegion {
    k0: f64,
    background: C,
    depth_um: f64,
    slices: usize,
    /// V for the sum over slices, `[slice][y][x]`; x = index × pitch / grid from the lens's centre.
    potential: Vec<S>,
    /// e^(iVΔz/2k) − 1 with k of the background, for the rough inverse.
    screen: Vec<S>,
    fft: Transforms,
}

/// What lights the lens, and what lies below it.
pub(super) struct Illumination<'a> {
    pub orders: &'a [Order],
    /// The order in which light of unit amplitude falls in.
    pub incident: usize,
    /// Index of the medium below.
    pub resin: C,
    /// What the layers below reflect, per order, seen in the resin at z = D.
    pub stack: &'a [C],
}

/// The field at the ends of the lens region, per order.
pub(super) struct LensField {
    pub at_top: Vec<C>,
    pub at_bottom: Vec<C>,
    /// Relative residual of the solution.
    pub residual: f64,
}

impl LensRegion {
    pub fn new(stack: &PixelStack, n: C, k0: f64, slice_um: f64, grid: usize) -> Self {
        let depth_um = stack.sag_um();
        let slices = ((depth_um / slice_um).ceil() as usize).max(1);
        let dz = depth_um / slices as f64;
        let eps = n * n;
        // Any background gives the same field. One with loss (V takes it out again) lets no light run round in the
        // region between solver steps, which quarters their number; more than this needs thinner slices.
        let background = 1.0 + (eps - 1.0) * 0.75 + C::new(0.0, 1.0);
        let surface = surface_depth(stack, grid * SUPERSAMPLING);
        let fine = grid * SUPERSAMPLING;
        let mut potential: Vec<C> = Vec::with_capacity(slices * grid * grid);
        for slice in 0..slices {
            let top = slice as f64 * dz;
            for y in 0..grid {
                for x in 0..grid {
                    let mut fill = 0.0;
                    for j in 0..SUPERSAMPLING {
                        for i in 0..SUPERSAMPLING {
                            // Sub-samples lie around the grid point, not beside it.
                            let place = |g: usize, s: usize| {
                                (g * SUPERSAMPLING + s + fine - SUPERSAMPLING / 2) % fine
                            };
                            let z = surface[place(y, j) * fine + place(x, i)];
                            fill += ((top + dz - z) / dz).clamp(0.0, 1.0);
                        }
                    }
                    fill /= (SUPERSAMPLING * SUPERSAMPLING) as f64;
                    let here = 1.0 + (eps - 1.0) * fill;
                    potential.push(sampled_potential(here, background, k0, dz));
                }
            }
        }
        Self {
            k0,
            background,
            depth_um,
            slices,
            fft: Transforms::new(grid),
            screen: potential
                .iter()
                .map(|v| single((C::I * v * dz / (2.0 * k0 * background.sqrt())).exp() - 1.0))
                .collect(),
            potential: potential.into_iter().map(single).collect(),
        }
    }

    /// The field under `illumination`, with waves `upward` (amplitude ψ in the resin at z = D) from below. `field` is
    /// the start and the result, as orders of every slice; empty for no start.
    pub fn solve(
        &self,
        illumination: &Illumination,
        upward: &[C],
        field: &mut Vec<S>,
        tolerance: f64,
    ) -> LensField {
        let orders = illumination.orders;
        let ends: Vec<Ends> = orders
            .iter()
            .zip(illumination.stack)
            .map(|(o, &r)| self.ends(o, illumination.resin, r))
            .collect();
        let count = orders.len();
        let mut start = vec![S::ZERO; self.slices * count];
        let dz = self.depth_um / self.slices as f64;
        let (mut from_top, mut from_bottom) = (vec![C::ZERO; count], vec![C::ZERO; count]);
        for (i, e) in ends.iter().enumerate() {
            let enters = if i == illumination.incident {
                e.enters
            } else {
                C::ZERO
            };
            let rises = upward[i] * e.rises;
            // Waves launched at either end, all round trips between them.
            let (top, bottom, across) = (double(e.top), double(e.bottom), double(e.across));
            let down = (enters + top * across * rises) * double(e.loops);
            let up = rises + bottom * across * down;
            (from_top[i], from_bottom[i]) = (down, up);
            for j in 0..self.slices {
                let z = (j as f64 + 0.5) * dz;
                start[j * count + i] = single(
                    down * (C::I * e.k * z).exp() + up * (C::I * e.k * (self.depth_um - z)).exp(),
                );
            }
        }
        if field.len() != start.len() {
            field.clone_from(&start);
        }
        let mut system = Scattering {
            work: Work::new(self, orders),
            ends: &ends,
        };
        let residual = gmres(&mut system, &start, field, tolerance, MOST_STEPS);
        let mut work = system.work;
        let mut scattered = vec![S::ZERO; start.len()];
        self.scatter(&mut work, &ends, field, &mut scattered);
        let mut at_top = Vec::with_capacity(count);
        let mut at_bottom = Vec::with_capacity(count);
        for (i, e) in ends.iter().enumerate() {
            let (down, up) = (
                from_top[i] + double(work.launched_down[i]),
                from_bottom[i] + double(work.launched_up[i]),
            );
            at_top.push(down + double(work.up[i]) + double(e.across) * up);
            at_bottom.push(double(e.across) * down + double(work.down[i]) + up);
        }
        LensField {
            at_top,
            at_bottom,
            residual,
        }
    }

    fn ends(&self, order: &Order, resin: C, stack: C) -> Ends {
        let air = kz(C::ONE, self.k0, order.k_perp_squared);
        let k = kz(self.background.sqrt(), self.k0, order.k_perp_squared);
        let below = kz(resin, self.k0, order.k_perp_squared);
        let top = (k - air) / (k + air);
        let step = (k - below) / (k + below);
        let bottom = (step + stack) / (1.0 + step * stack);
        let across = (C::I * k * self.depth_um).exp();
        let dz = self.depth_um / self.slices as f64;
        let ratio = self.background.sqrt() * self.k0 / k;
        Ends {
            strength: single(C::I * dz / (2.0 * k)),
            step: single((C::I * k * dz).exp()),
            half_step: single((C::I * k * (0.5 * dz)).exp()),
            obliquity: single(ratio * (2.0 / ratio.norm()).min(1.0)),
            k,
            top: single(top),
            bottom: single(bottom),
            across: single(across),
            loops: single(1.0 / (1.0 - top * bottom * across * across)),
            enters: 2.0 * air / (air + k),
            rises: 2.0 * below / ((below + k) * (1.0 + step * stack)),
        }
    }

    /// What the sources `x` become on their way, down and up, when nothing is reflected: each slice is a thin phase
    /// screen (beam propagation). The rough inverse that takes the forward scattering off the solver.
    fn one_way(&self, work: &mut Work, ends: &[Ends], x: &[S], out: &mut [S]) {
        let count = ends.len();
        let cells = self.fft.grid * self.fft.grid;
        out.copy_from_slice(x);
        let mut total = std::mem::take(&mut work.falling);
        let mut scattered = std::mem::take(&mut work.rising);
        work.down.fill(S::ZERO);
        for upward in [false, true] {
            if upward {
                // Half a slice past the last plane and half a slice back: what comes down, reflected, at the last
                // plane.
                for (d, e) in work.down.iter_mut().zip(ends) {
                    *d *= e.bottom;
                }
            }
            for turn in 0..self.slices {
                let j = if upward { self.slices - 1 - turn } else { turn };
                let slice = j * count..(j + 1) * count;
                for i in 0..count {
                    total[i] = x[slice.start + i] + work.down[i];
                }
                for (o, d) in out[slice].iter_mut().zip(&work.down) {
                    *o += d;
                }
                work.product.multiply(
                    &self.screen[j * cells..(j + 1) * cells],
                    &total,
                    &mut scattered,
                );
                for i in 0..count {
                    work.down[i] = ends[i].step * (work.down[i] + ends[i].obliquity * scattered[i]);
                }
            }
        }
        work.falling = total;
        work.rising = scattered;
    }

    /// out = ∫ G V x dz at the slices; leaves in `work` what reaches the ends and what they launch.
    fn scatter(&self, work: &mut Work, ends: &[Ends], x: &[S], out: &mut [S]) {
        let count = ends.len();
        let cells = self.fft.grid * self.fft.grid;
        for j in 0..self.slices {
            let slice = j * count..(j + 1) * count;
            work.product.multiply(
                &self.potential[j * cells..(j + 1) * cells],
                &x[slice.clone()],
                &mut out[slice],
            );
        }
        work.down.fill(S::ZERO);
        work.up.fill(S::ZERO);
        for j in 0..self.slices {
            let (out, sources) = (
                &mut out[j * count..(j + 1) * count],
                &mut work.sources[j * count..(j + 1) * count],
            );
            for i in 0..count {
                let s = out[i] * ends[i].strength;
                sources[i] = s;
                work.down[i] = work.down[i] * ends[i].step + s;
                out[i] = work.down[i];
            }
        }
        for j in (0..self.slices).rev() {
            let (out, sources) = (
                &mut out[j * count..(j + 1) * count],
                &work.sources[j * count..(j + 1) * count],
            );
            for i in 0..count {
                let above = work.up[i] * ends[i].step;
                out[i] += above;
                work.up[i] = above + sources[i];
            }
        }
        for (i, e) in ends.iter().enumerate() {
            work.down[i] *= e.half_step;
            work.up[i] *= e.half_step;
            let (a, b) = (work.down[i], work.up[i]);
            let down = e.top * (b + e.across * e.bottom * a) * e.loops;
            work.launched_down[i] = down;
            work.launched_up[i] = e.bottom * (a + e.across * down);
            work.falling[i] = down * e.half_step;
            work.rising[i] = work.launched_up[i] * e.half_step;
        }
        for j in 0..self.slices {
            for (i, o) in out[j * count..(j + 1) * count].iter_mut().enumerate() {
                *o += work.falling[i];
                work.falling[i] *= ends[i].step;
            }
        }
        for j in (0..self.slices).rev() {
            for (i, o) in out[j * count..(j + 1) * count].iter_mut().enumerate() {
                *o += work.rising[i];
                work.rising[i] *= ends[i].step;
            }
        }
    }
}

fn single(z: C) -> S {
    S::new(z.re as f32, z.im as f32)
}

fn double(z: S) -> C {
    C::new(f64::from(z.re), f64::from(z.im))
}

/// The strength that makes the sum over slices of Δz carry a wave through a uniform medium with its exact phase. From
/// `ψ₊ + ψ₋ = 2 cos(kΔz) ψ`: `V = 2 k_b (cos k_b Δz − cos k Δz) / (Δz sin k_b Δz)`, here for k⊥ = k0 / 2.
fn sampled_potential(eps: C, background: C, k0: f64, dz: f64) -> C {
    let kb = (background - 0.25).sqrt() * k0;
    let k = (eps - 0.25).sqrt() * k0;
    2.0 * kb * ((kb * dz).cos() - (k * dz).cos()) / (dz * (kb * dz).sin())
}

/// ψ − ∫ G V ψ.
struct Scattering<'a> {
    work: Work<'a>,
    ends: &'a [Ends],
}

impl System<f32> for Scattering<'_> {
    fn apply(&mut self, x: &[S], y: &mut [S]) {
        let region = self.work.region;
        region.scatter(&mut self.work, self.ends, x, y);
        for (y, x) in y.iter_mut().zip(x) {
            *y = x - *y;
        }
    }
    fn precondition(&mut self, x: &[S], y: &mut [S]) {
        let region = self.work.region;
        region.one_way(&mut self.work, self.ends, x, y);
    }
}

/// What an order meets at the two ends of the region.
struct Ends {
    k: C,
    /// (i/2k) Δz: what a source of one slice sends out.
    strength: S,
    /// Phase of a slice and of half of one.
    step: S,
    half_step: S,
    /// Longer way of a steep order through a slice, for the rough inverse; held down near grazing.
    obliquity: S,
    top: S,
    bottom: S,
    across: S,
    loops: S,
    enters: C,
    rises: C,
}

/// Depth of the lens surface below the apex on `fine × fine` points, [y][x] from the lens's centre.
fn surface_depth(stack: &PixelStack, fine: usize) -> Vec<f64> {
    let p = stack.pitch_um;
    let r = stack.lens.radius_um;
    // +½: the points of a grid cell lie symmetrically about its grid point.
    let from_lens = |i: usize| {
        let x = (i as f64 + 0.5) * p / fine as f64;
        x - p * (x / p).round()
    };
    let mut depth = Vec::with_capacity(fine * fine);
    for j in 0..fine {
        let y = from_lens(j);
        for i in 0..fine {
            let x = from_lens(i);
            depth.push(r - (r * r - x * x - y * y).max(0.0).sqrt());
        }
    }
    depth
}

/// Scratch of one solution.
struct Work<'a> {
    region: &'a LensRegion,
    product: Product<'a>,
    sources: Vec<S>,
    down: Vec<S>,
    up: Vec<S>,
    launched_down: Vec<S>,
    launched_up: Vec<S>,
    falling: Vec<S>,
    rising: Vec<S>,
}

impl<'a> Work<'a> {
    fn new(region: &'a LensRegion, orders: &[Order]) -> Self {
        let zeros = |n: usize| vec![S::ZERO; n];
        let n = orders.len();
        Self {
            region,
            product: Product::new(&region.fft, orders),
            sources: zeros(n * region.slices),
            down: zeros(n),
            up: zeros(n),
            launched_down: zeros(n),
            launched_up: zeros(n),
            falling: zeros(n),
            rising: zeros(n),
        }
    }
}
