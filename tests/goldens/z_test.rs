//! A picture against a golden that carries its variance.
//!
//! Every value x of the picture, and every mean over 8 × 8 microlenses, and that over the whole picture (per view and
//! channel) is compared with the mean m and the variance s² that the same value had over n renders:
//!
//! ```text
//! t = (x − m) / (s √(1 + 1/n))          Student's t with ν = n − 1 degrees of freedom if the light is the same
//! z = (8ν + 1)/(8ν + 3) √(ν ln(1 + t²/ν))
//! ```
//! z is a standard normal to 0.02 there (D. L. Wallace, Ann. Math. Stat. 30, 1124 (1959)).
//!
//! The picture agrees if the smallest two-sided p-value is above α = 0.01 after Šidák's correction for the number N of
//! values, 1 − (1 − α)^(1/N), which holds for any positive dependence between them, and if the mean of z² over the
//! single values is in 0.8 to 1.2: a wrong light moves the first (the means over blocks see faint changes everywhere,
//! the single values sharp ones), another noise the second. The four views and three channels of a microlens are
//! correlated: its 12 values count as one, so that the mean of z² has a standard error of √(κ − 1)/√768, where κ is the
//! kurtosis of z, 3 to 4: 0.06 at most.
//!
//! After the tests of Mitsuba 3 (`src/render/tests/test_renders.py`).

use std::path::Path;

use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, read_layers, write_layers};

const ALPHA: f64 = 0.01;
/// Microlenses on a side of a block.
const BLOCK: usize = 8;
const CHANNELS: usize = 3;

/// Mean and variance of every value: single values, then blocks, then whole pictures.
pub struct Golden {
    mean: Vec<f32>,
    variance: Vec<f32>,
    size: (usize, usize),
    pictures: f64,
}

/// What a comparison found.
#[derive(Debug)]
#[allow(dead_code)] // because a failing test prints it
pub struct Outcome {
    pub largest_z: f64,
    pub smallest_p: f64,
    pub allowed_p: f64,
    pub mean_z2: f64,
    /// Of a value that never varies: the largest difference.
    pub still: f64,
}

impl Outcome {
    pub fn agrees(&self) -> bool {
        let noise = (0.8..1.2).contains(&self.mean_z2);
        self.smallest_p > self.allowed_p && noise && self.still < 1e-6
    }
}

impl Golden {
    /// Of pictures that are lists of views, each `size` microlenses of three channels.
    pub fn from_pictures(pictures: impl Iterator<Item = Vec<f32>>, size: (usize, usize)) -> Self {
        let (mut count, mut sums, mut squares) = (0.0, Vec::new(), Vec::new());
        for picture in pictures {
            let values = with_means(&picture, size);
            sums.resize(values.len(), 0.0f64);
            squares.resize(values.len(), 0.0f64);
            count += 1.0;
            // Welford's update: no cancellation.
            for ((mean, square), value) in sums.iter_mut().zip(&mut squares).zip(&values) {
                let off = value - *mean;
                *mean += off / count;
                *square += off * (value - *mean);
            }
        }
        Self {
            mean: sums.iter().map(|mean| *mean as f32).collect(),
            variance: squares.iter().map(|s| (s / (count - 1.0)) as f32).collect(),
            size,
            pictures: count,
        }
    }

    pub fn test(&self, picture: &[f32]) -> Outcome {
        let nu = self.pictures - 1.0;
        let values = with_means(picture, self.size);
        assert_eq!(values.len(), self.mean.len(), "a picture of another size");
        let (mut largest, mut still, mut squares, mut noisy) = (0.0f64, 0.0f64, 0.0, 0.0);
        for (n, value) in values.iter().enumerate() {
            let off = (value - f64::from(self.mean[n])).abs();
            let variance = f64::from(self.variance[n]);
            if variance <= 0.0 {
                still = still.max(off);
                continue;
            }
            let t2 = off * off / (variance * (1.0 + 1.0 / self.pictures));
            let z = (8.0 * nu + 1.0) / (8.0 * nu + 3.0) * (nu * (t2 / nu).ln_1p()).sqrt();
            largest = largest.max(z);
            if n < picture.len() {
                squares += z * z;
                noisy += 1.0;
            }
        }
        Outcome {
            largest_z: largest,
            smallest_p: two_sided_p(largest),
            allowed_p: 1.0 - (1.0 - ALPHA).powf(1.0 / values.len() as f64),
            mean_z2: squares / noisy,
            still,
        }
    }

    /// One row of an EXR: layers of mean and variance.
    pub fn write(&self, path: &Path) {
        let [mean, variance] = [&self.mean, &self.variance]
            .map(|values| Image::from_vec(values.len(), 1, 1, values.clone()).unwrap());
        let layer = |name, image| Layer {
            name,
            channels: &["Y"],
            image,
            sample: Sample::Float,
        };
        let layers = [layer("mean", &mean), layer("variance", &variance)];
        write_layers(path, &layers, Compression::Zips).unwrap();
    }

    pub fn read(path: &Path, size: (usize, usize), pictures: u64) -> Self {
        let layers = read_layers(path).unwrap();
        let values = |name: &str| {
            let layer = layers.iter().find(|layer| layer.name == name);
            layer.unwrap().image.data().to_vec()
        };
        Self {
            mean: values("mean"),
            variance: values("variance"),
            size,
            pictures: pictures as f64,
        }
    }
}

/// The values themselves, then their means over blocks, then over whole views, per channel.
fn with_means(picture: &[f32], (width, height): (usize, usize)) -> Vec<f64> {
    let mut values: Vec<f64> = picture.iter().map(|value| f64::from(*value)).collect();
    for (block_width, block_height) in [(BLOCK, BLOCK), (width, height)] {
        for view in picture.chunks(width * height * CHANNELS) {
            for top in (0..height).step_by(block_height) {
                for left in (0..width).step_by(block_width) {
                    let mut sums = [0.0; CHANNELS];
                    for y in top..top + block_height {
                        for x in left..left + block_width {
                            let pixel = &view[(y * width + x) * CHANNELS..][..CHANNELS];
                            sums.iter_mut()
                                .zip(pixel)
                                .for_each(|(s, v)| *s += f64::from(*v));
                        }
                    }
                    values.extend(sums.map(|sum| sum / (block_width * block_height) as f64));
                }
            }
        }
    }
    values
}

/// 2 (1 − Φ(z)), by the continued fraction of Mills's ratio (Abramowitz and Stegun, 26.2.14).
fn two_sided_p(z: f64) -> f64 {
    let fraction = (1..=200).rev().fold(z, |tail, n| z + f64::from(n) / tail);
    (2.0 / std::f64::consts::PI).sqrt() * (-0.5 * z * z).exp() / fraction
}

#[test]
fn p_values_are_those_of_the_tables() {
    for (z, p) in [(1.959_964, 0.05), (2.575_829, 0.01), (4.891_638, 1e-6)] {
        let error = two_sided_p(z) / p - 1.0;
        assert!(error.abs() < 1e-5, "z {z}: {error}");
    }
}
