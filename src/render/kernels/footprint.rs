//! How a ray's light is spread over pixels: what shines, and the pixel's own square.

/// What a kernel is the picture of. The pixel's own area is in all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Footprint {
    /// A point in the middle of a pixel: each ray counts for the pixel that it lands in.
    Point,
    /// A square of one pixel, evenly bright: bilinear shares.
    Pixel,
    /// A sample of a picture that is bilinear between its pixels' middles: shares of the quadratic B-spline. Pictures
    /// are convolved with these.
    Sample,
}

impl Footprint {
    /// Shares of the pixels at −1, 0 and 1 from that nearest, for light that lands `f` beside its middle, −½ to ½ px.
    #[inline]
    pub fn shares(self, f: f64) -> [f64; 3] {
        match self {
            Self::Point => [0.0, 1.0, 0.0],
            Self::Pixel => [(-f).max(0.0), 1.0 - f.abs(), f.max(0.0)],
            Self::Sample => {
                let (before, after) = (0.5 - f, 0.5 + f);
                [0.5 * before * before, 0.75 - f * f, 0.5 * after * after]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_sum_to_one_and_keep_the_centroid() {
        for footprint in [Footprint::Pixel, Footprint::Sample] {
            for f in [-0.5, -0.2, 0.0, 0.3, 0.5] {
                let [a, b, c] = footprint.shares(f);
                assert!((a + b + c - 1.0).abs() < 1e-12);
                assert!((c - a - f).abs() < 1e-12, "{footprint:?} {f}");
            }
        }
    }

    #[test]
    fn the_spline_is_the_mean_of_bilinear_shares_over_a_pixel() {
        let f = 0.23;
        let n = 20_000;
        let mut mean = [0.0; 3];
        for i in 0..n {
            let at = f + (f64::from(i) + 0.5) / f64::from(n) - 0.5;
            let nearest = at.round();
            let shares = Footprint::Pixel.shares(at - nearest);
            for (k, share) in shares.into_iter().enumerate() {
                let to = k as i32 + nearest as i32;
                if (0..3).contains(&to) {
                    mean[to as usize] += share / f64::from(n);
                }
            }
        }
        for (a, b) in mean.into_iter().zip(Footprint::Sample.shares(f)) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}
