//! A window of the reference with all that belongs to it alone: gradient, p and H⁻¹ (see [`super::refine`]).

use super::lanes::{LANES, Lanes};
use super::matches::{Verdict, largest_eigenvalue};
use super::plane::{PADDING, Plane, WindowStatistics};
use super::settings::MatchSettings;

/// Central difference of sixth order: ∂f ≈ Σ DIFFERENCE\[k\] (f₊ₖ₊₁ − f₋ₖ₋₁). Where the texture lies, it is within a
/// few per cent of the slope of the sampled b, so that a step leaves as little of the error; the fourth order leaves 15
/// %, the eighth is no better once there is noise.
const DIFFERENCE: [f32; 3] = [0.75, -0.15, 1.0 / 60.0];
const REACH: usize = DIFFERENCE.len();
/// Largest window, px.
pub(super) const LARGEST: usize = 31;
/// Vectors that hold a row of the largest window.
pub(super) const VECTORS: usize = LARGEST.div_ceil(LANES);

/// A picture with what belongs to it alone.
pub(super) struct View<'a> {
    pub plane: &'a Plane,
    pub statistics: &'a WindowStatistics,
    pub gradient: [Vec<f32>; 2],
}

impl<'a> View<'a> {
    pub fn new(plane: &'a Plane, statistics: &'a WindowStatistics) -> Self {
        let (width, height) = (plane.width, plane.height);
        let gradient = [1, width].map(|step| {
            let mut gradient = vec![0.0f32; width * height + PADDING];
            for y in REACH..height.saturating_sub(REACH) {
                let line = y * width + REACH..(y + 1) * width - REACH;
                let out = &mut gradient[line.clone()];
                let shifted = |from: usize| &plane.data[from..from + out.len()];
                let before = [1, 2, 3].map(|k| shifted(line.start - k * step));
                let after = [1, 2, 3].map(|k| shifted(line.start + k * step));
                for (i, out) in out.iter_mut().enumerate() {
                    *out = DIFFERENCE[0] * (after[0][i] - before[0][i])
                        + DIFFERENCE[1] * (after[1][i] - before[1][i])
                        + DIFFERENCE[2] * (after[2][i] - before[2][i]);
                }
            }
            gradient
        });
        Self {
            plane,
            statistics,
            gradient,
        }
    }
}

/// A window of a view: `p = ∇a − mean − share·ã` is made of the view's own rows where it is needed.
pub(super) struct Reference<'v, 'p> {
    pub view: &'v View<'p>,
    /// Index of the window's first pixel.
    pub first: usize,
    /// Mean of a.
    pub mean: f64,
    /// Σã².
    pub energy: f64,
    /// Means of the gradients.
    pub means: [f64; 2],
    /// Part of the gradients that goes along with ã.
    pub share: [f64; 2],
    /// H⁻¹: xx, xy, yy; 0 on a fixed axis.
    pub inverse_hessian: [f64; 3],
}

/// What all windows have in common.
pub(super) struct Shape {
    pub window: usize,
    pub free: [bool; 2],
    pub n: f64,
    pub degrees_of_freedom: f64,
    /// Vectors that hold a row.
    pub vectors: usize,
    /// 1 on the window's columns, 0 beyond.
    pub mask: [f32; VECTORS * LANES],
}

impl Shape {
    pub fn new(settings: &MatchSettings) -> Self {
        let (window, free) = (settings.window_px, settings.axes.free());
        let n = (window * window) as f64;
        let mut mask = [0.0; VECTORS * LANES];
        mask[..window].fill(1.0);
        Self {
            window,
            free,
            n,
            degrees_of_freedom: n - 2.0 - f64::from(u8::from(free[0]) + u8::from(free[1])),
            vectors: window.div_ceil(LANES),
            mask,
        }
    }
}

impl<'v, 'p> Reference<'v, 'p> {
    /// The window about `at`, which must lie inside.
    #[inline(always)]
    pub fn new<V: Lanes>(
        moments: &mut Moments<'v, 'p>,
        [x, y]: [usize; 2],
        shape: &Shape,
    ) -> Result<Self, Verdict> {
        let view = moments.view;
        let (half, width) = (shape.window / 2, view.plane.width);
        let centre = y * width + x;
        let inverse_norm = f64::from(view.statistics.inverse_norm[centre]);
        let first = (y - half) * width + x - half;
        if inverse_norm <= 0.0 {
            return Err(Verdict::Textureless);
        }
        let energy = 1.0 / (inverse_norm * inverse_norm);
        let mean = f64::from(view.statistics.mean[centre]);
        let [sx, sy, xx, xy, yy, ax, ay] = moments.about::<V>([x, y], shape);
        let (ax, ay) = (ax - mean * sx, ay - mean * sy);
        let n = shape.n;
        let hessian = [
            xx - sx * sx / n - ax * ax / energy,
            xy - sx * sy / n - ax * ay / energy,
            yy - sy * sy / n - ay * ay / energy,
        ];
        let least = n * f64::from(view.plane.rounding) * f64::from(view.plane.rounding);
        Ok(Self {
            view,
            first,
            mean,
            energy,
            share: [ax / energy, ay / energy],
            means: [sx / n, sy / n],
            inverse_hessian: invert(hessian, shape.free, least).ok_or(Verdict::Textureless)?,
        })
    }
}

/// Sums over the rows of a window of gx, gy, gx², gx gy, gy², a gx, a gy.
const MOMENTS: usize = 7;

/// Column by column, the moments of the windows about the rows that a row of nodes needs: neighbouring windows share
/// them. Most need a single row.
pub(super) struct Moments<'v, 'p> {
    view: &'v View<'p>,
    /// Row of the windows' centres, and its sums, \[moment\]\[column\].
    rows: Vec<(usize, Vec<f32>)>,
}

impl<'v, 'p> Moments<'v, 'p> {
    pub fn new(view: &'v View<'p>) -> Self {
        Self {
            view,
            rows: Vec::new(),
        }
    }

    /// Of the window about (x, y), which must lie inside.
    #[inline(always)]
    fn about<V: Lanes>(&mut self, [x, y]: [usize; 2], shape: &Shape) -> [f64; MOMENTS] {
        let known = self.rows.iter().position(|(row, _)| *row == y);
        let place = known.unwrap_or(self.rows.len());
        if known.is_none() {
            self.rows.push((y, columns::<V>(self.view, y, shape)));
        }
        let sums = &self.rows[place].1;
        let stride = sums.len() / MOMENTS;
        let mut moments = [0.0; MOMENTS];
        for (i, moment) in moments.iter_mut().enumerate() {
            let first = i * stride + x - shape.window / 2;
            let mut sum = V::splat(0.0);
            for vector in 0..shape.vectors {
                let lane = vector * LANES;
                let part = V::load(&sums[first + lane..]).times(V::load(&shape.mask[lane..]));
                sum = sum.plus(part);
            }
            *moment = sum.total();
        }
        moments
    }
}

/// The moments of all columns; those beyond the last one hold nothing of meaning.
#[inline(always)]
fn columns<V: Lanes>(view: &View<'_>, y: usize, shape: &Shape) -> Vec<f32> {
    let width = view.plane.width;
    let stride = width + PADDING;
    let mut sums = vec![0.0f32; MOMENTS * stride];
    let [gx, gy] = &view.gradient;
    for vector in 0..width.div_ceil(LANES) {
        let lane = vector * LANES;
        let [mut sx, mut sy, mut xx, mut xy, mut yy, mut ax, mut ay] = [V::splat(0.0); MOMENTS];
        for k in 0..shape.window {
            let from = (y - shape.window / 2 + k) * width + lane;
            let a = V::load(&view.plane.data[from..]);
            let (x, y) = (V::load(&gx[from..]), V::load(&gy[from..]));
            (sx, sy) = (sx.plus(x), sy.plus(y));
            (ax, ay) = (ax.plus(a.times(x)), ay.plus(a.times(y)));
            (xx, xy) = (xx.plus(x.times(x)), xy.plus(x.times(y)));
            yy = yy.plus(y.times(y));
        }
        let all = [sx, sy, xx, xy, yy, ax, ay];
        for i in 0..MOMENTS {
            all[i].store(&mut sums[i * stride + lane..]);
        }
    }
    sums
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
