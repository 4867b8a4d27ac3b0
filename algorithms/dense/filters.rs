//! Filters of single-channel pictures: Gaussian windows, halves and their way back. Edges are mirrored.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::guide::Guide;

/// Index `i` mirrored into `0..n` about the first and last sample.
pub(super) fn mirrored(i: isize, n: usize) -> usize {
    let last = n as isize - 1;
    if last <= 0 {
        return 0;
    }
    let i = i.rem_euclid(2 * last);
    i.min(2 * last - i) as usize
}

/// A picture whose rows are computed side by side: `row(y, values)`.
pub(super) fn by_rows(
    width: usize,
    height: usize,
    row: impl Fn(usize, &mut [f32]) + Sync,
) -> Image {
    let mut image = Image::zeros(width, height, 1);
    (image.data_mut().par_chunks_mut(width).enumerate()).for_each(|(y, values)| row(y, values));
    image
}

/// Row `y`.
pub(super) fn row_of(image: &Image, y: usize) -> &[f32] {
    &image.data()[y * image.width()..][..image.width()]
}

/// Rows as columns.
pub(super) fn transposed(image: &Image) -> Image {
    by_rows(image.height(), image.width(), |y, to| {
        let column = image.data()[y..].iter().step_by(image.width());
        to.iter_mut().zip(column).for_each(|(to, v)| *to = *v);
    })
}

/// Gaussian of the deviation `sigma_px`, cut at 3 σ.
pub(super) fn gaussian(image: &Image, sigma_px: f64) -> Image {
    let radius = (3.0 * sigma_px).ceil() as usize;
    let weights: Vec<f64> = (0..=radius)
        .map(|i| (-0.5 * (i as f64 / sigma_px).powi(2)).exp())
        .collect();
    let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    let taps: Vec<f32> = weights.iter().map(|w| (w / sum) as f32).collect();
    separable(image, &taps, 1)
}

/// The picture at half the resolution (1-4-6-4-1 on both axes): coarse pixel i lies on fine pixel 2 i.
pub(super) fn halved(image: &Image) -> Image {
    separable(image, &[0.375, 0.25, 0.0625], 2)
}

/// A symmetric kernel on both axes, `taps[i]` at ±i; every `stride`-th sample is kept.
fn separable(image: &Image, taps: &[f32], stride: usize) -> Image {
    let (width, height) = (image.width(), image.height());
    let radius = taps.len() - 1;
    let narrow = width.div_ceil(stride);
    let across = by_rows(narrow, height, |y, to| {
        let mut padded = vec![0.0f32; width + 2 * radius];
        for (i, value) in padded.iter_mut().enumerate() {
            *value = row_of(image, y)[mirrored(i as isize - radius as isize, width)];
        }
        let padded = &padded;
        for (i, tap) in taps.iter().enumerate() {
            let (left, right) = (&padded[radius - i..], &padded[radius + i..]);
            let tap = if i == 0 { 0.5 * tap } else { *tap };
            let pairs = left
                .iter()
                .step_by(stride)
                .zip(right.iter().step_by(stride));
            to.iter_mut()
                .zip(pairs)
                .for_each(|(to, (l, r))| *to += tap * (l + r));
        }
    });
    by_rows(narrow, height.div_ceil(stride), |y, to| {
        for (i, tap) in taps.iter().enumerate() {
            let at = |offset: isize| mirrored((y * stride) as isize + offset, height);
            let (up, down) = (
                row_of(&across, at(-(i as isize))),
                row_of(&across, at(i as isize)),
            );
            let tap = if i == 0 { 0.5 * tap } else { *tap };
            let pairs = up.iter().zip(down);
            to.iter_mut()
                .zip(pairs)
                .for_each(|(to, (u, d))| *to += tap * (u + d));
        }
    })
}

/// The picture whose [`halved`], `levels` times, has the grid of `coarse`: bilinear, of `width` × `height` pixels.
pub(super) fn enlarged(coarse: &Image, levels: usize, width: usize, height: usize) -> Image {
    let step = (1usize << levels) as f32;
    let place = |i: usize, n: usize| {
        let at = i as f32 / step;
        let first = (at as usize).min(n - 1);
        (first, (first + 1).min(n - 1), at - first as f32)
    };
    let columns: Vec<_> = (0..width).map(|x| place(x, coarse.width())).collect();
    by_rows(width, height, |y, to| {
        let (top, bottom, down) = place(y, coarse.height());
        let (top, bottom) = (row_of(coarse, top), row_of(coarse, bottom));
        for (to, &(left, right, along)) in to.iter_mut().zip(&columns) {
            let upper = top[left] + along * (top[right] - top[left]);
            let lower = bottom[left] + along * (bottom[right] - bottom[left]);
            *to = upper + down * (lower - upper);
        }
    })
}

/// As [`enlarged`], but each pixel takes from the coarse pixels nearby what is about as bright as itself (joint
/// bilateral upsampling, Kopf et al., TOG 26(3), 96 (2007)): `coarse` beside its `coarse_guide`, to the grid of
/// `guide`; `edge` is the contrast that counts.
pub(super) fn enlarged_by_guide(
    coarse: &Image,
    coarse_guide: &Guide,
    levels: usize,
    guide: &Guide,
    edge: f32,
) -> Image {
    let step = (1usize << levels) as f32;
    by_rows(guide.width(), guide.height(), |y, to| {
        let at_y = y as f32 / step;
        for (x, to) in to.iter_mut().enumerate() {
            let at_x = x as f32 / step;
            let (mut sum, mut weights) = (0.0f32, 0.0f32);
            for j in (at_y as usize).saturating_sub(1)..(at_y as usize + 3).min(coarse.height()) {
                for i in (at_x as usize).saturating_sub(1)..(at_x as usize + 3).min(coarse.width())
                {
                    let (dx, dy) = (i as f32 - at_x, j as f32 - at_y);
                    let near = (1.0 - 0.25 * dx * dx).max(0.0) * (1.0 - 0.25 * dy * dy).max(0.0);
                    let (own, other) = (y * guide.width() + x, j * coarse.width() + i);
                    let c = guide.contrast_with(own, coarse_guide, other) / edge;
                    let alike = 1.0 / (1.0 + c * c);
                    let weight = near * near * (alike * alike + 1e-4);
                    sum += weight * row_of(coarse, j)[i];
                    weights += weight;
                }
            }
            *to = sum / weights;
        }
    })
}

/// Mean of `f` over all pixels.
pub(super) fn mean(image: &Image, f: impl Fn(f32) -> f64) -> f64 {
    image.data().iter().map(|&v| f(v)).sum::<f64>() / image.data().len().max(1) as f64
}

/// The value that `share` of the numbers do not exceed; 0 where there is none.
pub(super) fn quantile(mut values: Vec<f32>, share: f64) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn ramp(width: usize, height: usize) -> Image {
        let data = (0..width * height).map(|i| (i % width) as f32 + 0.5 * (i / width) as f32);
        Image::from_vec(width, height, 1, data.collect()).unwrap()
    }

    #[test]
    fn a_ramp_stays_a_ramp_inside() {
        let image = ramp(40, 30);
        let smooth = gaussian(&image, 1.5);
        let half = halved(&image);
        let back = enlarged(&half, 1, 40, 30);
        for (x, y) in [(8, 8), (20, 15), (31, 21)] {
            let wanted = image.pixel(x, y)[0];
            assert!((smooth.pixel(x, y)[0] - wanted).abs() < 1e-4);
            assert!((back.pixel(x, y)[0] - wanted).abs() < 1e-4);
        }
    }

    #[test]
    fn mirrors_about_the_outer_samples() {
        let found: Vec<usize> = (-3..7).map(|i| mirrored(i, 4)).collect();
        assert_eq!(found, [3, 2, 1, 0, 1, 2, 3, 2, 1, 0]);
    }
}
