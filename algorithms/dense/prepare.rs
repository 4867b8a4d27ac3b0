//! A pair of views on a scale on which light's noise is alike everywhere, at several resolutions.

use quadpixel::image::Image;

use super::error::DenseError;
use super::filters::{by_rows, enlarged, gaussian, halved, mean, quantile, row_of};
use super::guide::Guide;
use super::smoother::{Edges, Stiffness};
use crate::plane_error::PlaneError;

/// Smallest side of a picture, px.
const LEAST_PX: usize = 16;
/// Deviation of the Gaussian that is taken off, px of the level: what is slower is shading, not texture.
const SLOW_PX: f64 = 4.0;

/// The views' brightness is compared under Gaussians of so many-th of the smaller side: what a white sheet would tell.
const EVEN_PARTS: f64 = 8.0;

/// Difference and sum of the views at one resolution, without what is slow.
pub(super) struct Level {
    /// L − R.
    pub difference: Image,
    /// L + R.
    pub sum: Image,
    /// Variance of the noise in each of them.
    pub noise: f64,
}

/// The pair at every resolution, each half of the one before.
pub(super) struct Pyramid {
    /// Roots of the views, from full resolution down.
    views: Vec<[Image; 2]>,
    /// Variance of the noise in L − R and in L + R, alike.
    noise: Vec<f64>,
    /// The picture whose edges count at every level.
    pub guides: Vec<Guide>,
}

impl Pyramid {
    /// Of linear views with black at 0: the right one is brought to the left one's local brightness, and the square
    /// root makes light's noise alike everywhere. Edges are those of `guide`, or of the mean of the views.
    pub fn new(left: &Image, right: &Image, guide: Option<Guide>) -> Result<Self, DenseError> {
        check(left, right)?;
        let (width, height) = (left.width(), left.height());
        let right = &evened(left, right);
        let mean = by_rows(width, height, |y, to| {
            let pair = row_of(left, y).iter().zip(row_of(right, y));
            to.iter_mut()
                .zip(pair)
                .for_each(|(to, (l, r))| *to = 0.5 * (l + r));
        });
        let bright = quantile(mean.data().to_vec(), 0.99).max(0.0).sqrt();
        let scale = if bright > 0.0 { 1.0 / bright } else { 0.0 };
        let scaled = |image: &Image| {
            by_rows(width, height, |y, to| {
                let values = to.iter_mut().zip(row_of(image, y));
                values.for_each(|(to, v)| *to = scale * v.max(0.0).sqrt());
            })
        };
        let (mut l, mut r) = (scaled(left), scaled(right));
        let mut noise = noise_variance(&l) + noise_variance(&r);
        let mut pyramid = Self {
            views: Vec::new(),
            noise: Vec::new(),
            guides: vec![guide.unwrap_or_else(|| Guide::new(&mean, false))],
        };
        loop {
            let halves = [halved(&l), halved(&r)];
            pyramid.noise.push(noise);
            pyramid.views.push([l, r]);
            if halves[0].width().min(halves[0].height()) < LEAST_PX {
                return Ok(pyramid);
            }
            [l, r] = halves;
            // White noise through 1-4-6-4-1 on both axes, (70/256)²; later levels a little less.
            noise *= (70.0f64 / 256.0).powi(2);
            let guide = pyramid.guides[pyramid.guides.len() - 1].halved();
            pyramid.guides.push(guide);
        }
    }
}

impl Pyramid {
    /// How many resolutions there are.
    pub fn depth(&self) -> usize {
        self.views.len()
    }

    /// Roots of the views at resolution `k`.
    pub fn views(&self, k: usize) -> [&Image; 2] {
        self.views[k].each_ref()
    }

    /// The guide at resolution `k`, with the noise of its contrasts, for a surface of this stiffness.
    pub fn edges(&self, k: usize, stiffness: Stiffness) -> Edges<'_> {
        Edges {
            guide: &self.guides[k],
            noise: self.contrast_noise(k),
            stiffness,
        }
    }

    /// Standard deviation of the noise in the difference of two neighbours of the guide at resolution `k`, parts of
    /// white; at coarser resolutions an upper bound, as neighbours share noise there.
    fn contrast_noise(&self, k: usize) -> f64 {
        // Where the views are about as bright, the guide's noise is that of the mean of their roots: a quarter of the
        // variance of L + R. Two pixels have twice that.
        (0.5 * self.noise[k]).sqrt()
    }

    /// What the variance of the noise in L + R is at most at resolution `k`: white noise once through 1-4-6-4-1 on both
    /// axes, then noise that neighbours share, of which each halving leaves up to a quarter.
    pub fn most_noise(&self, k: usize) -> f64 {
        self.noise[k.min(1)] * 0.25f64.powi(k as i32 - k.min(1) as i32)
    }

    /// The texture at resolution `k`.
    pub fn level(&self, k: usize) -> Level {
        let [left, right] = &self.views[k];
        let fast = |sign: f32| {
            let whole = by_rows(left.width(), left.height(), |y, to| {
                let pair = row_of(left, y).iter().zip(row_of(right, y));
                to.iter_mut()
                    .zip(pair)
                    .for_each(|(to, (l, r))| *to = l + sign * r);
            });
            let slow = gaussian(&whole, SLOW_PX);
            by_rows(left.width(), left.height(), |y, to| {
                let pair = row_of(&whole, y).iter().zip(row_of(&slow, y));
                to.iter_mut().zip(pair).for_each(|(to, (w, s))| *to = w - s);
            })
        };
        Level {
            difference: fast(-1.0),
            sum: fast(1.0),
            noise: self.noise[k],
        }
    }
}

/// The right view at the left one's local brightness: their ratio under a Gaussian of an eighth of the smaller side.
fn evened(left: &Image, right: &Image) -> Image {
    let (width, height) = (left.width(), left.height());
    let (mut l, mut r, mut levels) = (left.clone(), right.clone(), 0);
    while l.width().min(l.height()) >= 64 {
        (l, r) = (halved(&l), halved(&r));
        levels += 1;
    }
    let wide = l.width().min(l.height()) as f64 / EVEN_PARTS;
    let (l, r) = (gaussian(&l, wide), gaussian(&r, wide));
    let ratio = by_rows(l.width(), l.height(), |y, to| {
        let pair = row_of(&l, y).iter().zip(row_of(&r, y));
        to.iter_mut()
            .zip(pair)
            .for_each(|(to, (l, r))| *to = if *r > 0.0 && *l > 0.0 { l / r } else { 1.0 });
    });
    let ratio = enlarged(&ratio, levels, width, height);
    by_rows(width, height, |y, to| {
        let pair = row_of(right, y).iter().zip(row_of(&ratio, y));
        to.iter_mut().zip(pair).for_each(|(to, (v, g))| *to = v * g);
    })
}

fn check(left: &Image, right: &Image) -> Result<(), DenseError> {
    PlaneError::check(left)?;
    PlaneError::check(right)?;
    let size = |image: &Image| (image.width(), image.height());
    if size(left) != size(right) {
        return Err(DenseError::Size {
            left: size(left),
            right: size(right),
        });
    }
    let (width, height) = size(left);
    if width.min(height) < LEAST_PX {
        return Err(DenseError::TooSmall {
            width,
            height,
            least: LEAST_PX,
        });
    }
    Ok(())
}

/// Variance of white noise, from the median of a second difference on both axes (Immerkær, CVIU 64, 300 (1996), with
/// the median in place of the mean, which texture would raise).
fn noise_variance(image: &Image) -> f64 {
    let (width, height) = (image.width(), image.height());
    let mut found = Vec::new();
    for y in (1..height - 1).step_by(4) {
        let rows = [y - 1, y, y + 1].map(|y| row_of(image, y));
        for x in 1..width - 1 {
            let second = |row: &[f32]| row[x - 1] - 2.0 * row[x] + row[x + 1];
            found.push((second(rows[0]) - 2.0 * second(rows[1]) + second(rows[2])).abs());
        }
    }
    // The kernel's norm is 6; the median of |z| of normal numbers is 0.6745.
    let deviation = f64::from(quantile(found, 0.5)) / (6.0 * 0.6745);
    let rounding = f64::from(f32::EPSILON).powi(2) * mean(image, |v| f64::from(v).powi(2));
    deviation * deviation + rounding
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::sampling::uniform;

    #[test]
    fn the_noise_of_contrasts_is_that_of_neighbours() {
        // The sum of twelve even numbers has the variance 1.
        let normal = |seed, i| (0..12).map(|k| uniform(seed, &[i, k])).sum::<f64>() - 6.0;
        let view = |seed| {
            let values = (0..96 * 96).map(|i| (0.5 + 0.02 * normal(seed, i)) as f32);
            Image::from_vec(96, 96, 1, values.collect()).unwrap()
        };
        let pyramid = Pyramid::new(&view(1), &view(2), None).unwrap();
        for (k, least) in [(0, 0.9), (1, 0.5)] {
            let guide = &pyramid.guides[k];
            let (width, count) = (guide.width(), guide.width() * guide.height());
            let firsts = (0..count).filter(|i| (i + 1) % width > 0);
            let squares = firsts.map(|i| f64::from(guide.contrast(i, i + 1)).powi(2));
            let squares: Vec<f64> = squares.collect();
            let found = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
            let told = pyramid.contrast_noise(k);
            assert!(
                (least..1.1).contains(&(found / told)),
                "{k}: {found} for {told}"
            );
        }
    }
}
