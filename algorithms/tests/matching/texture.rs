//! Pairs of pictures whose shift is known exactly: periodic white noise, blurred by a Gaussian and shifted in the
//! Fourier domain, so that no interpolation enters the truth.

#[path = "../../../tests/common/random.rs"]
mod random;

use quadpixel::image::Image;
pub use random::Lcg;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// The spectrum of one texture; both sides odd, so that no frequency is its own mirror image.
pub struct Texture {
    width: usize,
    height: usize,
    spectrum: Vec<Complex<f64>>,
}

impl Texture {
    /// White noise in [0, 1) of the LCG from `seed`.
    pub fn white(width: usize, height: usize, seed: u64) -> Self {
        assert!(width % 2 == 1 && height % 2 == 1);
        let mut lcg = Lcg(seed);
        let mut spectrum: Vec<Complex<f64>> = (0..width * height)
            .map(|_| Complex::new(lcg.uniform(), 0.0))
            .collect();
        transform(&mut spectrum, width, height, false);
        Self {
            width,
            height,
            spectrum,
        }
    }

    /// The texture blurred by a Gaussian of `blur_px` (as its continuous transform), moved right and down by
    /// `shift_px`; with `slope` 0 or 1, its exact derivative along x or y.
    pub fn render(&self, blur_px: f64, shift_px: [f64; 2], slope: Option<usize>) -> Vec<f64> {
        let mut data = self.spectrum.clone();
        let signed = |i: usize, n: usize| {
            let k = if i > n / 2 {
                i as f64 - n as f64
            } else {
                i as f64
            };
            std::f64::consts::TAU * k / n as f64
        };
        for (i, value) in data.iter_mut().enumerate() {
            let w = [
                signed(i % self.width, self.width),
                signed(i / self.width, self.height),
            ];
            let blur = (-0.5 * blur_px * blur_px * (w[0] * w[0] + w[1] * w[1])).exp();
            let phase = -(w[0] * shift_px[0] + w[1] * shift_px[1]);
            *value *= Complex::from_polar(blur, phase);
            if let Some(axis) = slope {
                *value *= Complex::new(0.0, w[axis]);
            }
        }
        transform(&mut data, self.width, self.height, true);
        let n = (self.width * self.height) as f64;
        data.iter().map(|v| v.re / n).collect()
    }
}

fn transform(data: &mut [Complex<f64>], width: usize, height: usize, inverse: bool) {
    let mut planner = FftPlanner::new();
    let mut plan = |n| {
        if inverse {
            planner.plan_fft_inverse(n)
        } else {
            planner.plan_fft_forward(n)
        }
    };
    plan(width).process(data);
    let columns = plan(height);
    let mut column = vec![Complex::default(); height];
    for x in 0..width {
        for y in 0..height {
            column[y] = data[y * width + x];
        }
        columns.process(&mut column);
        for y in 0..height {
            data[y * width + x] = column[y];
        }
    }
}

/// `gain·v + offset`, then normal noise of deviation `noise`.
pub fn picture(
    width: usize,
    values: &[f64],
    gain: f64,
    offset: f64,
    noise: f64,
    seed: u64,
) -> Image {
    let mut lcg = Lcg(seed);
    let data = (values.iter())
        .map(|v| {
            (gain * v
                + offset
                + if noise > 0.0 {
                    noise * lcg.normal()
                } else {
                    0.0
                }) as f32
        })
        .collect();
    Image::from_vec(width, values.len() / width, 1, data).expect("as many values as pixels")
}
