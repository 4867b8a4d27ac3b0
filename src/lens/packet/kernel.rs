//! The loops over a block of rays. Each is straight-line arithmetic with selects, so that the compiler turns it into
//! vector code of whatever width the caller's instructions have; hence `inline(always)` throughout.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::block::{BLOCK, Block, LEAST_BLOCK, LESSER_BLOCK, MIDDLE_BLOCK, SMALL_BLOCK};
use super::block::{load, store};
use super::newton::{meet_asphere, settle};
use super::prepared::Prepared;
use crate::lens::surface::Travel;
use crate::lens::system::ASPHERE_TERMS;
use crate::rays::{RayBatch, RayStatus};

/// Stands for a [`RayStatus`] while a ray waits for its second look.
const DOUBTFUL: u8 = u8::MAX;

/// Traces the whole batch, block by block.
#[inline(always)]
pub(super) fn trace(surfaces: &[Prepared], sensor_z_mm: f64, batch: &mut RayBatch, travel: Travel) {
    let rays = batch.len();
    batch.status.resize(rays, 0);
    batch.surface.resize(rays, 0);
    for start in (0..rays).step_by(BLOCK) {
        let range = start..rays.min(start + BLOCK);
        let fits = |block: usize| range.len() <= block;
        if fits(LEAST_BLOCK) {
            trace_block::<LEAST_BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        } else if fits(LESSER_BLOCK) {
            trace_block::<LESSER_BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        } else if fits(MIDDLE_BLOCK) {
            trace_block::<MIDDLE_BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        } else if fits(SMALL_BLOCK) {
            trace_block::<SMALL_BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        } else {
            trace_block::<BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        }
    }
}

/// At most N rays of the batch, then one by one those in doubt: they are few, and each is alone, so that no ray's bits
/// hang on its companions.
#[inline(always)]
fn trace_block<const N: usize>(
    surfaces: &[Prepared],
    sensor_z_mm: f64,
    batch: &mut RayBatch,
    range: Range<usize>,
    travel: Travel,
) {
    let mut block: Block<N> = load(batch, range.clone());
    cross_all::<N, false>(&mut block, surfaces, sensor_z_mm, travel);
    store(&block, batch, range.clone());
    for ray in range {
        if batch.status[ray] == DOUBTFUL {
            trace_carefully(surfaces, sensor_z_mm, batch, ray, travel);
        }
    }
}

/// Ray `ray` of the batch, which stands there as it came in.
#[cold]
#[inline(never)]
fn trace_carefully(
    surfaces: &[Prepared],
    sensor_z_mm: f64,
    batch: &mut RayBatch,
    ray: usize,
    travel: Travel,
) {
    let mut block: Block<1> = load(batch, ray..ray + 1);
    cross_all::<1, true>(&mut block, surfaces, sensor_z_mm, travel);
    store(&block, batch, ray..ray + 1);
}

#[inline(always)]
fn cross_all<const N: usize, const CAREFUL: bool>(
    block: &mut Block<N>,
    surfaces: &[Prepared],
    sensor_z_mm: f64,
    travel: Travel,
) {
    for step in 0..surfaces.len() {
        let index = match travel {
            Travel::Forward => step,
            Travel::Backward => surfaces.len() - 1 - step,
        };
        cross::<N, CAREFUL>(block, &surfaces[index], index, travel);
        // Most rays in doubt turn out to be lost.
        if CAREFUL && block.lost.iter().all(|lost| *lost != 0) {
            return;
        }
    }
    if travel == Travel::Forward {
        to_sensor(block, sensor_z_mm, surfaces.len().saturating_sub(1));
    }
}

#[inline(always)]
fn cross<const N: usize, const CAREFUL: bool>(
    block: &mut Block<N>,
    surface: &Prepared,
    index: usize,
    travel: Travel,
) {
    let sign = travel.sign();
    // A square surface is shifted on the fly; a turned one is first brought into its own frame.
    let mut shift = surface.vertex_mm;
    if let Some(rotation) = surface.rotation {
        turn(block, rotation.transpose(), shift, DVec3::ZERO);
        shift = DVec3::ZERO;
    }
    meet_conic(block, surface, shift, sign);
    let ctx = Finish {
        surface,
        shift,
        sign,
        code: (index as u64) << 8,
    };
    match surface.terms {
        0 => finish::<0, N, true>(block, &ctx, travel),
        1..=4 => asphere::<4, N, CAREFUL>(block, &ctx, travel),
        5 | 6 => asphere::<6, N, CAREFUL>(block, &ctx, travel),
        7 => asphere::<7, N, CAREFUL>(block, &ctx, travel),
        8 => asphere::<8, N, CAREFUL>(block, &ctx, travel),
        _ => asphere::<ASPHERE_TERMS, N, CAREFUL>(block, &ctx, travel),
    }
    if let Some(rotation) = surface.rotation {
        turn(block, rotation, DVec3::ZERO, surface.vertex_mm);
    }
}

#[inline(always)]
fn turn<const N: usize>(block: &mut Block<N>, rotation: DMat3, before: DVec3, after: DVec3) {
    for i in 0..N {
        let p = rotation * (DVec3::new(block.x[i], block.y[i], block.z[i]) - before) + after;
        let d = rotation * DVec3::new(block.dx[i], block.dy[i], block.dz[i]);
        (block.x[i], block.y[i], block.z[i]) = (p.x, p.y, p.z);
        (block.dx[i], block.dy[i], block.dz[i]) = (d.x, d.y, d.z);
    }
}

/// Brings each ray to the point nearest to the vertex and puts into `t` the way from there to the bare conic
/// (see [`crate::lens::surface`]); NaN where a pure conic is missed.
#[inline(always)]
fn meet_conic<const N: usize>(block: &mut Block<N>, surface: &Prepared, shift: DVec3, sign: f64) {
    let (c, k1) = (surface.curvature, surface.k1);
    let on_miss = if surface.terms == 0 { f64::NAN } else { 0.0 };
    for i in 0..N {
        let (dx, dy, dz) = (block.dx[i], block.dy[i], block.dz[i]);
        let (x, y, z) = (
            block.x[i] - shift.x,
            block.y[i] - shift.y,
            block.z[i] - shift.z,
        );
        let back = x * dx + y * dy + z * dz;
        let (x, y, z) = (x - back * dx, y - back * dy, z - back * dz);
        let a = c * (dx * dx + dy * dy + k1 * (dz * dz));
        let b = c * (x * dx + y * dy + k1 * (z * dz)) - dz;
        let cc = c * (x * x + y * y + k1 * (z * z)) - 2.0 * z;
        let discriminant = b * b - a * cc;
        let missed = discriminant < 0.0;
        let root = sign * if missed { 0.0 } else { discriminant }.sqrt();
        let far_form = (sign * b > 0.0) | missed;
        let top = if far_form { -(b + root) } else { cc };
        let bottom = if far_form { a } else { root - b };
        let t = top / bottom;
        let on_sheet = 1.0 - k1 * c * (z + t * dz) > 0.0;
        let t = if on_sheet | missed { t } else { on_miss };
        let t = if missed { t + on_miss } else { t };
        block.x[i] = x;
        block.y[i] = y;
        block.z[i] = z;
        block.t[i] = t;
        block.moving[i] = u64::from(block.lost[i] == 0);
    }
}

#[inline(always)]
fn asphere<const TERMS: usize, const N: usize, const CAREFUL: bool>(
    block: &mut Block<N>,
    ctx: &Finish<'_>,
    travel: Travel,
) {
    meet_asphere::<TERMS, N>(block, ctx.surface);
    if CAREFUL {
        settle(block, ctx.surface, ctx.sign);
    }
    finish::<TERMS, N, CAREFUL>(block, ctx, travel);
}

struct Finish<'a> {
    surface: &'a Prepared,
    shift: DVec3,
    sign: f64,
    code: u64,
}

/// Moves each ray onto the surface, clips it there and refracts it. A ray whose crossing is not beyond doubt (see
/// `PlainCase`) is lost as doubtful, unless `SETTLED` tells that all is known.
#[inline(always)]
fn finish<const TERMS: usize, const N: usize, const SETTLED: bool>(
    block: &mut Block<N>,
    ctx: &Finish<'_>,
    travel: Travel,
) {
    let surface = ctx.surface;
    let c = surface.curvature;
    let (sign, shift, code) = (ctx.sign, ctx.shift, ctx.code);
    let refracts = surface.eta.is_some();
    let eta = match (surface.eta, travel) {
        (Some((forward, _)), Travel::Forward) => forward,
        (Some((_, backward)), Travel::Backward) => backward,
        (None, _) => 1.0,
    };
    let one_minus = 1.0 - eta * eta;
    let plain = surface.plain_case;
    let unmet = if SETTLED {
        RayStatus::Missed as u64 + code
    } else {
        u64::from(DOUBTFUL)
    };
    for i in 0..N {
        let (dx, dy, dz) = (block.dx[i], block.dy[i], block.dz[i]);
        let t = block.t[i];
        let (x, y, z) = (
            block.x[i] + t * dx,
            block.y[i] + t * dy,
            block.z[i] + t * dz,
        );
        let r2 = x * x + y * y;
        let s2 = 1.0 - surface.k1 * c * c * r2;
        // On a bare conic s = 1 − (1+k) c z, negative on the sheet without the vertex.
        let (s, slope) = if TERMS == 0 {
            (1.0 - surface.k1 * c * z, c)
        } else {
            let s = if s2 > 0.0 { s2 } else { 0.0 }.sqrt();
            let mut derivative = 0.0;
            for j in (0..TERMS).rev() {
                derivative = derivative * r2 + surface.derivative[j];
            }
            (s, c + s * derivative)
        };
        let (mx, my) = (-x * slope, -y * slope);
        let m2 = slope * slope * r2 + s * s;
        let g = dx * mx + dy * my + dz * s;
        // Written so that a NaN fails.
        let met =
            (sign * g > 0.0) & (s > 0.0) & (s2 > 0.0) & (block.moving[i] * (TERMS as u64) == 0);
        let passes = r2 <= surface.semi_squared;
        let radicand = m2 * one_minus + eta * eta * (g * g);
        let refracted = radicand >= 0.0;
        let z_squared = dz * dz;
        let sure = SETTLED
            | (passes & (z_squared >= plain.z_squared))
            | ((r2 <= plain.outer_r_squared) & (z_squared >= plain.outer_z_squared));
        let failure = if !(met & sure) {
            unmet
        } else if !passes {
            RayStatus::Vignetted as u64 + code
        } else if !refracted {
            RayStatus::TotalInternalReflection as u64 + code
        } else {
            0
        };
        block.lost[i] = if block.lost[i] == 0 {
            failure
        } else {
            block.lost[i]
        };
        let q = (sign * if refracted { radicand } else { 0.0 }.sqrt() - eta * g) / m2;
        block.x[i] = x + shift.x;
        block.y[i] = y + shift.y;
        block.z[i] = z + shift.z;
        if refracts {
            block.dx[i] = eta * dx + q * mx;
            block.dy[i] = eta * dy + q * my;
            block.dz[i] = eta * dz + q * s;
        }
    }
}

#[inline(always)]
fn to_sensor<const N: usize>(block: &mut Block<N>, z_mm: f64, last: usize) {
    for i in 0..N {
        let t = (z_mm - block.z[i]) / block.dz[i];
        let failure = RayStatus::Missed as u64 + ((last as u64) << 8);
        let lost = if t.is_finite() { 0 } else { failure };
        block.lost[i] = if block.lost[i] == 0 {
            lost
        } else {
            block.lost[i]
        };
        block.x[i] += t * block.dx[i];
        block.y[i] += t * block.dy[i];
        block.z[i] += t * block.dz[i];
    }
}
