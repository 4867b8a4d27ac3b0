//! The truth maps made consistent: one validity for all of them.

use quadpixel::image::Image;
use quadpixel::image::views::Side;
use quadpixel::sensor::Subpixels;
use rayon::prelude::*;

use super::files::SampleFiles;

/// Disparities and shifts are stored as multiples of 1/this, px: that errs by 7e-5 px (RMS), a ninth of what they are
/// known to. The bytes of disparities pack to a seventh of those of all digits.
const STEPS: f32 = 4096.0;

/// Pixels that are summed at a time.
const PIXELS: usize = 1024;

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
    /// x_L − x_R, px, traced and paraxial; `None` for a pixel of one column.
    pub left_right_px: Option<[Image; 2]>,
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
    for map in maps.chain(channels).filter(|map| map.any(f32::is_nan)) {
        for (valid, values) in valid.iter_mut().zip(map.data().chunks(map.channels())) {
            *valid &= !values.iter().any(|value| value.is_nan());
        }
    }
    let are_all = valid.iter().all(|valid| *valid);
    let mask = |mut map: Image| {
        let channels = map.channels();
        if !are_all {
            for (values, valid) in map.data_mut().chunks_mut(channels).zip(&valid) {
                if !valid {
                    values.fill(f32::NAN);
                }
            }
        }
        map
    };
    let disparities = || {
        let pairs = (sample.traced_px.par_iter()).zip(sample.paraxial_px.par_iter());
        let disparity_px: Vec<Image> = pairs.map(|(a, b)| mask(side_by_side(a, b))).collect();
        let left_right_px = left_right_px(&disparity_px, sample.description.sensor.subpixels);
        (disparity_px, left_right_px)
    };
    let shifts = || channels.par_iter().map(|map| mask(rounded(map))).collect();
    let ((disparity_px, left_right_px), channel_shifts_px) = rayon::join(disparities, shifts);
    Truth {
        depth_m: mask(sample.depth_m.clone()),
        distance_m: mask(sample.distance_m.clone()),
        left_right_px,
        disparity_px,
        coc_px: mask(sample.coc_px.clone()),
        chief_to_sum_px: mask(rounded(sample.chief_to_sum_px)),
        channel_shifts_px,
        normals: sample.seen.map(|seen| mask(seen.normals.clone())),
        valid,
    }
}

/// As it is stored.
#[inline]
fn stored(value: &f32) -> f32 {
    // 2²³: from there on all numbers are whole, so that the addition rounds. `round` is a call, one value at a time.
    const WHOLE: f32 = 8_388_608.0;
    let steps = value * STEPS;
    let size = steps.abs();
    let whole = if size < WHOLE {
        (size + WHOLE) - WHOLE
    } else {
        size
    };
    // 0 has no sign.
    whole.copysign(steps) / STEPS + 0.0
}

fn rounded(map: &Image) -> Image {
    let mut rounded = map.clone();
    rounded.data_mut().iter_mut().for_each(|v| *v = stored(v));
    rounded
}

fn side_by_side(traced: &Image, paraxial: &Image) -> Image {
    let mut both = Image::zeros(traced.width(), traced.height(), 4);
    let [traced, paraxial] = [traced, paraxial].map(|map| map.data().as_chunks::<2>().0);
    let (pixels, _) = both.data_mut().as_chunks_mut::<4>();
    for (to, (a, b)) in pixels.iter_mut().zip(traced.iter().zip(paraxial)) {
        *to = [a[0], a[1], b[0], b[1]].map(|value| stored(&value));
    }
    both
}

/// x_L − x_R of a pixel, px, of the traced and of the paraxial disparity: the mean dx of the left sub-pixels minus that
/// of the right ones; `None` for one column.
fn left_right_px(disparity_px: &[Image], subpixels: Subpixels) -> Option<[Image; 2]> {
    let [left, right] = [Side::Left, Side::Right].map(|side| side.members(subpixels));
    let first = disparity_px.first().filter(|_| !left.is_empty())?;
    let (width, height) = (first.width(), first.height());
    let mut maps = [0, 1].map(|_| Image::zeros(width, height, 1));
    let [traced, paraxial] = maps
        .each_mut()
        .map(|map| map.data_mut().par_chunks_mut(PIXELS));
    (traced.zip(paraxial).enumerate()).for_each(|(part, (traced, paraxial))| {
        // dx, traced and paraxial.
        let mut sums = [[[0.0f64; 2]; PIXELS]; 2];
        for (sums, side) in sums.iter_mut().zip([&left, &right]) {
            for &i in side {
                let (pixels, _) = disparity_px[i].data()[4 * part * PIXELS..].as_chunks::<4>();
                for (sum, [dx, _, paraxial_dx, _]) in sums[..traced.len()].iter_mut().zip(pixels) {
                    sum[0] += f64::from(*dx);
                    sum[1] += f64::from(*paraxial_dx);
                }
            }
        }
        let [left_sums, right_sums] = &sums;
        for k in 0..traced.len() {
            let mean = |c: usize| {
                let (l, r) = (left_sums[k][c], right_sums[k][c]);
                (l / left.len() as f64 - r / right.len() as f64) as f32
            };
            (traced[k], paraxial[k]) = (mean(0), mean(1));
        }
    });
    Some(maps)
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
            -1_025.000_1,
            1_536.000_2,
            4e4,
            -1e9,
        ] {
            let stored = stored(&value);
            let off = (f64::from(stored) - f64::from(value)).abs();
            assert!(off <= 0.5 / f64::from(STEPS), "{value}: {stored}");
            assert_eq!((stored * STEPS).fract(), 0.0, "{value}: {stored}");
        }
        assert!(stored(&-1e-6).is_sign_positive());
        assert!(stored(&f32::NAN).is_nan());
        assert_eq!(stored(&f32::INFINITY), f32::INFINITY);
    }
}
