//! The potential V of a lens in its slices: of the strength that keeps the phase exact in uniform media.

use super::C;
use crate::em::PixelStack;

/// Sub-samples per side over which the surface height is averaged in a grid cell.
const SUPERSAMPLING: usize = 4;

/// V of each of so many slices, `[slice][y][x]`, of a lens of permittivity `eps` on a grid.
pub(super) fn of_slices(
    stack: &PixelStack,
    [eps, background]: [C; 2],
    k0: f64,
    slices: usize,
    grid: usize,
) -> Vec<C> {
    let dz = stack.sag_um() / slices as f64;
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
    potential
}

/// The strength that makes the sum over slices of Δz carry a wave through a uniform medium with its exact phase. From
/// `ψ₊ + ψ₋ = 2 cos(kΔz) ψ`: `V = 2 k_b (cos k_b Δz − cos k Δz) / (Δz sin k_b Δz)`, here for k⊥ = k0 / 2.
fn sampled_potential(eps: C, background: C, k0: f64, dz: f64) -> C {
    let kb = (background - 0.25).sqrt() * k0;
    let k = (eps - 0.25).sqrt() * k0;
    2.0 * kb * ((kb * dz).cos() - (k * dz).cos()) / (dz * (kb * dz).sin())
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
