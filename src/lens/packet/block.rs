//! The rays in work, copied out of the batch and back.

use std::ops::Range;

use super::batch::RayBatch;

/// Rays in a block: a few vectors, so that their latencies overlap, and little enough to stay in the first-level cache.
pub(super) const BLOCK: usize = 64;

/// The rays in work. `lost` is 0 or reason + 256 · surface; `moving` is 1 while Newton's method runs.
#[repr(align(64))]
pub(super) struct Block {
    pub x: [f64; BLOCK],
    pub y: [f64; BLOCK],
    pub z: [f64; BLOCK],
    pub dx: [f64; BLOCK],
    pub dy: [f64; BLOCK],
    pub dz: [f64; BLOCK],
    pub t: [f64; BLOCK],
    pub moving: [u64; BLOCK],
    pub lost: [u64; BLOCK],
}

#[inline(always)]
pub(super) fn load(batch: &RayBatch, range: Range<usize>) -> Block {
    // The tail of the last block is filled with lost rays along the axis.
    let mut block = Block {
        x: [0.0; BLOCK],
        y: [0.0; BLOCK],
        z: [0.0; BLOCK],
        dx: [0.0; BLOCK],
        dy: [0.0; BLOCK],
        dz: [1.0; BLOCK],
        t: [0.0; BLOCK],
        moving: [0; BLOCK],
        lost: [u64::MAX; BLOCK],
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
pub(super) fn store(block: &Block, batch: &mut RayBatch, range: Range<usize>) {
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
