//! Blocks of an EXR file packed by deflate, as OpenEXR's ZIP and ZIPS have it: bytes of even places, then those of odd
//! ones; each less the one before it, plus 128; deflate in zlib's wrapping. A block that does not get smaller is left
//! as it is.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// zlib's level. Of the maps of a converted picture 2 takes 0.8 of the time of 3, for 4 % more bytes of the sample
/// (benches/runs/2026-11-29/line.md).
const LEVEL: u32 = 2;

/// Packs the little-endian bytes of a block.
pub(super) fn packed(block: &[u8]) -> std::io::Result<Vec<u8>> {
    let differences = differences(block);
    let room = Vec::with_capacity(block.len());
    let mut encoder = ZlibEncoder::new(room, Compression::new(LEVEL));
    encoder.write_all(&differences)?;
    let packed = encoder.finish()?;
    Ok(match packed.len() < block.len() {
        true => packed,
        false => block.to_vec(),
    })
}

/// Bytes of even places, then those of odd ones, each less the one before it, plus 128; the first as it is.
fn differences(block: &[u8]) -> Vec<u8> {
    let mut differences = vec![0; block.len()];
    let (even, odd) = differences.split_at_mut(block.len().div_ceil(2));
    let (pairs, last) = block.as_chunks::<2>();
    let less = |byte: u8, before: u8| byte.wrapping_sub(before) ^ 128;
    let both = even.iter_mut().zip(odd.iter_mut()).skip(1);
    let neighbours = pairs.iter().zip(pairs.iter().skip(1));
    for ((even, odd), (before, pair)) in both.zip(neighbours) {
        [*even, *odd] = [less(pair[0], before[0]), less(pair[1], before[1])];
    }
    let last_pair = pairs.last().copied().unwrap_or_default();
    if let ([last], Some(to)) = (last, even.last_mut()) {
        *to = less(*last, last_pair[0]);
    }
    if let (Some(to), Some(first)) = (even.first_mut(), block.first()) {
        *to = *first;
    }
    // The odd ones go on where the even ones end.
    if let (Some(to), Some(first)) = (odd.first_mut(), pairs.first()) {
        let last_even = last.first().copied().unwrap_or(last_pair[0]);
        *to = less(first[1], last_even);
    }
    differences
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_those_of_the_bytes_taken_apart() {
        for length in [0, 1, 2, 3, 4, 7, 100, 101] {
            let block: Vec<u8> = (0..length).map(|i: usize| (i * i * 29) as u8).collect();
            let places = [0, 1].map(|first| (first..length).step_by(2));
            let apart: Vec<u8> = places.into_iter().flatten().map(|i| block[i]).collect();
            let wanted: Vec<u8> = (0..length)
                .map(|i| match i {
                    0 => apart[0],
                    _ => apart[i].wrapping_sub(apart[i - 1]).wrapping_add(128),
                })
                .collect();
            assert_eq!(differences(&block), wanted, "{length}");
        }
    }
}
