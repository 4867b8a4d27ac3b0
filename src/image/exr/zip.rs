//! Blocks of an EXR file packed by deflate, as OpenEXR's ZIP and ZIPS have it: bytes of even places, then those of odd
//! ones; each less the one before it, plus 128; deflate in zlib's wrapping. A block that does not get smaller is left
//! as it is.

use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// zlib's level. Of float maps 3 takes less than half the time of the encoder in `exr` for 3.5 % more bytes.
const LEVEL: u32 = 3;

/// Packs the little-endian bytes of a block.
pub(super) fn packed(block: Vec<u8>) -> std::io::Result<Vec<u8>> {
    let (pairs, last) = block.as_chunks::<2>();
    let mut apart = Vec::with_capacity(block.len());
    apart.extend(pairs.iter().map(|pair| pair[0]));
    apart.extend(last);
    apart.extend(pairs.iter().map(|pair| pair[1]));
    let mut differences = Vec::with_capacity(block.len());
    differences.extend(apart.first());
    let difference = |pair: &[u8]| pair[1].wrapping_sub(pair[0]).wrapping_add(128);
    differences.extend(apart.windows(2).map(difference));
    let room = Vec::with_capacity(block.len());
    let mut encoder = ZlibEncoder::new(room, Compression::new(LEVEL));
    encoder.write_all(&differences)?;
    let packed = encoder.finish()?;
    Ok(match packed.len() < block.len() {
        true => packed,
        false => block,
    })
}
