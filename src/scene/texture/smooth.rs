//! A texture averaged over a small window of its own: means along rows, then columns, then a diagonal.
//!
//! A mean over 2n + 1 texels and a part of the next one on either side has any variance that is asked for. So the three
//! together have the second moments of any window that is not much longer than wide, and their transfer function is
//! that window's but for terms of the fourth order in the frequency.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::Texture;

/// Second moments of a window, texels²: along rows, along columns, and of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowMoments {
    /// Variance along s.
    pub ss: f64,
    /// Variance along t.
    pub tt: f64,
    /// Covariance.
    pub st: f64,
}

/// Longest half of a mean, texels: beyond it a texture is so much finer than what looks at it that it pays to halve it
/// first.
const LONGEST: usize = 200;

/// Side of the tiles whose texels are averaged alike.
const TILE: usize = 64;

impl Texture {
    /// The texture averaged over windows whose moments change slowly with (s, t); beyond its border, its border. `None`
    /// where a window is long and oblique, or reaches very far.
    pub fn smoothed(&self, moments: impl Fn(f64, f64) -> WindowMoments) -> Option<Texture> {
        let (across, down) = (self.width.div_ceil(TILE), self.height.div_ceil(TILE));
        let middle = |tile: usize, side: usize| {
            let end = side.min((tile + 1) * TILE);
            (tile * TILE + end) as f64 / (2 * side) as f64
        };
        let mut passes = [[1, 0], [0, 1], [1, 1], [1, -1]].map(|step| Pass {
            step,
            across,
            means: Vec::with_capacity(across * down),
        });
        for (row, column) in (0..down).flat_map(|row| (0..across).map(move |column| (row, column)))
        {
            let WindowMoments { ss, tt, st } =
                moments(middle(column, self.width), middle(row, self.height));
            let variances = [ss - st.abs(), tt - st.abs(), st.max(0.0), (-st).max(0.0)];
            for (pass, variance) in passes.iter_mut().zip(variances) {
                pass.means.push(Mean::new(variance)?);
            }
        }
        let planes = self.planes.iter().map(|plane| {
            let (mut plane, mut other) = (plane.clone(), vec![0.0; plane.len()]);
            for pass in passes.iter().filter(|pass| pass.moves()) {
                self.average(&plane, pass, &mut other);
                std::mem::swap(&mut plane, &mut other);
            }
            plane
        });
        Some(Texture {
            planes: planes.collect(),
            levels: OnceLock::new(),
            ..*self
        })
    }

    /// A plane, with its guards, averaged in one direction into another one.
    fn average(&self, plane: &[f32], pass: &Pass, out: &mut [f32]) {
        let (width, height, stride) = (self.width, self.height, self.stride);
        let [across, down] = pass.step;
        let rows = out.par_chunks_mut(stride).take(height).enumerate();
        rows.for_each(|(y, out)| {
            let means = &pass.means[y / TILE * pass.across..][..pass.across];
            out[..width].fill(0.0);
            let tiles = out[..width].chunks_mut(TILE);
            for ((first, out), mean) in (0..width).step_by(TILE).zip(tiles).zip(means) {
                let reach = mean.reach();
                for k in -reach..=reach {
                    let row = (y as isize + k * down).clamp(0, height as isize - 1) as usize;
                    let row = &plane[row * stride..][..width];
                    add_shifted(out, row, first as isize + k * across, mean.weight(k));
                }
            }
            let last = out[width - 1];
            out[width..].fill(last);
        });
        out.copy_within((height - 1) * stride..height * stride, height * stride);
    }
}

/// A mean along a step (columns, rows) for each tile.
struct Pass {
    step: [isize; 2],
    /// Tiles in a row.
    across: usize,
    means: Vec<Mean>,
}

impl Pass {
    fn moves(&self) -> bool {
        self.means.iter().any(|mean| mean.reach() > 0)
    }
}

/// out[x] += weight · row[x + shift], beyond the row its ends.
fn add_shifted(out: &mut [f32], row: &[f32], shift: isize, weight: f32) {
    let last = row.len() as isize - 1;
    let end = shift + out.len() as isize;
    if shift >= 0 && end <= last + 1 {
        for (o, x) in out.iter_mut().zip(&row[shift as usize..]) {
            *o += weight * x;
        }
        return;
    }
    for (x, o) in (shift..end).zip(out) {
        *o += weight * row[x.clamp(0, last) as usize];
    }
}

/// A mean over 2 `half` + 1 texels, and one more on either side by a part.
struct Mean {
    half: usize,
    inner: f32,
    outer: f32,
}

impl Mean {
    /// With this variance, texels²; `None` for one below 0, or too long.
    fn new(variance: f64) -> Option<Self> {
        if !(0.0..=(LONGEST * LONGEST) as f64 / 3.0).contains(&variance) {
            return None;
        }
        // That of 2 n + 1 whole texels is n (n + 1)/3.
        let of = |n: usize| (n * (n + 1)) as f64 / 3.0;
        let half = (0..=LONGEST).take_while(|&n| of(n) <= variance).last()?;
        let (whole, next) = ((2 * half + 1) as f64, ((half + 1) * (half + 1)) as f64);
        // (whole · of(half) + 2 part · next) / (whole + 2 part) = variance
        let part = 0.5 * whole * (variance - of(half)) / (next - variance);
        let inner = 1.0 / (whole + 2.0 * part);
        Some(Self {
            half,
            inner: inner as f32,
            outer: (inner * part) as f32,
        })
    }

    /// Texels to either side.
    fn reach(&self) -> isize {
        self.half as isize + isize::from(self.outer > 0.0)
    }

    fn weight(&self, k: isize) -> f32 {
        match k.unsigned_abs() <= self.half {
            true => self.inner,
            false => self.outer,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_window_with_the_moments_asked_for() {
        let middle = 30;
        for moments in [
            [0.0, 0.0, 0.0],
            [0.083, 0.12, 0.01],
            [1.3, 0.9, -0.2],
            [14.0, 11.0, 2.5],
        ] {
            let [ss, tt, st] = moments;
            let point = Texture::from_fn(61, 61, |x, y| [f32::from((x, y) == (middle, middle))]);
            let window = point
                .unwrap()
                .smoothed(|_, _| WindowMoments { ss, tt, st })
                .unwrap();
            let mut sums = [0.0; 6];
            for (x, y) in (0..61 * 61).map(|i| (i % 61, i / 61)) {
                let value = f64::from(window.texel_channel(x, y, 0));
                assert!(value >= 0.0);
                let (dx, dy) = (x as f64 - middle as f64, y as f64 - middle as f64);
                let terms = [1.0, dx, dy, dx * dx, dy * dy, dx * dy];
                (sums.iter_mut().zip(terms)).for_each(|(sum, term)| *sum += value * term);
            }
            for (got, want) in sums.into_iter().zip([1.0, 0.0, 0.0, ss, tt, st]) {
                assert!(
                    (got - want).abs() < 1e-4 * (1.0 + want),
                    "{moments:?}: {got} {want}"
                );
            }
        }
    }

    #[test]
    fn an_even_texture_stays_even_to_its_border_and_an_oblique_window_is_refused() {
        let even = Texture::from_fn(7, 5, |_, _| [0.25, 0.5, 1.0]).unwrap();
        let smoothed = |ss, tt, st| even.smoothed(|_, _| WindowMoments { ss, tt, st });
        let smooth = smoothed(9.0, 4.0, 1.0).unwrap();
        for (s, t) in [(0.0, 0.0), (0.5, 0.5), (1.0, 1.0), (1.0, 0.3)] {
            for (got, want) in smooth
                .sample_bilinear(s, t)
                .into_iter()
                .zip([0.25, 0.5, 1.0])
            {
                assert!((got - want).abs() < 1e-6);
            }
        }
        assert!(smoothed(1.0, 4.0, 1.5).is_none());
        assert!(smoothed(f64::NAN, 1.0, 0.0).is_none());
        assert!(smoothed(1e9, 1.0, 0.0).is_none());
    }
}
