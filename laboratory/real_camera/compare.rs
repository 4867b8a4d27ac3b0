//! How near a simulated pair of views is to a real one: one global tone curve, then PSNR and SSIM.
//!
//! The converter's tone curve is not known, so it is fitted: the monotone function t of the simulated value that is
//! nearest to the real code (least squares; pool adjacent violators), one for both views and all colours. Codes are
//! sRGB-coded, 0 to 1.
//!
//! ```text
//! PSNR = −10 log₁₀ mean (real − t(simulated))²
//! SSIM = mean (2 μ_a μ_b + c₁)(2 σ_ab + c₂) / ((μ_a² + μ_b² + c₁)(σ_a² + σ_b² + c₂))
//! ```
//!
//! SSIM after Wang et al., IEEE Trans. Image Process. 13, 600 (2004): Gaussian window of σ 1.5 px cut at 11 × 11, c₁ =
//! 0.01², c₂ = 0.03², of the mean of the three colours.

use quadpixel::image::Image;
use quadpixel::image::srgb::from_linear;

use crate::data::Views;

/// Pixels along the border that do not count: blur there comes from beyond the picture.
const BORDER_PX: usize = 24;
const BINS: usize = 256;

/// Of both views together.
#[derive(Clone, Copy, Debug)]
pub struct Likeness {
    pub psnr_db: f64,
    pub ssim: f64,
}

/// How alike they are once `simulated` has the tone curve that fits `real` best.
pub fn compare(simulated: &Views, real: &Views) -> Likeness {
    let coded = |views: &Views| {
        let of = |image: &Image| {
            let mut image = image.clone();
            image
                .data_mut()
                .iter_mut()
                .for_each(|v| *v = from_linear(*v));
            image
        };
        [of(&views.left), of(&views.right)]
    };
    let (mut a, b) = (coded(simulated), coded(real));
    let curve = tone_curve(&a, &b);
    for image in &mut a {
        image
            .data_mut()
            .iter_mut()
            .for_each(|v| *v = read(&curve, *v));
    }
    let (mut squares, mut count, mut ssims) = (0.0, 0, 0.0);
    for (a, b) in a.iter().zip(&b) {
        for (x, y) in inner(a) {
            for (p, q) in a.pixel(x, y).iter().zip(b.pixel(x, y)) {
                squares += f64::from(p - q).powi(2);
                count += 1;
            }
        }
        ssims += 0.5 * ssim(a, b);
    }
    Likeness {
        psnr_db: -10.0 * (squares / f64::from(count)).log10(),
        ssim: ssims,
    }
}

fn inner(image: &Image) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (width, height) = (image.width(), image.height());
    (BORDER_PX..height - BORDER_PX)
        .flat_map(move |y| (BORDER_PX..width - BORDER_PX).map(move |x| (x, y)))
}

/// The monotone curve's value in the middle of each bin.
fn tone_curve(simulated: &[Image; 2], real: &[Image; 2]) -> Vec<f64> {
    let mut bins = vec![[0.0f64; 2]; BINS];
    for (a, b) in simulated.iter().zip(real) {
        for (x, y) in inner(a) {
            for (p, q) in a.pixel(x, y).iter().zip(b.pixel(x, y)) {
                let bin = &mut bins[((p * BINS as f32) as usize).min(BINS - 1)];
                bin[0] += f64::from(*q);
                bin[1] += 1.0;
            }
        }
    }
    // Pooled blocks: sum, weight, bins. Empty bins weigh next to nothing and take their neighbours' value.
    let mut blocks: Vec<(f64, f64, usize)> = Vec::new();
    for (i, [sum, weight]) in bins.into_iter().enumerate() {
        let faint = 1e-3;
        let own = (i as f64 + 0.5) / BINS as f64;
        let mut block = (sum + faint * own, weight + faint, 1);
        while let Some(&(s, w, n)) = blocks.last() {
            if s / w <= block.0 / block.1 {
                break;
            }
            blocks.pop();
            block = (block.0 + s, block.1 + w, block.2 + n);
        }
        blocks.push(block);
    }
    (blocks.iter())
        .flat_map(|&(s, w, n)| std::iter::repeat_n(s / w, n))
        .collect()
}

fn read(curve: &[f64], v: f32) -> f32 {
    let at = (f64::from(v) * BINS as f64 - 0.5).clamp(0.0, (BINS - 1) as f64);
    let i = (at as usize).min(BINS - 2);
    (curve[i] + (at - i as f64) * (curve[i + 1] - curve[i])) as f32
}

fn ssim(a: &Image, b: &Image) -> f64 {
    const REACH: i64 = 5;
    const SIGMA: f64 = 1.5;
    let weights: Vec<f64> = (-REACH..=REACH)
        .map(|i| (-((i * i) as f64) / (2.0 * SIGMA * SIGMA)).exp())
        .collect();
    let all: f64 = weights.iter().sum();
    let gray = |image: &Image| -> Vec<f64> {
        let of = |p: &[f32]| p.iter().map(|v| f64::from(*v)).sum::<f64>() / p.len() as f64;
        image
            .data()
            .chunks_exact(image.channels())
            .map(of)
            .collect()
    };
    let (width, height) = (a.width(), a.height());
    // The window is the product of two: along rows, then along columns.
    let smooth = |values: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let along = |n: usize, i: usize, get: &dyn Fn(usize) -> f64| {
            let term = |(k, w): (usize, &f64)| {
                let at = (i as i64 + k as i64 - REACH).clamp(0, n as i64 - 1) as usize;
                w * get(at)
            };
            weights.iter().enumerate().map(term).sum::<f64>() / all
        };
        let rows: Vec<f64> = (0..width * height)
            .map(|i| along(width, i % width, &|x| values(i / width * width + x)))
            .collect();
        (0..width * height)
            .map(|i| along(height, i / width, &|y| rows[y * width + i % width]))
            .collect()
    };
    let (p, q) = (gray(a), gray(b));
    let (mp, mq) = (smooth(&|i| p[i]), smooth(&|i| q[i]));
    let (pp, qq) = (smooth(&|i| p[i] * p[i]), smooth(&|i| q[i] * q[i]));
    let pq = smooth(&|i| p[i] * q[i]);
    let (c1, c2) = (0.01f64.powi(2), 0.03f64.powi(2));
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, y) in inner(a) {
        let i = y * width + x;
        let (m, n) = (mp[i], mq[i]);
        let (vp, vq, cov) = (pp[i] - m * m, qq[i] - n * n, pq[i] - m * n);
        sum += (2.0 * m * n + c1) * (2.0 * cov + c2) / ((m * m + n * n + c1) * (vp + vq + c2));
        count += 1.0;
    }
    sum / count
}
