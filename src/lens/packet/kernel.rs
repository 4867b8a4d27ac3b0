//! The loops over a block of rays. Each is straight-line arithmetic with selects, so that the compiler turns it into vector
//! code of whatever width the caller's instructions have; hence `inline(always)` throughout.

use std::ops::Range;

use glam::{DMat3, DVec3};

use super::batch::{RayBatch, RayStatus};
use super::block::{BLOCK, Block, SMALL_BLOCK, load, store};
use super::prepared::Prepared;
use crate::lens::surface::{NEWTON_LIMIT, ROOT_FLOOR, Travel};
use crate::lens::system::ASPHERE_TERMS;

/// The last Newton step, mm. Its square, about 1e-14, is what is left. The plain tracer goes on longer.
const LAST_STEP_MM: f64 = 1e-7;

/// Traces the whole batch, block by block.
#[inline(always)]
pub(super) fn trace(surfaces: &[Prepared], sensor_z_mm: f64, batch: &mut RayBatch, travel: Travel) {
    let rays = batch.len();
    batch.status.resize(rays, 0);
    batch.surface.resize(rays, 0);
    for start in (0..rays).step_by(BLOCK) {
        let range = start..rays.min(start + BLOCK);
        if range.len() > SMALL_BLOCK {
            trace_block::<BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        } else {
            trace_block::<SMALL_BLOCK>(surfaces, sensor_z_mm, batch, range, travel);
        }
    }
}

/// At most N rays of the batch.
#[inline(always)]
fn trace_block<const N: usize>(
    surfaces: &[Prepared],
    sensor_z_mm: f64,
    batch: &mut RayBatch,
    range: Range<usize>,
    travel: Travel,
) {
    let mut block: Block<N> = load(batch, range.clone());
    for step in 0..surfaces.len() {
        let index = match travel {
            Travel::Forward => step,
            Travel::Backward => surfaces.len() - 1 - step,
        };
        cross(&mut block, &surfaces[index], index, travel);
    }
    if travel == Travel::Forward {
        to_sensor(&mut block, sensor_z_mm, surfaces.len().saturating_sub(1));
    }
    store(&block, batch, range);
}

#[inline(always)]
fn cross<const N: usize>(block: &mut Block<N>, surface: &Prepared, index: usize, travel: Travel) {
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
        0 => finish::<0, N>(block, &ctx, travel),
        1..=4 => asphere::<4, N>(block, &ctx, travel),
        5 | 6 => asphere::<6, N>(block, &ctx, travel),
        7 => asphere::<7, N>(block, &ctx, travel),
        8 => asphere::<8, N>(block, &ctx, travel),
        _ => asphere::<ASPHERE_TERMS, N>(block, &ctx, travel),
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

struct Finish<'a> {
    surface: &'a Prepared,
    shift: DVec3,
    sign: f64,
    code: u64,
}

#[inline(always)]
fn asphere<const TERMS: usize, const N: usize>(
    block: &mut Block<N>,
    ctx: &Finish<'_>,
    travel: Travel,
) {
    for _ in 0..NEWTON_LIMIT {
        if newton_step::<TERMS, N>(block, ctx.surface) == 0 {
            break;
        }
    }
    finish::<TERMS, N>(block, ctx, travel);
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

/// Moves each ray onto the surface, clips it there and refracts it.
#[inline(always)]
fn finish<const TERMS: usize, const N: usize>(
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
        let failure = if !met {
            RayStatus::Missed as u64 + code
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
