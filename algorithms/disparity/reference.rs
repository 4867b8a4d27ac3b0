//! A window of the reference with all that belongs to it alone: gradient, p and H⁻¹ (see [`super::refine`]).

use super::plane::{Plane, WindowStatistics};
use super::{MatchSettings, Verdict, largest_eigenvalue};

/// Central difference of fourth order: ∂f ≈ NEAR (f₊₁ − f₋₁) − FAR (f₊₂ − f₋₂), reaching over two pixels.
const NEAR: f32 = 2.0 / 3.0;
const FAR: f32 = 1.0 / 12.0;
const REACH: usize = 2;
/// Largest window, px.
pub(super) const LARGEST: usize = 31;

/// A picture with what belongs to it alone.
pub(super) struct View<'a> {
    pub plane: &'a Plane,
    pub mean: &'a [f32],
    pub gradient: [Vec<f32>; 2],
}

impl<'a> View<'a> {
    pub fn new(plane: &'a Plane, statistics: &'a WindowStatistics) -> Self {
        let (width, height) = (plane.width, plane.height);
        let mut gradient = [vec![0.0f32; width * height], vec![0.0f32; width * height]];
        for y in REACH..height.saturating_sub(REACH) {
            let line = y * width + REACH..(y + 1) * width - REACH;
            for (axis, step) in [(0, 1), (1, width)] {
                let out = &mut gradient[axis][line.clone()];
                let shifted = |from: usize| &plane.data[from..from + out.len()];
                let (b2, b1) = (shifted(line.start - 2 * step), shifted(line.start - step));
                let (a1, a2) = (shifted(line.start + step), shifted(line.start + 2 * step));
                for (i, out) in out.iter_mut().enumerate() {
                    *out = NEAR * (a1[i] - b1[i]) - FAR * (a2[i] - b2[i]);
                }
            }
        }
        Self {
            plane,
            mean: &statistics.mean,
            gradient,
        }
    }
}

/// A window of the reference: values without their mean, p, H⁻¹. Lanes beyond the window hold zero.
pub(super) struct Reference<const LANES: usize> {
    pub window: usize,
    pub free: [bool; 2],
    pub n: f64,
    pub degrees_of_freedom: f64,
    pub values: [[f32; LANES]; LARGEST],
    pub p: [[[f32; LANES]; LARGEST]; 2],
    pub energy: f64,
    pub inverse_hessian: [f64; 3],
}

impl<const LANES: usize> Reference<LANES> {
    pub fn new(settings: &MatchSettings) -> Self {
        let free = settings.axes.free();
        let n = (settings.window_px * settings.window_px) as f64;
        Self {
            window: settings.window_px,
            free,
            n,
            degrees_of_freedom: n - 2.0 - f64::from(u8::from(free[0]) + u8::from(free[1])),
            values: [[0.0; LANES]; LARGEST],
            p: [[[0.0; LANES]; LARGEST]; 2],
            energy: 0.0,
            inverse_hessian: [0.0; 3],
        }
    }

    /// Takes the window about `at`, which must lie inside.
    #[inline(always)]
    pub fn take(&mut self, view: &View<'_>, [x, y]: [usize; 2]) -> Result<(), Verdict> {
        let (window, half, width) = (self.window, self.window / 2, view.plane.width);
        let mean = view.mean[y * width + x];
        let [gx, gy] = &view.gradient;
        for k in 0..window {
            let from = (y - half + k) * width + x - half;
            let line = from..from + window;
            let values = &mut self.values[k];
            for (out, v) in values.iter_mut().zip(&view.plane.data[line.clone()]) {
                *out = v - mean;
            }
            let (px, py) = self.p.split_at_mut(1);
            let (px, py) = (&mut px[0][k], &mut py[0][k]);
            px[..window].copy_from_slice(&gx[line.clone()]);
            py[..window].copy_from_slice(&gy[line]);
        }
        let [energy, ax, ay, sx, sy, xx, xy, yy] = self.moments();
        if energy <= 0.0 {
            return Err(Verdict::Textureless);
        }
        self.energy = energy;
        let n = self.n;
        let hessian = [
            xx - sx * sx / n - ax * ax / energy,
            xy - sx * sy / n - ax * ay / energy,
            yy - sy * sy / n - ay * ay / energy,
        ];
        let least = n * f64::from(view.plane.rounding) * f64::from(view.plane.rounding);
        self.inverse_hessian = invert(hessian, self.free, least).ok_or(Verdict::Textureless)?;
        for (p, sum, along) in [(0, sx, ax), (1, sy, ay)] {
            let (mean, share) = ((sum / n) as f32, (along / energy) as f32);
            for (row, values) in self.p[p].iter_mut().zip(&self.values).take(window) {
                for (g, v) in row.iter_mut().zip(values).take(window) {
                    *g -= mean + share * v;
                }
            }
        }
        Ok(())
    }

    /// Sums of a², a gx, a gy, gx, gy, gx², gx gy, gy². Eight lanes at a time, all of their sums stay in registers.
    #[allow(clippy::needless_range_loop)] // because one index runs through five arrays
    #[inline(always)]
    fn moments(&self) -> [f64; 8] {
        let mut sums = [[0.0f32; LANES]; 8];
        for lane in (0..LANES).step_by(8) {
            let mut part = [[0.0f32; 8]; 8];
            for k in 0..self.window {
                for i in 0..8 {
                    let v = self.values[k][lane + i];
                    let (gx, gy) = (self.p[0][k][lane + i], self.p[1][k][lane + i]);
                    part[0][i] += v * v;
                    part[1][i] += v * gx;
                    part[2][i] += v * gy;
                    part[3][i] += gx;
                    part[4][i] += gy;
                    part[5][i] += gx * gx;
                    part[6][i] += gx * gy;
                    part[7][i] += gy * gy;
                }
            }
            for (sum, part) in sums.iter_mut().zip(&part) {
                sum[lane..lane + 8].copy_from_slice(part);
            }
        }
        sums.map(|lanes| total(&lanes))
    }
}

/// Inverse over the free axes of (xx, xy, yy); `None` where a direction has no more slope than `least`.
fn invert([xx, xy, yy]: [f64; 3], free: [bool; 2], least: f64) -> Option<[f64; 3]> {
    match free {
        [true, true] => {
            let determinant = xx * yy - xy * xy;
            let smaller = xx + yy - largest_eigenvalue([xx, xy, yy]);
            // Below 1e-6 of the larger eigenvalue the f32 sums say nothing.
            (smaller > least.max(1e-6 * (xx + yy)) && determinant > 0.0)
                .then(|| [yy / determinant, -xy / determinant, xx / determinant])
        }
        [true, false] => (xx > least).then(|| [1.0 / xx, 0.0, 0.0]),
        _ => (yy > least).then(|| [0.0, 0.0, 1.0 / yy]),
    }
}

#[inline(always)]
pub(super) fn total<const LANES: usize>(lanes: &[f32; LANES]) -> f64 {
    lanes.iter().map(|&v| f64::from(v)).sum()
}
