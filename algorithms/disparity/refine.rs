//! Sub-pixel refinement: inverse-compositional Gauss–Newton with free gain and offset.
//!
//! In a window, `a(x) = g·b(x + d) + o`. With p the gradient of A made orthogonal to 1 and to a (so that offset and
//! gain drop out of the step), `H = Σ p pᵀ` and b sampled at d by Lanczos (a = 4),
//!
//! ```text
//! g = Σ ã b / Σ b̃²        r = a − g b − o        Δd = H⁻¹ Σ p r = −g H⁻¹ Σ p b
//! ```
//!
//! (~: without its mean). p and H belong to A alone and are made once. The window's shift is the same for all its
//! pixels, so sampling is two passes of eight taps.

use rayon::prelude::*;

use super::geometry::Grid;
use super::lanes::Lanes;
#[cfg(target_arch = "x86_64")]
use super::lanes::avx2;
use super::matches::{Match, Verdict, largest_eigenvalue};
use super::peak::Peak;
use super::prepared::Prepared;
use super::reference::{Moments, Reference, Shape, View};
use super::sampler::Sampler;
use super::settings::MatchSettings;
use quadpixel::simd::SimdLevel;

/// Longest step, px.
const LONGEST_STEP_PX: f64 = 0.5;
/// The last step on the way back, as a share of the disagreement that is allowed.
const LAST_STEP_BACK: f64 = 0.2;
/// Length of the second step over that of the first, until a window has shown it: 0.03 to 0.08 is usual, 0.2 where
/// pixels know nothing of their neighbours.
const SHRINK: f64 = 0.5;
/// More steps than this are no convergence.
const MOST_STEPS: usize = 12;
/// The neighbour's match is the better guess up to this distance from the peak, px: several times what the peak itself
/// errs.
const NEXT_TO_PX: f64 = 0.1;
/// Farther than this from the peak of the correlation, px, is another peak.
const FARTHEST_PX: f64 = 1.5;

/// Refines `starts` (one per node) and passes the verdict.
pub(super) fn refine(
    pictures: &Prepared,
    starts: &[Peak],
    settings: &MatchSettings,
    level: SimdLevel,
) -> Vec<Match> {
    let [of_a, of_b] = &pictures.statistics;
    let pass = Pass {
        views: [View::new(&pictures.a, of_a), View::new(&pictures.b, of_b)],
        grid: pictures.grid,
        shape: Shape::new(settings),
        settings,
    };
    starts
        .par_chunks(pictures.grid.columns)
        .enumerate()
        .flat_map_iter(|(row, starts)| pass.row(row, starts, level))
        .collect()
}

/// What the rows of nodes have in common.
struct Pass<'a> {
    views: [View<'a>; 2],
    grid: Grid,
    shape: Shape,
    settings: &'a MatchSettings,
}

impl Pass<'_> {
    /// One row of nodes, with the widest instructions; they change the speed only (1.5 times), never a bit.
    fn row(&self, row: usize, starts: &[Peak], level: SimdLevel) -> Vec<Match> {
        #[cfg(target_arch = "x86_64")]
        if level >= SimdLevel::Avx2 {
            // SAFETY: `detect` found AVX2 or more on this CPU.
            return unsafe { self.row_avx2(row, starts) };
        }
        self.row_with::<[f32; 8]>(row, starts)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn row_avx2(&self, row: usize, starts: &[Peak]) -> Vec<Match> {
        self.row_with::<avx2::Register>(row, starts)
    }

    #[inline(always)]
    fn row_with<V: Lanes>(&self, row: usize, starts: &[Peak]) -> Vec<Match> {
        let [a, b] = &self.views;
        let mut refiner = Refiner {
            pass: self,
            sampler: Sampler::new(&self.shape),
            moments: [Moments::new(a), Moments::new(b)],
            shrink: SHRINK,
        };
        let mut matches: Vec<Match> = Vec::with_capacity(starts.len());
        for (column, start) in starts.iter().enumerate() {
            let at = self.grid.pixel(row * self.grid.columns + column);
            let refined = if start.verdict == Verdict::Valid {
                let first = first_guess(start, matches.last());
                refiner.window::<V>(at.into(), start, first)
            } else {
                Err(start.verdict)
            };
            matches.push(refined.unwrap_or_else(|why| Match::rejected(why, start.zncc.into())));
        }
        matches
    }
}

/// Where to begin: on the peak, or where the node to the left ended if that is next to it: most of its window is the
/// same.
#[inline(always)]
fn first_guess(start: &Peak, left: Option<&Match>) -> [f64; 2] {
    let peak = start.position();
    match left {
        Some(left) if left.verdict == Verdict::Valid => {
            let d = [left.dx_px, left.dy_px];
            let apart = (d[0] - peak[0]).abs().max((d[1] - peak[1]).abs());
            if apart < NEXT_TO_PX { d } else { peak }
        }
        _ => peak,
    }
}

/// Refines the windows of one row, one after the other.
struct Refiner<'p, 'a> {
    pass: &'p Pass<'a>,
    sampler: Sampler<'p>,
    moments: [Moments<'p, 'a>; 2],
    /// By which factor the second step of a window is expected to be shorter than its first.
    shrink: f64,
}

/// Where an iteration begins, and when it ends.
struct Start {
    /// The reference's pixel.
    at: [usize; 2],
    d: [f64; 2],
    last_step_px: f64,
}

/// Where the iteration ended.
struct Fit {
    d: [f64; 2],
    covariance_px2: [f64; 3],
    zncc: f64,
}

impl<'p, 'a> Refiner<'p, 'a> {
    /// One window: A to B from `first`, tests, and back.
    #[inline(always)]
    fn window<V: Lanes>(
        &mut self,
        at: [usize; 2],
        start: &Peak,
        first: [f64; 2],
    ) -> Result<Match, Verdict> {
        let Pass {
            views: [a, b],
            shape,
            settings,
            ..
        } = self.pass;
        let limits = &settings.limits;
        let reference = Reference::new::<V>(&mut self.moments[0], at, shape)?;
        let there = Start {
            at,
            d: first,
            last_step_px: settings.last_step_px,
        };
        let fit = self.solve::<V>(&reference, b, &there)?;
        if fit.zncc < limits.zncc {
            return Err(Verdict::LowCorrelation);
        }
        if largest_eigenvalue(fit.covariance_px2).sqrt() > limits.deviation_px {
            return Err(Verdict::Uncertain);
        }
        if fit.d.iter().any(|d| d.abs() > settings.search_px as f64) {
            return Err(Verdict::SearchEdge);
        }
        // The way back starts from the peak: from the end of the way there it could only agree.
        let back_at = [0, 1].map(|i| at[i].wrapping_add_signed(start.whole[i] as isize));
        let reference = Reference::new::<V>(&mut self.moments[1], back_at, shape)?;
        let way_back = Start {
            at: back_at,
            d: start.position().map(|d| -d),
            last_step_px: LAST_STEP_BACK * limits.forward_backward_px,
        };
        let back = self.solve::<V>(&reference, a, &way_back)?;
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

    /// Gauss–Newton steps from `start` in `b`, until what they still have to go is short.
    #[inline(always)]
    fn solve<V: Lanes>(
        &mut self,
        reference: &Reference<'_, '_>,
        b: &View<'_>,
        start: &Start,
    ) -> Result<Fit, Verdict> {
        let mut d = start.d;
        let mut last: Option<([f64; 2], [f64; 2], f64)> = None;
        for step_count in 0..MOST_STEPS {
            let sums = self.sampler.correlate::<V>(reference, b, start.at, d)?;
            if sums.bb <= 0.0 || sums.ab <= 0.0 {
                return Err(Verdict::LowCorrelation);
            }
            let gain = sums.ab / sums.bb;
            let slope = [-gain * sums.pb[0], -gain * sums.pb[1]];
            let [xx, xy, yy] = reference.inverse_hessian;
            let newton = [xx * slope[0] + xy * slope[1], xy * slope[0] + yy * slope[1]];
            let step = match last {
                Some((d_last, newton_last, _)) => secant(d, newton, d_last, newton_last),
                None => newton,
            }
            .map(|s| s.clamp(-LONGEST_STEP_PX, LONGEST_STEP_PX));
            let at_newton = d;
            d = [d[0] + step[0], d[1] + step[1]];
            if (d[0] - start.d[0]).abs().max((d[1] - start.d[1]).abs()) > FARTHEST_PX {
                return Err(Verdict::NotConverged);
            }
            let length = step[0].hypot(step[1]);
            // The second step shows by which factor steps shrink here; the next window is told.
            let shrink = match last {
                Some((_, newton_last, last_length)) => {
                    if step_count == 1 {
                        let ratio =
                            newton[0].hypot(newton[1]) / newton_last[0].hypot(newton_last[1]);
                        self.shrink = ratio.min(0.9);
                    }
                    (length / last_length).min(1.0)
                }
                None => self.shrink,
            };
            // What they still have to go is a geometric series; steps that do not shrink never end.
            if length * shrink < start.last_step_px * (1.0 - shrink) {
                let explained = slope[0] * step[0] + slope[1] * step[1];
                let residual = (reference.energy - gain * sums.ab - explained).max(0.0);
                let variance = residual / self.pass.shape.degrees_of_freedom;
                // The kernel thins b's noise by `thinning` in the residual, but hardly in the band of the texture,
                // where it counts: with both images equally noisy, put that back.
                let g2 = gain * gain;
                let scale = variance * (1.0 + g2) / (1.0 + g2 * sums.thinning);
                return Ok(Fit {
                    d,
                    covariance_px2: [scale * xx, scale * xy, scale * yy],
                    zncc: sums.ab / (sums.bb * reference.energy).sqrt(),
                });
            }
            last = Some((at_newton, newton, length));
        }
        Err(Verdict::NotConverged)
    }
}

/// The step from `d` where steps shrink by a constant factor: with the last two, the best mixture of where they lead
/// (Anderson acceleration of depth one). Where the Newton step is as good as it should be this changes little, and
/// where the two images are unlike, so that it is too short or too long, it ends the long row of steps.
#[inline(always)]
fn secant(d: [f64; 2], newton: [f64; 2], d_last: [f64; 2], newton_last: [f64; 2]) -> [f64; 2] {
    let change = [newton[0] - newton_last[0], newton[1] - newton_last[1]];
    let square = change[0] * change[0] + change[1] * change[1];
    if square <= 0.0 {
        return newton;
    }
    let share = (newton[0] * change[0] + newton[1] * change[1]) / square;
    [0, 1].map(|i| newton[i] - share * (d[i] - d_last[i] + change[i]))
}
