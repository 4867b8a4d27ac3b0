//! Newton's method on a block of rays, and what becomes of the rays for which it is not enough.

use glam::DVec3;

use super::block::Block;
use super::prepared::Prepared;
use crate::lens::surface::{NEWTON_LIMIT, ROOT_FLOOR};

/// The last Newton step, mm. Its square, about 1e-14, is what is left. The plain tracer goes on longer.
const LAST_STEP_MM: f64 = 1e-7;

/// Brings `t` of each ray from the conic to the asphere; a ray that does not settle stays moving.
#[inline(always)]
pub(super) fn meet_asphere<const TERMS: usize, const N: usize>(
    block: &mut Block<N>,
    surface: &Prepared,
) {
    for _ in 0..NEWTON_LIMIT {
        if newton_step::<TERMS, N>(block, surface) == 0 {
            break;
        }
    }
}

/// A second look at each ray, as the plain tracer takes it: `t` goes to the crossing that counts, or the ray stays
/// moving.
pub(super) fn settle<const N: usize>(block: &mut Block<N>, surface: &Prepared, sign: f64) {
    for i in 0..N {
        if block.lost[i] != 0 {
            continue;
        }
        let foot = DVec3::new(block.x[i], block.y[i], block.z[i]);
        let d = DVec3::new(block.dx[i], block.dy[i], block.dz[i]);
        let newton = (block.moving[i] == 0).then_some(block.t[i]);
        let settled = surface.shape.settle(foot, d, sign, newton);
        block.moving[i] = u64::from(settled.is_none());
        block.t[i] = settled.unwrap_or(block.t[i]);
    }
}

/// One Newton step of each ray that has not settled; returns how many still move.
#[inline(always)]
fn newton_step<const TERMS: usize, const N: usize>(
    block: &mut Block<N>,
    surface: &Prepared,
) -> u64 {
    let c = surface.curvature;
    let k1_cc = surface.k1 * c * c;
    let mut still_moving = 0;
    for i in 0..N {
        let (dx, dy, dz) = (block.dx[i], block.dy[i], block.dz[i]);
        let t = block.t[i];
        let (x, y, z) = (
            block.x[i] + t * dx,
            block.y[i] + t * dy,
            block.z[i] + t * dz,
        );
        let r2 = x * x + y * y;
        let s2 = 1.0 - k1_cc * r2;
        let s = if s2 > ROOT_FLOOR { s2 } else { ROOT_FLOOR }.sqrt();
        let (mut value, mut derivative) = (0.0, 0.0);
        for j in (0..TERMS).rev() {
            value = (value + surface.value[j]) * r2;
            derivative = derivative * r2 + surface.derivative[j];
        }
        let s1 = 1.0 + s;
        let slope = c + s * derivative;
        let step = s * ((z - value) * s1 - c * r2) / (s1 * (s * dz - slope * (x * dx + y * dy)));
        let moving = block.moving[i] != 0;
        block.t[i] = if moving { t - step } else { t };
        let next = u64::from(moving & (step.abs() >= LAST_STEP_MM));
        block.moving[i] = next;
        still_moving += next;
    }
    still_moving
}
