//! Sub-pixel refinement: inverse-compositional Gauss–Newton with free gain and offset.
//!
//! In a window, `a(x) = g·b(x + d) + o`. With p the gradient of A made orthogonal to 1 and to a (so that offset and gain
//! drop out of the step), `H = Σ p pᵀ` and b sampled at d by Lanczos (a = 4),
//!
//! ```text
//! g = Σ ã b / Σ b̃²        r = a − g b − o        Δd = H⁻¹ Σ p r = −g H⁻¹ Σ p b
//! ```
//!
//! (~: without its mean). p and H belong to A alone and are made once. The window's shift is the same for all its pixels, so
//! sampling is two passes of eight taps.

use rayon::prelude::*;

use super::geometry::{Grid, TAPS_PX};
use super::peak::Peak;
use super::plane::{Plane, WindowStatistics};
use super::{Match, MatchSettings, Verdict, largest_eigenvalue};
use crate::simd::SimdLevel;
use crate::warp::weights::weights;

/// Longest step, px.
const LONGEST_STEP_PX: f64 = 0.5;
/// The iteration ends with a step shorter than this, px, or when the next one is expected to be.
const LAST_STEP_PX: f64 = 1e-3;
/// The same on the way back, as a share of the disagreement that is allowed.
const LAST_STEP_BACK: f64 = 0.2;
/// Length of the second step over that of the first: 0.1 to 0.2 is usual; later ones are measured.
const SHRINK: f64 = 0.3;
/// More steps than this are no convergence.
const MOST_STEPS: usize = 12;
/// Farther than this from the peak of the correlation, px, is another peak.
const FARTHEST_PX: f64 = 1.5;
/// Central difference of fourth order: ∂f ≈ NEAR (f₊₁ − f₋₁) − FAR (f₊₂ − f₋₂), reaching over two pixels.
const NEAR: f32 = 2.0 / 3.0;
const FAR: f32 = 1.0 / 12.0;
const REACH: usize = 2;
/// Largest window, px.
const LARGEST: usize = 31;

/// Refines `starts` (one a node) and passes the verdict.
pub(super) fn refine(
    a: &Plane,
    b: &Plane,
    statistics: &[WindowStatistics; 2],
    grid: &Grid,
    starts: &[Peak],
    settings: &MatchSettings,
) -> Vec<Match> {
    let [of_a, of_b] = statistics;
    let views = [View::new(a, of_a), View::new(b, of_b)];
    let level = SimdLevel::detect();
    // Rows of fixed length let the compiler keep a whole row in vector registers.
    let pass = match settings.window_px {
        ..=16 => pass::<16>,
        17..=24 => pass::<24>,
        _ => pass::<32>,
    };
    starts
        .par_chunks(grid.columns)
        .enumerate()
        .flat_map_iter(|(row, starts)| pass(&views, grid, row, starts, settings, level))
        .collect()
}

/// A picture with what belongs to it alone.
struct View<'a> {
    plane: &'a Plane,
    mean: &'a [f32],
    gradient: [Vec<f32>; 2],
}

impl<'a> View<'a> {
    fn new(plane: &'a Plane, statistics: &'a WindowStatistics) -> Self {
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

/// One row of nodes, with the widest instructions; they change the speed only (1.5 times), never a bit.
fn pass<const LANES: usize>(
    views: &[View<'_>; 2],
    grid: &Grid,
    row: usize,
    starts: &[Peak],
    settings: &MatchSettings,
    level: SimdLevel,
) -> Vec<Match> {
    #[cfg(target_arch = "x86_64")]
    if level >= SimdLevel::Avx2 {
        // SAFETY: `detect` found AVX2 or more on this CPU.
        return unsafe { pass_avx2::<LANES>(views, grid, row, starts, settings) };
    }
    pass_plain::<LANES>(views, grid, row, starts, settings)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pass_avx2<const LANES: usize>(
    views: &[View<'_>; 2],
    grid: &Grid,
    row: usize,
    starts: &[Peak],
    settings: &MatchSettings,
) -> Vec<Match> {
    pass_plain::<LANES>(views, grid, row, starts, settings)
}

#[inline(always)]
fn pass_plain<const LANES: usize>(
    [a, b]: &[View<'_>; 2],
    grid: &Grid,
    row: usize,
    starts: &[Peak],
    settings: &MatchSettings,
) -> Vec<Match> {
    let mut reference = Reference::<LANES>::new(settings);
    let mut sampler = Sampler::<LANES>::new(settings.window_px);
    let mut matches = Vec::with_capacity(starts.len());
    for (column, start) in starts.iter().enumerate() {
        let at = grid.pixel(row * grid.columns + column);
        let found = if start.verdict == Verdict::Valid {
            one(
                [a, b],
                at.into(),
                start,
                &mut reference,
                &mut sampler,
                settings,
            )
        } else {
            Err(start.verdict)
        };
        matches.push(found.unwrap_or_else(|why| Match::rejected(why, start.zncc.into())));
    }
    matches
}

/// One window: A to B, tests, and back.
#[inline(always)]
fn one<const LANES: usize>(
    [a, b]: [&View<'_>; 2],
    at: [usize; 2],
    start: &Peak,
    reference: &mut Reference<LANES>,
    sampler: &mut Sampler<LANES>,
    settings: &MatchSettings,
) -> Result<Match, Verdict> {
    let limits = &settings.limits;
    reference.take(a, at)?;
    let first = [0, 1].map(|i| f64::from(start.whole[i]) + start.fraction[i]);
    let fit = solve(reference, b, at, first, LAST_STEP_PX, sampler)?;
    if fit.zncc < limits.zncc {
        return Err(Verdict::LowCorrelation);
    }
    if largest_eigenvalue(fit.covariance_px2).sqrt() > limits.deviation_px {
        return Err(Verdict::Uncertain);
    }
    if fit.d.iter().any(|d| d.abs() > settings.search_px as f64) {
        return Err(Verdict::SearchEdge);
    }
    // The way back starts from the whole-pixel peak: from the end of the way there it could only agree.
    let back_at = [0, 1].map(|i| at[i].wrapping_add_signed(start.whole[i] as isize));
    reference.take(b, back_at)?;
    let last = LAST_STEP_BACK * limits.forward_backward_px;
    let back = solve(reference, a, back_at, first.map(|d| -d), last, sampler)?;
    let apart = (fit.d[0] + back.d[0]).hypot(fit.d[1] + back.d[1]);
    if apart > limits.forward_backward_px {
        return Err(Verdict::Inconsistent);
    }
    Ok(Match {
        dx_px: fit.d[0],
        dy_px: fit.d[1],
        covariance_px2: fit.covariance_px2,
        zncc: fit.zncc,
        verdict: Verdict::Valid,
    })
}

/// Where the iteration ended.
struct Fit {
    d: [f64; 2],
    covariance_px2: [f64; 3],
    zncc: f64,
}

#[inline(always)]
fn solve<const LANES: usize>(
    reference: &Reference<LANES>,
    b: &View<'_>,
    at: [usize; 2],
    start: [f64; 2],
    last_step_px: f64,
    sampler: &mut Sampler<LANES>,
) -> Result<Fit, Verdict> {
    let mut d = start;
    let mut last_length = 0.0f64;
    sampler.patch_at = None;
    for _ in 0..MOST_STEPS {
        let sums = sampler.correlate(reference, b, at, d)?;
        let energy_b = sums.bb - sums.b * sums.b / reference.n;
        if energy_b <= 0.0 || sums.ab <= 0.0 {
            return Err(Verdict::LowCorrelation);
        }
        let gain = sums.ab / energy_b;
        let slope = [-gain * sums.pb[0], -gain * sums.pb[1]];
        let [xx, xy, yy] = reference.inverse_hessian;
        let step = [
            (xx * slope[0] + xy * slope[1]).clamp(-LONGEST_STEP_PX, LONGEST_STEP_PX),
            (xy * slope[0] + yy * slope[1]).clamp(-LONGEST_STEP_PX, LONGEST_STEP_PX),
        ];
        d = [d[0] + step[0], d[1] + step[1]];
        if (d[0] - start[0]).abs().max((d[1] - start[1]).abs()) > FARTHEST_PX {
            return Err(Verdict::NotConverged);
        }
        let length = step[0].hypot(step[1]);
        // Steps shrink by a constant factor.
        let shrink = if last_length > 0.0 {
            (length / last_length).min(1.0)
        } else {
            SHRINK
        };
        if length * shrink < last_step_px {
            let explained = slope[0] * step[0] + slope[1] * step[1];
            let residual = (reference.energy - gain * sums.ab - explained).max(0.0);
            let variance = residual / reference.degrees_of_freedom;
            // The kernel thins b's noise by `thinning` in the residual, but hardly in the band of the texture, where it counts:
            // with both images equally noisy, put that back.
            let g2 = gain * gain;
            let scale = variance * (1.0 + g2) / (1.0 + g2 * sums.thinning);
            return Ok(Fit {
                d,
                covariance_px2: [scale * xx, scale * xy, scale * yy],
                zncc: sums.ab / (energy_b * reference.energy).sqrt(),
            });
        }
        last_length = length;
    }
    Err(Verdict::NotConverged)
}

/// A window of the reference: values without their mean, p, H⁻¹. Lanes beyond the window hold zero.
struct Reference<const LANES: usize> {
    window: usize,
    free: [bool; 2],
    n: f64,
    degrees_of_freedom: f64,
    values: [[f32; LANES]; LARGEST],
    p: [[[f32; LANES]; LARGEST]; 2],
    energy: f64,
    inverse_hessian: [f64; 3],
}

impl<const LANES: usize> Reference<LANES> {
    fn new(settings: &MatchSettings) -> Self {
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
    fn take(&mut self, view: &View<'_>, [x, y]: [usize; 2]) -> Result<(), Verdict> {
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
fn total<const LANES: usize>(lanes: &[f32; LANES]) -> f64 {
    lanes.iter().map(|&v| f64::from(v)).sum()
}

/// Sums over the window with b sampled at d; `thinning`: Σw², the share of white noise that sampling leaves.
struct Sums {
    b: f64,
    bb: f64,
    ab: f64,
    pb: [f64; 2],
    thinning: f64,
}

/// Samples windows of b: a patch of whole pixels, its rows filtered along x, then along y.
struct Sampler<const LANES: usize> {
    window: usize,
    mask: [f32; LANES],
    /// Whole-pixel shift that `patch` was cut out at.
    patch_at: Option<[i64; 2]>,
    patch: [[f32; 40]; LARGEST + 7],
    rows: [[f32; LANES]; LARGEST + 7],
}

impl<const LANES: usize> Sampler<LANES> {
    fn new(window: usize) -> Self {
        let mut mask = [0.0; LANES];
        mask[..window].fill(1.0);
        Self {
            window,
            mask,
            patch_at: None,
            patch: [[0.0; 40]; LARGEST + 7],
            rows: [[0.0; LANES]; LARGEST + 7],
        }
    }

    /// Cuts out the window at `at + whole` with three pixels before and four after it.
    #[inline(always)]
    fn cut(&mut self, b: &View<'_>, at: [usize; 2], whole: [i64; 2]) -> Result<(), Verdict> {
        if self.patch_at == Some(whole) {
            return Ok(());
        }
        let before = (self.window / 2 + TAPS_PX - 1) as i64;
        let (width, height) = (b.plane.width, b.plane.height);
        let inside = |p: usize, d: i64, size: usize| {
            let first = p as i64 + d - before;
            let fits = first >= 0 && first as usize + self.window + 7 <= size;
            fits.then_some(first as usize).ok_or(Verdict::Outside)
        };
        let x = inside(at[0], whole[0], width)?;
        let y = inside(at[1], whole[1], height)?;
        let centre = (y + before as usize) * width + x + before as usize;
        let mean = b.mean[centre];
        for (k, out) in self.patch.iter_mut().enumerate().take(self.window + 7) {
            let from = (y + k) * width + x;
            let row = &b.plane.data[from..from + self.window + 7];
            for (out, v) in out.iter_mut().zip(row) {
                *out = v - mean;
            }
        }
        self.patch_at = Some(whole);
        Ok(())
    }

    #[inline(always)]
    fn correlate(
        &mut self,
        reference: &Reference<LANES>,
        b: &View<'_>,
        at: [usize; 2],
        d: [f64; 2],
    ) -> Result<Sums, Verdict> {
        let whole = d.map(|d| d.floor() as i64);
        self.cut(b, at, whole)?;
        let [wx, wy] = [0, 1].map(|i| weights::<4>((d[i] - whole[i] as f64) as f32));
        for (out, patch) in self.rows.iter_mut().zip(&self.patch).take(self.window + 7) {
            let mut sum = [0.0f32; LANES];
            for (k, w) in wx.iter().enumerate() {
                for (s, v) in sum.iter_mut().zip(&patch[k..k + LANES]) {
                    *s += w * v;
                }
            }
            *out = sum;
        }
        let mut sums = [[0.0f32; LANES]; 5];
        for lane in (0..LANES).step_by(8) {
            let mut part = [[0.0f32; 8]; 5];
            for j in 0..self.window {
                let mut v = [0.0f32; 8];
                for (w, row) in wy.iter().zip(&self.rows[j..j + 8]) {
                    for i in 0..8 {
                        v[i] += w * row[lane + i];
                    }
                }
                for i in 0..8 {
                    let (v, at) = (v[i] * self.mask[lane + i], lane + i);
                    part[0][i] += v;
                    part[1][i] += v * v;
                    part[2][i] += reference.values[j][at] * v;
                    part[3][i] += reference.p[0][j][at] * v;
                    part[4][i] += reference.p[1][j][at] * v;
                }
            }
            for (sum, part) in sums.iter_mut().zip(&part) {
                sum[lane..lane + 8].copy_from_slice(part);
            }
        }
        let [b, bb, ab, px, py] = sums.map(|lanes| total(&lanes));
        let noise = |w: &[f32; 8]| w.iter().map(|&w| f64::from(w) * f64::from(w)).sum::<f64>();
        Ok(Sums {
            b,
            bb,
            ab,
            pb: [px, py],
            thinning: noise(&wx) * noise(&wy),
        })
    }
}
