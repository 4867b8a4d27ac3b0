//! The rays in work, copied out of the batch and back.

use std::ops::Range;

use crate::rays::RayBatch;

/// Rays in a block: a few vectors, so that their latencies overlap, and little enough to stay in the first-level cache.
pub(super) const BLOCK: usize = 64;
/// Rays in the last block of a batch where they fit: those of one wavelength of many are few.
pub(super) const SMALL_BLOCK: usize = 32;
/// And of a handful of rays, and of those that a lens map leaves of a pixel: empty lanes take as long as rays.
pub(super) const LEAST_BLOCK: usize = 8;
pub(super) const LESSER_BLOCK: usize = 16;
pub(super) const MIDDLE_BLOCK: usize = 24;

/// The N rays in work. `lost` is 0 or reason + 256 · surface; `moving` is 1 while Newton's method runs.
#[repr(align(64))]
pub(super) struct Block<const N: usize> {
    pub x: [f64; N],
    pub y: [f64; N],
    pub z: [f64; N],
    pub dx: [f64; N],
    pub dy: [f64; N],
    pub dz: [f64; N],
    pub t: [f64; N],
    pub moving: [u64; N],
    pub lost: [u64; N],
}

#[inline(always)]
pub(super) fn load<const N: usize>(batch: &RayBatch, range: Range<usize>) -> Block<N> {
    // The tail of the last block is filled with lost rays along the axis.
    let mut block = Block {
        x: [0.0; N],
        y: [0.0; N],
        z: [0.0; N],
        dx: [0.0; N],
        dy: [0.0; N],
        dz: [1.0; N],
        t: [0.0; N],
        moving: [0; N],
        lost: [u64::MAX; N],
    };
    let n = range.len();
    block.x[..n].copy_from_slice(&batch.ox[range.clone()]);
    block.y[..n].copy_from_slice(&batch.oy[range.clone()]);
    block.z[..n].copy_from_slice(&batch.oz[range.clone()]);
    block.dx[..n].copy_from_slice(&batch.dx[range.clone()]);
    block.dy[..n].copy_from_slice(&batch.dy[range.clone()]);
    block.dz[..n].copy_from_slice(&batch.dz[range.clone()]);
    block.lost[..n].fill(0);
    block
}

#[inline(always)]
pub(super) fn store<const N: usize>(block: &Block<N>, batch: &mut RayBatch, range: Range<usize>) {
    for (i, ray) in range.enumerate() {
        let code = block.lost[i];
        batch.status[ray] = (code & 255) as u8;
        batch.surface[ray] = (code >> 8) as u16;
        if code == 0 {
            batch.ox[ray] = block.x[i];
            batch.oy[ray] = block.y[i];
            batch.oz[ray] = block.z[i];
            batch.dx[ray] = block.dx[i];
            batch.dy[ray] = block.dy[i];
            batch.dz[ray] = block.dz[i];
        }
    }
}
