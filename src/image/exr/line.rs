//! A channel of a row of interleaved values as the bytes of a file's line.

use half::f16;
use half::slice::HalfFloatSliceExt;

/// Values of a row that are taken at a time.
const BLOCK: usize = 256;

/// Appends channel `channel` of `channels` of a row as f32.
pub(super) fn floats(row: &[f32], (channels, channel): (usize, usize), to: &mut Vec<u8>) {
    let mut bytes = [[0; 4]; BLOCK];
    by_blocks(row, (channels, channel), |values| {
        let bytes = &mut bytes[..values.len()];
        (bytes.iter_mut().zip(values)).for_each(|(to, value)| *to = value.to_ne_bytes());
        to.extend_from_slice(bytes.as_flattened());
    });
}

/// The same as f16, to the nearest.
///
/// # Errors
/// A finite value that is too large.
pub(super) fn halves(
    row: &[f32],
    (channels, channel): (usize, usize),
    to: &mut Vec<u8>,
) -> Result<(), f32> {
    let (mut halves, mut bytes) = ([f16::ZERO; BLOCK], [[0; 2]; BLOCK]);
    let mut too_large = None;
    by_blocks(row, (channels, channel), |values| {
        let halves = &mut halves[..values.len()];
        halves.convert_from_f32_slice(values);
        let both = values.iter().zip(halves.iter());
        if both.fold(false, |any, (v, h)| any | (h.is_infinite() & v.is_finite())) {
            let mut both = values.iter().zip(halves.iter());
            too_large = too_large.or(both
                .find(|(v, h)| h.is_infinite() && v.is_finite())
                .map(|(v, _)| *v));
        }
        let bytes = &mut bytes[..values.len()];
        (bytes.iter_mut().zip(halves.iter())).for_each(|(to, half)| *to = half.to_ne_bytes());
        to.extend_from_slice(bytes.as_flattened());
    });
    too_large.map_or(Ok(()), Err)
}

/// Calls `take` with the channel's values, [`BLOCK`] at a time.
fn by_blocks(row: &[f32], (channels, channel): (usize, usize), mut take: impl FnMut(&[f32])) {
    let mut values = [0.0; BLOCK];
    for pixels in row.chunks(BLOCK * channels) {
        let values = &mut values[..pixels.len() / channels];
        match channels {
            1 => values.copy_from_slice(pixels),
            2 => picked::<2>(pixels, channel, values),
            3 => picked::<3>(pixels, channel, values),
            4 => picked::<4>(pixels, channel, values),
            _ => {
                let from = pixels.iter().skip(channel).step_by(channels);
                values.iter_mut().zip(from).for_each(|(to, v)| *to = *v);
            }
        }
        take(values);
    }
}

/// The values of a channel of N.
fn picked<const N: usize>(pixels: &[f32], channel: usize, to: &mut [f32]) {
    let (pixels, _) = pixels.as_chunks::<N>();
    let channel = channel.min(N - 1);
    (to.iter_mut().zip(pixels)).for_each(|(to, pixel)| *to = pixel[channel]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_of_any_number_comes_out_whatever_the_row_s_length() {
        for channels in 1..=6 {
            for pixels in [1, BLOCK - 1, BLOCK, 2 * BLOCK + 3] {
                let row: Vec<f32> = (0..pixels * channels).map(|i| i as f32 * 0.25).collect();
                for channel in 0..channels {
                    let wanted: Vec<f32> = row
                        .iter()
                        .skip(channel)
                        .step_by(channels)
                        .copied()
                        .collect();
                    let (mut as_floats, mut as_halves) = (Vec::new(), Vec::new());
                    floats(&row, (channels, channel), &mut as_floats);
                    assert_eq!(halves(&row, (channels, channel), &mut as_halves), Ok(()));
                    let bytes: Vec<u8> = wanted.iter().flat_map(|v| v.to_ne_bytes()).collect();
                    assert_eq!(as_floats, bytes);
                    let bytes = wanted.iter().flat_map(|v| f16::from_f32(*v).to_ne_bytes());
                    assert_eq!(as_halves, bytes.collect::<Vec<u8>>());
                }
            }
        }
    }

    #[test]
    fn a_value_too_large_for_half_precision_is_told_and_infinity_is_none() {
        let mut row = vec![1.0; 3 * BLOCK];
        row[BLOCK + 7] = f32::INFINITY;
        row[BLOCK + 9] = f32::NAN;
        assert_eq!(halves(&row, (1, 0), &mut Vec::new()), Ok(()));
        row[2 * BLOCK + 1] = -7e4;
        assert_eq!(halves(&row, (1, 0), &mut Vec::new()), Err(-7e4));
    }
}
