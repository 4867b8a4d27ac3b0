//! The truth maps made consistent: one validity for all of them.

use quadpixel::image::Image;
use quadpixel::image::views::Side;
use quadpixel::sensor::Subpixels;
use rayon::prelude::*;

use super::files::SampleFiles;

/// Disparities and shifts are stored as multiples of 1/this, px: a tenth of what they are known to. The bytes of
/// disparities pack to a fifth of those of all digits, those of shifts to nine tenths.
const STEPS: f32 = 16384.0;

/// The float maps with NaN exactly where `valid` is false, as they are stored.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Where the maps apply, row by row.
    pub valid: Vec<bool>,
    /// z from the first lens vertex, m.
    pub depth_m: Image,
    /// Distance from the first lens vertex, m.
    pub distance_m: Image,
    /// (dx, dy, paraxial dx, paraxial dy) a sub-pixel.
    pub disparity_px: Vec<Image>,
    /// Signed circle of confusion, px.
    pub coc_px: Image,
    /// Where the sum shows what the chief ray meets, from there, px.
    pub chief_to_sum_px: Image,
    /// One per sub-pixel and one of the sum, or none.
    pub channel_shifts_px: Vec<Image>,
    /// Of worlds of meshes.
    pub normals: Option<Image>,
}

/// A pixel is valid where `sample.valid` says so and no map is NaN there.
pub(super) fn masked(sample: &SampleFiles<'_>) -> Truth {
    let mut valid = sample.valid.to_vec();
    let maps = [
        sample.depth_m,
        sample.distance_m,
        sample.coc_px,
        sample.chief_to_sum_px,
    ];
    let channels = sample.channel_shifts_px.unwrap_or_default();
    let normals = sample.seen.map(|seen| seen.normals);
    let maps = maps.into_iter().chain(normals);
    let maps = maps.chain(sample.traced_px).chain(sample.paraxial_px);
    for map in maps.chain(channels) {
        for (valid, values) in valid.iter_mut().zip(map.data().chunks(map.channels())) {
            *valid &= !values.iter().any(|value| value.is_nan());
        }
    }
    let mask = |mut map: Image| {
        let channels = map.channels();
        for (values, valid) in map.data_mut().chunks_mut(channels).zip(&valid) {
            if !valid {
                values.fill(f32::NAN);
            }
        }
        map
    };
    let pairs = (sample.traced_px.par_iter()).zip(sample.paraxial_px.par_iter());
    Truth {
        depth_m: mask(sample.depth_m.clone()),
        distance_m: mask(sample.distance_m.clone()),
        disparity_px: pairs.map(|(a, b)| mask(side_by_side(a, b))).collect(),
        coc_px: mask(sample.coc_px.clone()),
        chief_to_sum_px: mask(rounded(sample.chief_to_sum_px)),
        channel_shifts_px: (channels.par_iter().map(|map| mask(rounded(map)))).collect(),
        normals: sample.seen.map(|seen| mask(seen.normals.clone())),
        valid,
    }
}

/// As it is stored.
#[inline]
fn stored(value: &f32) -> f32 {
    // 1.5 · 2²³: sums with it are whole numbers, so that the addition rounds. `round` is a call.
    const WHOLE: f32 = 12_582_912.0;
    // 2²²: the sums of larger ones leave the numbers between 2²³ and 2²⁴, which are the whole ones.
    const LARGE: f32 = 4_194_304.0;
    let steps = value * STEPS;
    let whole = match steps.abs() < LARGE {
        true => (steps + WHOLE) - WHOLE,
        false => steps.round(),
    };
    whole / STEPS
}

fn rounded(map: &Image) -> Image {
    let mut rounded = map.clone();
    rounded.data_mut().iter_mut().for_each(|v| *v = stored(v));
    rounded
}

fn side_by_side(traced: &Image, paraxial: &Image) -> Image {
    let mut both = Image::zeros(traced.width(), traced.height(), 4);
    let pairs = traced.data().chunks(2).zip(paraxial.data().chunks(2));
    for (to, (a, b)) in both.data_mut().chunks_mut(4).zip(pairs) {
        (to.iter_mut().zip(a.iter().chain(b))).for_each(|(to, value)| *to = stored(value));
    }
    both
}

/// x_L − x_R of a pixel, px: the mean dx of the left sub-pixels minus that of the right ones; `None` for one column.
pub(super) fn left_right_px(
    disparity_px: &[Image],
    subpixels: Subpixels,
    channel: usize,
) -> Option<Image> {
    let [left, right] = [Side::Left, Side::Right].map(|side| side.members(subpixels));
    let first = disparity_px.first().filter(|_| !left.is_empty())?;
    let mean = |side: &[usize], x: usize, y: usize| {
        let values = side
            .iter()
            .map(|&i| f64::from(disparity_px[i].pixel(x, y)[channel]));
        values.sum::<f64>() / side.len() as f64
    };
    let mut map = Image::zeros(first.width(), first.height(), 1);
    for y in 0..first.height() {
        for x in 0..first.width() {
            map.pixel_mut(x, y)[0] = (mean(&left, x, y) - mean(&right, x, y)) as f32;
        }
    }
    Some(map)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_stored_is_the_nearest_step_however_large() {
        for value in [
            0.0,
            1e-6,
            0.123_456,
            -3.3,
            200.000_02,
            -255.999_98,
            256.000_03,
            4e4,
            -1e9,
        ] {
            let nearest = (value * STEPS).round() / STEPS;
            assert_eq!(stored(&value), nearest, "{value}");
        }
        assert!(stored(&f32::NAN).is_nan());
        assert_eq!(stored(&f32::INFINITY), f32::INFINITY);
    }
}
