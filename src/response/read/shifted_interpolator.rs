//! The response under any lens shift, from nodes on a grid of shifts: the renderer's 4D lookup.
//!
//! The lens's field below a lens at s is `Σ ψ_m e^(−i G_m·s)` over its diffraction orders, so at a fixed direction P is
//! a trigonometric polynomial in the shift. Orders that travel in the oxide (n) above the silicon differ by 2 n pitch /
//! λ at most, and so does f: to 8 at 1.6 µm, 14 at 2.8 µm, 18 at 3.5 µm (n = 1.46, 550 nm; beyond, P of the 2.8 µm
//! pixel has 1e-6 of its mean). The Fourier series through the nodes of one period has no error once there are more
//! than twice as many, and no seam anywhere. (Blending two nodes linearly draws the nodes' grid on every sub-aperture
//! image; following the lobe from node to node, [`MovingFrame`], moves the interference along that stands still in (u,
//! v).)
//!
//! When it is made, the series is sampled twice as finely as the nodes (up to 48 a pitch) and turned into coefficients
//! of quadratic B-splines, which a ray reads: 3 × 3 shifts by 2 × 2 directions. (A harmonic of f periods a knot comes
//! back to some 1.4 f³: 16 nodes, third harmonic, 1e-3 of it.) The shifts of one quadrant are kept; a mirrored lens is
//! a mirrored pixel. What a series may fall below 0 or exceed a sum of 1 by is cut. Plain multiplies and adds: the same
//! bits on every CPU.

use super::Interpolator;
use super::axes::Axes;
use crate::em::ShiftGrid;
use crate::sensor::{Charge, MovingFrame, Subpixels, Wandering, by_count};

/// B-spline shifts a ray reads along each axis.
const TAPS: usize = 3;
/// Most spline knots per pitch: there a harmonic keeps 99.6 % at f = 7, and memory goes with their square.
const MOST_KNOTS: usize = 48;

/// P_i(u, v; shift) at one wavelength. Made by [`crate::response::AngularResponse::shifted_interpolator`].
#[derive(Clone, Debug)]
pub struct ShiftedInterpolator {
    subpixels: Subpixels,
    frame: MovingFrame,
    axes: Axes,
    /// Spline knots per pitch, and per µm.
    knots: usize,
    per_um: f64,
    /// Knots stored along each axis, the first at −1.
    stored: usize,
    /// `[shift x][v][u][shift y][sub-pixel]`: what a ray reads lies in few cache lines.
    table: Vec<f32>,
}

/// Of the knot before, the nearest knot, and the one behind, at t = −½ to ½ from the nearest.
fn weights(t: f64) -> [f64; TAPS] {
    let square = |x: f64| x * x;
    [
        0.5 * square(0.5 - t),
        0.75 - square(t),
        0.5 * square(0.5 + t),
    ]
}

/// Rows a, columns b: the part of node b in the B-spline coefficient at knot a − 1, of `stored` knots; `kept`: what
/// charge leaves of a harmonic.
fn coefficients(
    nodes: usize,
    knots: usize,
    stored: usize,
    kept: impl Fn(usize) -> f64,
) -> Vec<f64> {
    let tau = 2.0 * std::f64::consts::PI;
    let mut all = Vec::with_capacity(stored * nodes);
    for a in 0..stored {
        for b in 0..nodes {
            let x = (a as f64 - 1.0) / knots as f64 - b as f64 / nodes as f64;
            let term = |f: usize| {
                let twice = if f == 0 || 2 * f == nodes { 1.0 } else { 2.0 };
                // Splines through samples of cos (f x): their coefficients, divided by what the spline keeps of it.
                let share = (6.0 + 2.0 * (tau * f as f64 / knots as f64).cos()) / 8.0;
                twice * kept(f) * (tau * f as f64 * x).cos() / share
            };
            all.push((0..=nodes / 2).map(term).sum::<f64>() / nodes as f64);
        }
    }
    all
}

impl ShiftedInterpolator {
    /// From `plane(shift node)`, `[v][u][sub-pixel]` at every node of the period, and how far charge wanders.
    pub(super) fn new(
        subpixels: Subpixels,
        frame: MovingFrame,
        axes: Axes,
        (grid, charge, wandering): (&ShiftGrid, &Charge, &Wandering),
        plane: impl Fn([usize; 2]) -> Vec<f32>,
    ) -> Self {
        let nodes = grid.per_pitch;
        let knots = (2 * nodes).min(MOST_KNOTS);
        let stored = knots / 2 + 3;
        let parts = coefficients(nodes, knots, stored, |f| {
            charge.kept(wandering, f, grid.pitch_um)
        });
        let count = subpixels.count();
        let size = axes.nu * axes.nv * count;
        let mut table = vec![0f32; stored * stored * size];
        for i in 0..nodes {
            // Splines along y of this column of nodes, then its part in all splines along x.
            let mut along_y = vec![0f32; stored * size];
            for j in 0..nodes {
                let p = plane([i, j]);
                for b in 0..stored {
                    let part = parts[b * nodes + j] as f32;
                    for (at, p) in p.chunks_exact(count).enumerate() {
                        let out = &mut along_y[(at * stored + b) * count..][..count];
                        for (o, p) in out.iter_mut().zip(p) {
                            *o += part * p;
                        }
                    }
                }
            }
            for a in 0..stored {
                let part = parts[a * nodes + i] as f32;
                let out = &mut table[a * stored * size..][..stored * size];
                for (o, p) in out.iter_mut().zip(&along_y) {
                    *o += part * p;
                }
            }
        }
        Self {
            subpixels,
            frame,
            axes,
            knots,
            per_um: knots as f64 / grid.pitch_um,
            stored,
            table,
        }
    }

    /// Sub-pixels of the pixel.
    pub fn subpixels(&self) -> Subpixels {
        self.subpixels
    }
    /// How a lens shift moves the response, to first order.
    pub fn frame(&self) -> MovingFrame {
        self.frame
    }
    /// Memory that the coefficients take.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(&self.table[..])
    }

    /// The weights of many directions under a lens shifted by `shift_um`: `out` is `[direction][sub-pixel]`. The
    /// shortest of the three slices counts.
    pub fn weights_batch(&self, shift_um: [f64; 2], u: &[f32], v: &[f32], out: &mut [f32]) {
        by_count!(self.subpixels.count(), self.batch(shift_um, u, v, out));
    }

    /// The lookup under one lens shift: a quarter of the reads a ray needs here, and the same values (to the rounding
    /// of f32, but where a ray's sum had to be cut: that is done at the nodes).
    pub fn at_shift(&self, shift_um: [f64; 2]) -> Interpolator {
        let (u, v) = self.axes.cosines();
        let mut plane = vec![0.0; u.len() * self.subpixels.count()];
        self.weights_batch(shift_um, &u, &v, &mut plane);
        Interpolator::new(self.subpixels, self.frame, self.axes.renewed(), plane)
    }

    /// First knot's place, weights, and whether the lens is read mirrored.
    fn taps(&self, shift_um: f64) -> (usize, [f32; TAPS], bool) {
        let period = self.knots as f64;
        let x = (shift_um * self.per_um).rem_euclid(period);
        let mirrored = x > 0.5 * period;
        let x = if mirrored { period - x } else { x };
        // The nearest knot, and one on each side; the first stored is at −1.
        let i = (x + 0.5) as usize;
        (i, weights(x - i as f64).map(|w| w as f32), mirrored)
    }

    #[inline]
    fn batch<const N: usize>(&self, shift_um: [f64; 2], u: &[f32], v: &[f32], out: &mut [f32]) {
        let (first_x, weights_x, mirror_x) = self.taps(shift_um[0]);
        let (first_y, weights_y, mirror_y) = self.taps(shift_um[1]);
        let axes = self.axes;
        let mirrored = |scale: f32, mirror: bool| if mirror { -scale } else { scale };
        let scale = [
            mirrored(axes.scale[0], mirror_x),
            mirrored(axes.scale[1], mirror_y),
        ];
        let s = self.subpixels;
        let sources: [usize; N] = std::array::from_fn(|k| {
            let (c, r) = s.column_row(k);
            let c = if mirror_x { s.m() - 1 - c } else { c };
            let r = if mirror_y { s.n() - 1 - r } else { r };
            s.index(c, r)
        });
        let (nodes, _) = self.table.as_chunks::<N>();
        let (out, _) = out.as_chunks_mut::<N>();
        let row = axes.nu * self.stored;
        let plane = axes.nv * row;
        for ((&u, &v), out) in u.iter().zip(v).zip(out) {
            let cell = axes.cell(scale, u, v);
            let [w00, w10, w01, w11] = cell.weights;
            let corners = [
                (0, w00),
                (self.stored, w10),
                (row, w01),
                (row + self.stored, w11),
            ];
            let at = first_x * plane + cell.j * row + cell.i * self.stored + first_y;
            let mut sums = [[0f32; N]; TAPS];
            for (t, weight) in weights_x.iter().enumerate() {
                for (corner, part) in corners {
                    let w = weight * part;
                    let read = &nodes[at + t * plane + corner..][..TAPS];
                    for (sums, read) in sums.iter_mut().zip(read) {
                        for k in 0..N {
                            sums[k] += w * read[k];
                        }
                    }
                }
            }
            let mut p = [0f32; N];
            for (w, sums) in weights_y.iter().zip(&sums) {
                for k in 0..N {
                    p[k] += w * sums[k];
                }
            }
            let mut sum = 0.0;
            for p in &mut p {
                *p = p.max(0.0);
                sum += *p;
            }
            let whole = if sum > 1.0 { 1.0 / sum } else { 1.0 };
            for (o, &k) in out.iter_mut().zip(&sources) {
                *o = p[k] * whole;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_of_a_fourier_series_give_it_back_between_the_nodes() {
        // cos 3x through 16 nodes per period, read anywhere.
        let (nodes, knots) = (16, 32);
        let stored = knots / 2 + 3;
        let parts = coefficients(nodes, knots, stored, |_| 1.0);
        let tau = 2.0 * std::f64::consts::PI;
        let f = |x: f64| (tau * 3.0 * x).cos();
        let coefficient = |a: usize| -> f64 {
            let node = |b: usize| parts[a * nodes + b] * f(b as f64 / nodes as f64);
            (0..nodes).map(node).sum()
        };
        for x in [0.0, 3.4, 9.5, 14.9, 16.0] {
            let i = (x + 0.5) as usize;
            let w = weights(x - i as f64);
            let found: f64 = (0..TAPS).map(|k| w[k] * coefficient(i + k)).sum();
            let wanted = f(x / f64::from(knots as u32));
            // 1.4 f³ of it at f = 3/32 periods a knot, in the mean; twice that at worst.
            assert!((found - wanted).abs() < 2.4e-3, "{x}: {found} {wanted}");
        }
    }
}
