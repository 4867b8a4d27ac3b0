//! Which crossing of an asphere counts, and a search that cannot overlook it.
//!
//! Along the ray P + t D let g(t) = σ (z − sag), which rises where the ray crosses in the sense of the light, σ. The
//! rule:
//!
//! 1. of the crossings within the clear aperture the first one in the order of travel;
//! 2. if there is none, where Newton's method settles outside (the ray is then clipped, unless apertures are left out).
//!
//! Newton's method alone is not enough: from the conic's point it may settle outside the aperture, on a crossing in the
//! other sense, or nowhere. Its point is taken as it is where it lies in the aperture, has the sense σ, and the ray is
//! within 45° of the axis: only a profile with slopes above 45° that rises, falls and rises again has two such
//! crossings, and of those either may then be taken. A surface without a rim, whose conic has none either, leaves no
//! place to search; there Newton's point is all there is.
//!
//! The search halves the way through the aperture's cylinder until on each piece, from bounds of g' = σ (D_z − h w),
//! w = x D_x + y D_y,
//!
//! ```text
//! g rises: one crossing or none     g falls: none     |g| at the ends is more than g' can undo: none
//! ```
//!
//! and follows the pieces in the order of travel (interval arithmetic as in Moore, Kearfott & Cloud, Introduction to
//! Interval Analysis, chapter 8).

use glam::DVec3;

use super::surface::{NEWTON_LAST_STEP_MM, ROOT_FLOOR};
use super::system::OpticalSurface;

/// D_z² of a ray at 45° to the axis.
pub(super) const SLANTED_Z_SQUARED: f64 = 0.5;
/// Pieces shorter than this, mm, are not halved: two crossings so close are a touch.
const LEAST_PIECE_MM: f64 = 1e-9;
/// Pieces looked at before the search gives up. Lenses need a few dozen; only numbers that drown in rounding need more.
const MOST_PIECES: u32 = 4096;
/// Steps of the bracketed Newton's method; halving alone needs about 60.
const BRACKETED_STEPS: usize = 128;

impl OpticalSurface {
    /// Path length from `foot` (the point of the ray nearest to the vertex) to the crossing that counts, in the sense
    /// `sign`; `newton` is where Newton's method settled, if it did.
    pub(super) fn settle(
        &self,
        foot: DVec3,
        d: DVec3,
        sign: f64,
        newton: Option<f64>,
    ) -> Option<f64> {
        let semi = self.aperture.semi_mm;
        let mut met = None;
        if let Some(t) = newton {
            let p = foot + d * t;
            if self.crosses(p, d, sign) {
                met = newton;
                let inside = p.x * p.x + p.y * p.y <= semi * semi;
                if inside && (d.z * d.z >= SLANTED_Z_SQUARED || semi == f64::INFINITY) {
                    return met;
                }
            }
        }
        self.first_crossing(foot, d, sign).or(met)
    }

    /// Whether a ray that comes to `p` on the surface along `d` goes through in the sense `sign`. Written so that a NaN
    /// fails.
    fn crosses(&self, p: DVec3, d: DVec3, sign: f64) -> bool {
        let r2 = p.x * p.x + p.y * p.y;
        let (_, h) = self.sag_and_slope(r2);
        p.is_finite() && self.within_domain(r2) && sign * (d.z - h * (p.x * d.x + p.y * d.y)) > 0.0
    }

    /// The first crossing within the clear aperture.
    #[cold]
    #[inline(never)]
    fn first_crossing(&self, foot: DVec3, d: DVec3, sign: f64) -> Option<f64> {
        let line = Line::new(self, foot, d, sign);
        let (enters, leaves) = line.within_aperture()?;
        let mut left = MOST_PIECES;
        let t = line.first_rise(line.end(enters), line.end(leaves), &mut left)?;
        self.crosses(foot + d * t, d, sign).then_some(t)
    }

    /// Bounds of the slope over radius h (continued as in `sag_and_slope`) between the squared radii `from` and `to`.
    pub(super) fn slope_bounds(&self, from: f64, to: f64) -> (f64, f64) {
        let c = self.curvature;
        let conic = |r2: f64| {
            c / (1.0 - (1.0 + self.conic) * c * c * r2)
                .max(ROOT_FLOOR)
                .sqrt()
        };
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for (i, a) in self.aspheric[..self.aspheric_terms]
            .iter()
            .enumerate()
            .rev()
        {
            let term = 2.0 * (i + 1) as f64 * a;
            low = low * if low >= 0.0 { from } else { to } + term;
            high = high * if high >= 0.0 { to } else { from } + term;
        }
        let (a, b) = (conic(from), conic(to));
        (low + a.min(b), high + a.max(b))
    }
}

/// A ray beside a surface: r² = a t² + 2 b t + …, never below `nearest_r2`.
struct Line<'a> {
    surface: &'a OpticalSurface,
    foot: DVec3,
    d: DVec3,
    sign: f64,
    a: f64,
    b: f64,
    nearest_r2: f64,
}

/// An end of a piece: path length and g there.
#[derive(Clone, Copy)]
struct End {
    t: f64,
    g: f64,
}

impl<'a> Line<'a> {
    fn new(surface: &'a OpticalSurface, foot: DVec3, d: DVec3, sign: f64) -> Line<'a> {
        let a = d.x * d.x + d.y * d.y;
        let across = foot.x * d.y - foot.y * d.x;
        Line {
            surface,
            foot,
            d,
            sign,
            a,
            b: foot.x * d.x + foot.y * d.y,
            nearest_r2: across * across / a,
        }
    }

    /// Where the ray enters and leaves the cylinder of the aperture, or of the conic's domain if that is narrower;
    /// `None` where it passes by, and where there is no end (a ray along the axis does not trouble Newton's method).
    fn within_aperture(&self) -> Option<(f64, f64)> {
        let s = self.surface;
        let end = (1.0 + s.conic) * s.curvature * s.curvature;
        let domain = if end > 0.0 { 1.0 / end } else { f64::INFINITY };
        let semi = s.aperture.semi_mm;
        let half = ((semi * semi).min(domain) - self.nearest_r2) / self.a;
        let (middle, half) = (-self.b / self.a, half.sqrt());
        // A negative radicand is NaN here.
        (middle.is_finite() && half.is_finite()).then_some((middle - half, middle + half))
    }

    /// g and g'.
    fn at(&self, t: f64) -> (f64, f64) {
        let p = self.foot + self.d * t;
        let (sag, h) = self.surface.sag_and_slope(p.x * p.x + p.y * p.y);
        let rise = self.d.z - h * (p.x * self.d.x + p.y * self.d.y);
        (self.sign * (p.z - sag), self.sign * rise)
    }

    fn end(&self, t: f64) -> End {
        End { t, g: self.at(t).0 }
    }

    /// Bounds of g' between two path lengths.
    fn rise_bounds(&self, from: f64, to: f64) -> (f64, f64) {
        let (w0, w1) = (self.a * from + self.b, self.a * to + self.b);
        let (r0, r1) = (w0 * w0 / self.a, w1 * w1 / self.a);
        let nearest = if w0 < 0.0 && w1 > 0.0 {
            0.0
        } else {
            r0.min(r1)
        };
        let (h0, h1) = self
            .surface
            .slope_bounds(self.nearest_r2 + nearest, self.nearest_r2 + r0.max(r1));
        let products = [h0 * w0, h0 * w1, h1 * w0, h1 * w1];
        let low = products.into_iter().fold(f64::INFINITY, f64::min);
        let high = products.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if self.sign > 0.0 {
            (self.d.z - high, self.d.z - low)
        } else {
            (low - self.d.z, high - self.d.z)
        }
    }

    /// The first t of the piece at which g rises through zero.
    fn first_rise(&self, from: End, to: End, left: &mut u32) -> Option<f64> {
        *left = left.checked_sub(1)?;
        let (low, high) = self.rise_bounds(from.t, to.t);
        let (length, comes_up) = (to.t - from.t, from.g <= 0.0 && to.g >= 0.0);
        if high <= 0.0 {
            return None;
        }
        if low > 0.0 || length < LEAST_PIECE_MM {
            return comes_up.then(|| self.bracketed(from, to));
        }
        // How far g keeps its sign from either end.
        let (fall, rise) = (low.abs(), high);
        let above = from.g > 0.0 && to.g > 0.0 && from.g / fall + to.g / rise > length;
        let below = from.g < 0.0 && to.g < 0.0 && -from.g / rise - to.g / fall > length;
        if above || below {
            return None;
        }
        let middle = self.end(0.5 * (from.t + to.t));
        self.first_rise(from, middle, left)
            .or_else(|| self.first_rise(middle, to, left))
    }

    /// Newton's method between two ends at which g has not come up and has; a step that leaves them is replaced by
    /// halving.
    fn bracketed(&self, from: End, to: End) -> f64 {
        let (mut low, mut high) = (from.t, to.t);
        let mut t = 0.5 * (low + high);
        for _ in 0..BRACKETED_STEPS {
            let (g, rise) = self.at(t);
            if g < 0.0 {
                low = t;
            } else {
                high = t;
            }
            let step = g / rise;
            let next = t - step;
            if step.abs() < NEWTON_LAST_STEP_MM {
                return next;
            }
            t = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
        }
        t
    }
}
