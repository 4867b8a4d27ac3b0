//! The fast stepper: rows of H and E in one sweep through z, several time steps deep.
//!
//! ```text
//!   layer k ▲   step n+2   n+1    n     A front goes up through the layers. At front f step n takes layer f,
//!           │      ·        ·    [f]    step n+1 layer f − 1, and so on: each finds H below and E above at its time,
//!           │      ·      [f−1]   ■     so the bits are those of whole steps in turn. Layers stay in the second-level
//!           │    [f−2]      ■     ■     cache for all the steps of a pass.
//!           │      ■        ■     ■     Within a layer, all rows of H are followed by all rows of E.
//! ```

use super::fields::{Aligned, Polarization, Set};
use super::kernel::{
    BOTH, Curl, Difference, FIRST, NEITHER, Psi, SECOND, e_row, e_row_driven, h_row, pole_drive,
    pole_row,
};
use super::shared::Shared;
use super::sides::{e_beyond, h_beyond};
use super::state::State;
use crate::simd::SimdLevel;

/// What the layers of one pass may take of the second-level cache, in bytes (half of what a server core has, all of a
/// laptop's).
const CACHE_BYTES: usize = 1 << 20;

/// Most steps in a pass.
const DEEPEST: usize = 8;

/// Steps one member by `currents.len()` steps.
pub(super) fn advance(shared: &Shared, state: &mut State, currents: &[f32], level: SimdLevel) {
    let layer_bytes = state.sets.len() * 6 * 4 * shared.layout.layer();
    // Two layers more than steps are in use: E above the first, H below the last.
    let depth = (CACHE_BYTES / layer_bytes)
        .saturating_sub(2)
        .clamp(1, DEEPEST);
    for pass in currents.chunks(depth) {
        match level.min(SimdLevel::detect()) {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
            SimdLevel::Avx512 => unsafe { pass_avx512(shared, state, pass) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 => unsafe { pass_avx2(shared, state, pass) },
            _ => run_pass(shared, state, pass),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pass_avx2(shared: &Shared, state: &mut State, currents: &[f32]) {
    run_pass(shared, state, currents);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn pass_avx512(shared: &Shared, state: &mut State, currents: &[f32]) {
    run_pass(shared, state, currents);
}

#[inline(always)]
fn run_pass(shared: &Shared, state: &mut State, currents: &[f32]) {
    let nz = shared.nz();
    for front in 0..nz + currents.len() - 1 {
        for (behind, current) in currents.iter().enumerate() {
            if behind <= front && front - behind < nz {
                step_layer(shared, state, front - behind, *current);
            }
        }
    }
}

#[inline(always)]
fn step_layer(shared: &Shared, state: &mut State, k: usize, current: f32) {
    let layout = &shared.layout;
    for j in 0..layout.rows {
        h_rows(shared, &mut state.sets, j, k);
    }
    h_beyond(&mut state.sets, state.sides, layout, k);
    for j in 0..layout.rows {
        e_rows(shared, state, j, k, current);
    }
    e_beyond(&mut state.sets, state.sides, layout, k);
}

/// The difference of a field between the places `at` and `at` − `step`, and its far nodes one step outside.
#[inline(always)]
fn across(
    field: &Aligned,
    at: usize,
    step: usize,
    width: usize,
    rates: [f32; 2],
) -> Difference<'_> {
    Difference {
        near: [row(field, at, width), row(field, at - step, width)],
        rate: rates[0],
        far: [
            row(field, at + step, width),
            row(field, at - 2 * step, width),
        ],
        far_rate: rates[1],
    }
}

/// The difference of a field between the layers of the places `at` and `below`.
#[inline(always)]
fn along_z(field: &Aligned, at: usize, below: usize, width: usize, rate: f32) -> Difference<'_> {
    Difference {
        near: [row(field, at, width), row(field, below, width)],
        rate,
        far: [&[]; 2],
        far_rate: 0.0,
    }
}

/// Row j of H in layer k.
#[inline(always)]
fn h_rows(shared: &Shared, sets: &mut [Set], j: usize, k: usize) {
    let layout = &shared.layout;
    let at = layout.at(k, j as isize);
    let (up, back) = (at + layout.layer(), at + layout.stride);
    let (width, stride) = (layout.width, layout.stride);
    let in_layer = shared.coefficients.in_layer[k];
    let on_plane = shared.coefficients.on_plane[k];
    let vertical = shared.coefficients.h_vertical[k];
    for set in sets {
        let [ex, ey, ez] = &set.e;
        let [hx, hy, hz] = &mut set.h;
        let [psi_x, psi_y] = &mut set.psi_h;
        let curl_x = Curl {
            a: across(ez, back, stride, width, in_layer.y),
            b: along_z(ey, up, at, width, vertical.rate),
        };
        let curl_y = Curl {
            a: along_z(ex, up, at, width, vertical.rate),
            b: across(ez, at + 1, 1, width, in_layer.x),
        };
        let curl_z = Curl {
            a: across(ey, at + 1, 1, width, on_plane.x),
            b: across(ex, back, stride, width, on_plane.y),
        };
        let hx = row_mut(hx, at, width);
        let hy = row_mut(hy, at, width);
        match (vertical.stretch, shared.absorbing(k)) {
            (Some(bc), Some(slot)) => {
                let at = layout.at(slot, j as isize);
                let row = row_mut(psi_x, at, width);
                let x = Psi { row, bc };
                let row = row_mut(psi_y, at, width);
                let y = Psi { row, bc };
                if in_layer.is_wide() {
                    h_row::<SECOND, FIRST>(hx, curl_x, x);
                    h_row::<FIRST, SECOND>(hy, curl_y, y);
                } else {
                    h_row::<SECOND, NEITHER>(hx, curl_x, x);
                    h_row::<FIRST, NEITHER>(hy, curl_y, y);
                }
            }
            _ if in_layer.is_wide() => {
                h_row::<NEITHER, FIRST>(hx, curl_x, Psi::none());
                h_row::<NEITHER, SECOND>(hy, curl_y, Psi::none());
            }
            _ => {
                h_row::<NEITHER, NEITHER>(hx, curl_x, Psi::none());
                h_row::<NEITHER, NEITHER>(hy, curl_y, Psi::none());
            }
        }
        let hz = row_mut(hz, at, width);
        if on_plane.is_wide() {
            h_row::<NEITHER, BOTH>(hz, curl_z, Psi::none());
        } else {
            h_row::<NEITHER, NEITHER>(hz, curl_z, Psi::none());
        }
    }
}

#[inline(always)]
fn row(field: &Aligned, at: usize, width: usize) -> &[f32] {
    &field[at..at + width]
}

#[inline(always)]
fn row_mut(field: &mut Aligned, at: usize, width: usize) -> &mut [f32] {
    &mut field[at..at + width]
}

/// Row j of E in layer k, with the source.
#[inline(always)]
fn e_rows(shared: &Shared, state: &mut State, j: usize, k: usize, current: f32) {
    let layout = &shared.layout;
    let at = layout.at(k, j as isize);
    let (width, stride) = (layout.width, layout.stride);
    let in_layer = shared.coefficients.in_layer[k];
    let on_plane = shared.coefficients.on_plane[k];
    let vertical = shared.coefficients.e_vertical[k];
    let scratch = &mut state.scratch;
    let material = |axis| Material { shared, axis, j, k };
    for (part, set) in state.sets.iter_mut().enumerate() {
        let [hx, hy, hz] = &set.h;
        let [ex, ey, ez] = &mut set.e;
        let [psi_x, psi_y] = &mut set.psi_e;
        let [poles_x, poles_y, poles_z] = &mut set.poles;
        // Plane 0 is the conductor that ends the grid.
        if k > 0 {
            let below = at - layout.layer();
            let curl_x = Curl {
                a: across(hz, at, stride, width, on_plane.y),
                b: along_z(hy, at, below, width, vertical.rate),
            };
            let curl_y = Curl {
                a: along_z(hx, at, below, width, vertical.rate),
                b: across(hz, at, 1, width, on_plane.x),
            };
            let ex = row_mut(ex, at, width);
            let ey = row_mut(ey, at, width);
            match (vertical.stretch, shared.absorbing(k)) {
                (Some(bc), Some(slot)) => {
                    let at = layout.at(slot, j as isize);
                    let row = row_mut(psi_x, at, width);
                    let x = Psi { row, bc };
                    let row = row_mut(psi_y, at, width);
                    let y = Psi { row, bc };
                    if on_plane.is_wide() {
                        material(0).step::<SECOND, FIRST>(ex, curl_x, x, poles_x, scratch);
                        material(1).step::<FIRST, SECOND>(ey, curl_y, y, poles_y, scratch);
                    } else {
                        material(0).step::<SECOND, NEITHER>(ex, curl_x, x, poles_x, scratch);
                        material(1).step::<FIRST, NEITHER>(ey, curl_y, y, poles_y, scratch);
                    }
                }
                _ if on_plane.is_wide() => {
                    material(0).step::<NEITHER, FIRST>(ex, curl_x, Psi::none(), poles_x, scratch);
                    material(1).step::<NEITHER, SECOND>(ey, curl_y, Psi::none(), poles_y, scratch);
                }
                _ => {
                    material(0).step::<NEITHER, NEITHER>(ex, curl_x, Psi::none(), poles_x, scratch);
                    material(1).step::<NEITHER, NEITHER>(ey, curl_y, Psi::none(), poles_y, scratch);
                }
            }
            if k == shared.source_plane {
                for (axis, field) in [(0, ex), (1, ey)] {
                    let cb = &shared.coefficients.row(axis, j, k).cb;
                    let amplitude = &state.sheet.amplitude[part][axis][j * width..];
                    for ((value, cb), amplitude) in field.iter_mut().zip(cb).zip(amplitude) {
                        *value -= cb * (amplitude * current);
                    }
                }
            }
        }
        let curl_z = Curl {
            a: across(hy, at, 1, width, in_layer.x),
            b: across(hx, at, stride, width, in_layer.y),
        };
        let ez = row_mut(ez, at, width);
        if in_layer.is_wide() {
            material(2).step::<NEITHER, BOTH>(ez, curl_z, Psi::none(), poles_z, scratch);
        } else {
            material(2).step::<NEITHER, NEITHER>(ez, curl_z, Psi::none(), poles_z, scratch);
        }
    }
}

/// A row of E nodes and what they are made of.
struct Material<'a> {
    shared: &'a Shared,
    axis: usize,
    j: usize,
    k: usize,
}

impl Material<'_> {
    #[inline(always)]
    fn step<const STRETCHED: usize, const WIDE: usize>(
        self,
        e: &mut [f32],
        curl: Curl<'_>,
        psi: Psi<'_>,
        poles: &mut [Polarization],
        scratch: &mut Aligned,
    ) {
        let coefficients = &self.shared.coefficients;
        let row = coefficients.row(self.axis, self.j, self.k);
        let layer = match coefficients.polar_layer[self.k] {
            Some(layer) if !row.poles.is_empty() => layer,
            _ => return e_row::<STRETCHED, WIDE>(e, row, curl, psi),
        };
        let at = self.shared.layout.at(layer, self.j as isize);
        let places = at..at + e.len();
        scratch.fill(0.0);
        for (pole, polarization) in row.poles.iter().zip(&*poles) {
            let (q, p) = (
                &polarization.q[places.clone()],
                &polarization.p[places.clone()],
            );
            pole_drive(scratch, pole, q, p);
        }
        e_row_driven::<STRETCHED, WIDE>(e, row, curl, psi, scratch);
        for (pole, polarization) in row.poles.iter().zip(poles) {
            let Polarization { q, p } = polarization;
            pole_row(
                &mut q[places.clone()],
                &mut p[places.clone()],
                pole,
                scratch,
            );
        }
    }
}
