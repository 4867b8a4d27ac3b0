//! A block of rays through a map. Straight-line arithmetic with selects, nothing contracted and no sum across lanes, as
//! in the packet tracer: the same bits at every SIMD level.
//!
//! The polynomials are summed in f32, to which all that is large has been added in f64: what they hold is the pupil's
//! part of a ray's place and slope.

#![allow(clippy::needless_range_loop)] // because the lanes of several columns are taken together

use std::ops::Range;

use glam::DVec3;

use super::basis::terms;
use super::edge::{DIRECTIONS, direction};
use super::frame::{CHANGES, OUTPUTS};
use super::horner::{Lanes, polynomial};
use super::lens_map::LensMap;
use super::place::{Place, PlaceBuffers};
use crate::rays::{RayBatch, RayStatus};

const BLOCK: usize = 64;
const SMALL_BLOCK: usize = 32;

/// Some rays of a batch, block by block; the numbers of those in doubt are added to the buffers.
#[inline(always)]
pub(super) fn run<V: Lanes>(
    map: &LensMap,
    batch: &mut RayBatch,
    rays: Range<usize>,
    buffers: &mut PlaceBuffers,
) {
    for start in rays.clone().step_by(BLOCK) {
        let count = BLOCK.min(rays.end - start);
        if count > SMALL_BLOCK {
            block::<V, BLOCK>(
                map,
                &buffers.place,
                batch,
                (start, count),
                &mut buffers.rays.numbers,
            );
        } else {
            block::<V, SMALL_BLOCK>(
                map,
                &buffers.place,
                batch,
                (start, count),
                &mut buffers.rays.numbers,
            );
        }
    }
}

/// What becomes of a ray.
const PASSES: u32 = 0;
const IS_LOST: u32 = 1;
const IS_DOUBTFUL: u32 = 2;

#[repr(align(64))]
struct Aligned<T, const N: usize>([T; N]);

#[inline(always)]
fn block<V: Lanes, const N: usize>(
    map: &LensMap,
    place: &Place,
    batch: &mut RayBatch,
    (start, count): (usize, usize),
    doubtful: &mut Vec<usize>,
) {
    let load = |column, fill| load::<N>(column, (start, count), fill);
    let (ox, oy, oz) = (
        load(&batch.ox, 0.0),
        load(&batch.oy, 0.0),
        load(&batch.oz, 0.0),
    );
    let (dx, dy, dz) = (
        load(&batch.dx, 0.0),
        load(&batch.dy, 0.0),
        load(&batch.dz, -1.0),
    );
    let mut p = Aligned([0f32; N]);
    let mut q = Aligned([0f32; N]);
    let mut off = Aligned([[0f64; N]; 2]);
    let (o, c, z) = (place.origin, place.centre, map.pupil.z_mm);
    let (x_axis, y_axis) = (place.inverse.x_axis, place.inverse.y_axis);
    let (drift_x, drift_y) = (place.drift.x_axis, place.drift.y_axis);
    for i in 0..N {
        let t = (z - oz.0[i]) / dz.0[i];
        let (off_x, off_y) = (ox.0[i] - o.x, oy.0[i] - o.y);
        let x = ox.0[i] + t * dx.0[i] - (c.x + (drift_x.x * off_x + drift_y.x * off_y));
        let y = oy.0[i] + t * dy.0[i] - (c.y + (drift_x.y * off_x + drift_y.y * off_y));
        p.0[i] = (x_axis.x * x + y_axis.x * y) as f32;
        q.0[i] = (x_axis.y * x + y_axis.y * y) as f32;
        (off.0[0][i], off.0[1][i]) = (off_x, off_y);
    }
    let code = classes(map, place, (&p.0, &q.0), (&off.0, &dz.0));
    let (places, rest) = place.values.split_at(2 * terms(map.place_degree));
    let (slopes, changes) = rest.split_at(2 * terms(map.degree));
    let mut main = Aligned([[0f32; N]; OUTPUTS]);
    for (half, coefficients, degree) in [(0, places, map.place_degree), (2, slopes, map.degree)] {
        let mut two = Aligned([[0f32; N]; 2]);
        polynomial::<V, N, 2>(coefficients, degree, (&p.0, &q.0), &mut two.0);
        main.0[half..half + 2].copy_from_slice(&two.0);
    }
    let mut change = Aligned([[0f32; N]; CHANGES]);
    polynomial::<V, N, CHANGES>(changes, map.change_degree, (&p.0, &q.0), &mut change.0);
    let constants = &place.constants;
    let mut out = [[0f64; N]; OUTPUTS];
    for k in 0..OUTPUTS {
        let (constant, gx, gy) = (
            constants[k],
            constants[OUTPUTS + k],
            constants[2 * OUTPUTS + k],
        );
        for i in 0..N {
            let (x, y) = (off.0[0][i], off.0[1][i]);
            out[k][i] = constant
                + f64::from(main.0[k][i])
                + x * (gx + f64::from(change.0[k][i]))
                + y * (gy + f64::from(change.0[OUTPUTS + k][i]));
        }
    }
    let axes = map.scene.axes;
    let (e1, e2, e3, from) = (axes.x_axis, axes.y_axis, axes.z_axis, map.scene.origin_mm);
    let mut ray = Aligned([[0f64; N]; 6]);
    for i in 0..N {
        let (x, y, sx, sy) = (out[0][i], out[1][i], out[2][i], out[3][i]);
        let length = 1.0 / (1.0 + sx * sx + sy * sy).sqrt();
        let origin: DVec3 = from + e1 * x + e2 * y;
        let direction: DVec3 = (e1 * sx + e2 * sy + e3) * length;
        (ray.0[0][i], ray.0[1][i], ray.0[2][i]) = (origin.x, origin.y, origin.z);
        (ray.0[3][i], ray.0[4][i], ray.0[5][i]) = (direction.x, direction.y, direction.z);
    }
    let came = [&ox.0, &oy.0, &oz.0, &dx.0, &dy.0, &dz.0];
    let mut passes = Aligned([0u64; N]);
    for i in 0..N {
        passes.0[i] = u64::from(code.0[i] == PASSES).wrapping_neg();
    }
    for (ray, came) in ray.0.iter_mut().zip(came) {
        for i in 0..N {
            // By bits: a select of what is loaded becomes a branch.
            let bits = (ray[i].to_bits() & passes.0[i]) | (came[i].to_bits() & !passes.0[i]);
            ray[i] = f64::from_bits(bits);
        }
    }
    let columns = [
        &mut batch.ox,
        &mut batch.oy,
        &mut batch.oz,
        &mut batch.dx,
        &mut batch.dy,
        &mut batch.dz,
    ];
    for (column, ray) in columns.into_iter().zip(&ray.0) {
        store(ray, column, (start, count));
    }
    let (mut status, mut surface, mut any) = ([0u8; N], [0u16; N], 0);
    for i in 0..N {
        let lost = code.0[i] == IS_LOST;
        status[i] = if lost { RayStatus::Vignetted as u8 } else { 0 };
        surface[i] = if lost { map.stop } else { 0 };
        any |= code.0[i] & IS_DOUBTFUL;
    }
    store(&status, &mut batch.status, (start, count));
    store(&surface, &mut batch.surface, (start, count));
    if any != 0 {
        let each = code.0[..count].iter().enumerate();
        doubtful.extend(
            each.filter(|(_, c)| **c == IS_DOUBTFUL)
                .map(|(i, _)| start + i),
        );
    }
}

#[inline(always)]
fn load<const N: usize>(
    column: &[f64],
    (start, count): (usize, usize),
    fill: f64,
) -> Aligned<f64, N> {
    let column = &column[start..start + count];
    // A whole block is moved without a call.
    if let Ok(whole) = <[f64; N]>::try_from(column) {
        return Aligned(whole);
    }
    let mut out = Aligned([fill; N]);
    out.0[..count].copy_from_slice(column);
    out
}

/// Writes a block's lanes back.
#[inline(always)]
fn store<T: Copy, const N: usize>(
    lanes: &[T; N],
    column: &mut [T],
    (start, count): (usize, usize),
) {
    let column = &mut column[start..start + count];
    match <&mut [T; N]>::try_from(&mut *column) {
        Ok(whole) => *whole = *lanes,
        Err(_) => column.copy_from_slice(&lanes[..count]),
    }
}

/// What becomes of each ray.
#[inline(always)]
fn classes<const N: usize>(
    map: &LensMap,
    place: &Place,
    (p, q): (&[f32; N], &[f32; N]),
    (off, dz): (&[[f64; N]; 2], &[f64; N]),
) -> Aligned<u32, N> {
    let (mut whole, mut part, mut far) = ([0i32; N], [0f32; N], [0f32; N]);
    for i in 0..N {
        let (t, distance) = direction(p[i], q[i]);
        let last = (DIRECTIONS - 1) as f32;
        // A NaN goes to 0.
        let floor = if t >= 0.0 {
            if t <= last { t } else { last }
        } else {
            0.0
        };
        // SAFETY: within 0 and 255.
        whole[i] = unsafe { floor.to_int_unchecked::<i32>() };
        part[i] = t - whole[i] as f32;
        far[i] = distance;
    }
    let (mut low, mut high, mut corner) = ([0f32; N], [0f32; N], [0f32; N]);
    for i in 0..N {
        let k = whole[i] as usize % DIRECTIONS;
        (low[i], high[i]) = (place.edge.reach[k], place.edge.reach[k + 1]);
        corner[i] = place.edge.corner[k];
    }
    let mut code = Aligned([0u32; N]);
    let [here, beside] = place.band;
    let (far_mm, per_reach) = (map.far_mm, 1.0 / map.reach_mm);
    for i in 0..N {
        let edge = low[i] + part[i] * (high[i] - low[i]);
        let (off_x, off_y) = (off[0][i].abs(), off[1][i].abs());
        let way = if off_x > off_y { off_x } else { off_y };
        let near = (way <= far_mm) & (dz[i] < 0.0);
        // What a straight line leaves grows as the square of the way.
        let reaches = (way * per_reach) as f32;
        let growth = if reaches > 1.0 { reaches } else { 1.0 };
        let band = here + (beside - here) * (reaches * growth);
        // Written so that a NaN is doubtful.
        let inside = far[i] <= edge - band;
        let outside = far[i] >= edge + band + corner[i];
        code.0[i] = if near & inside {
            PASSES
        } else if near & outside {
            IS_LOST
        } else {
            IS_DOUBTFUL
        };
    }
    code
}
