//! The fast stepper: rows of H and E in one sweep through z, several time steps deep.
//!
//! ```text
//!   layer k ▲   step n+2   n+1    n        A front goes up through the layers. At front f step n takes layer f, step n+1 layer
//!           │      ·        ·    [f]       f − 1, and so on: each finds H below and E above at its own time, so the bits are those
//!           │      ·      [f−1]   ■        of whole steps in turn. Layers stay in the second-level cache for all the steps of
//!           │    [f−2]      ■     ■        a pass.
//!           │      ■        ■     ■        Within a layer, row j of H is followed at once by row j of E.
//! ```

use super::kernel::{
    Curl, FIRST, NEITHER, Psi, SECOND, e_row, e_row_driven, h_row, pole_drive, pole_row,
};
use super::sides::{Side, e_beyond_x, e_row_beyond_y, h_beyond_x, h_row_beyond_y};
use super::simulation::Shared;
use super::state::{Aligned, Polarization, Set, State};
use crate::simd::SimdLevel;

/// What the layers of one pass may take of the second-level cache, in bytes (half of what a server core has, all of a laptop's).
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
    let last = layout.ny - 1;
    let [side_x, side_y] = state.sides;
    if let Side::Bloch([c, s]) = side_y {
        // Row 0 of E needs the last row of H.
        h_rows(shared, &mut state.sets, last, k);
        h_row_beyond_y(&mut state.sets, [c, -s], layout, k, [last as isize, -1]);
    }
    for j in 0..layout.rows {
        match side_y {
            Side::Bloch(_) if j == last => (),
            _ => h_rows(shared, &mut state.sets, j, k),
        }
        if let Side::Mirror(sign) = side_y {
            let images = [
                (0, [0, -1]),
                (layout.ny, [last as isize, layout.ny as isize]),
            ];
            for (_, rows) in images.into_iter().filter(|(at, _)| *at == j) {
                h_row_beyond_y(&mut state.sets, [sign, 0.0], layout, k, rows);
            }
        }
        h_beyond_x(&mut state.sets, side_x, layout, k, j);
        e_rows(shared, state, j, k, current);
        e_beyond_x(&mut state.sets, side_x, layout, k, j);
    }
    e_row_beyond_y(&mut state.sets, side_y, layout, k);
}

/// Row j of H in layer k.
#[inline(always)]
fn h_rows(shared: &Shared, sets: &mut [Set], j: usize, k: usize) {
    let layout = &shared.layout;
    let at = layout.at(k, j as isize);
    let (up, back) = (at + layout.layer(), at + layout.stride);
    let width = layout.width;
    let [rate_x, rate_y] = shared.coefficients.lateral;
    let vertical = shared.coefficients.h_vertical[k];
    for set in sets {
        let [ex, ey, ez] = &set.e;
        let [hx, hy, hz] = &mut set.h;
        let [psi_x, psi_y] = &mut set.psi_h;
        let curl_x = Curl {
            a: [row(ez, back, width), row(ez, at, width)],
            b: [row(ey, up, width), row(ey, at, width)],
            rates: [rate_y, vertical.rate],
        };
        let curl_y = Curl {
            a: [row(ex, up, width), row(ex, at, width)],
            b: [row(ez, at + 1, width), row(ez, at, width)],
            rates: [vertical.rate, rate_x],
        };
        let curl_z = Curl {
            a: [row(ey, at + 1, width), row(ey, at, width)],
            b: [row(ex, back, width), row(ex, at, width)],
            rates: [rate_x, rate_y],
        };
        let hx = row_mut(hx, at, width);
        let hy = row_mut(hy, at, width);
        match (vertical.stretch, shared.absorbing(k)) {
            (Some(bc), Some(slot)) => {
                let at = layout.at(slot, j as isize);
                let row = row_mut(psi_x, at, width);
                h_row::<SECOND>(hx, curl_x, Psi { row, bc });
                let row = row_mut(psi_y, at, width);
                h_row::<FIRST>(hy, curl_y, Psi { row, bc });
            }
            _ => {
                h_row::<NEITHER>(hx, curl_x, Psi::none());
                h_row::<NEITHER>(hy, curl_y, Psi::none());
            }
        }
        h_row::<NEITHER>(row_mut(hz, at, width), curl_z, Psi::none());
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
    let front = at - layout.stride;
    let width = layout.width;
    let [rate_x, rate_y] = shared.coefficients.lateral;
    let vertical = shared.coefficients.e_vertical[k];
    let scratch = &mut state.scratch;
    for (part, set) in state.sets.iter_mut().enumerate() {
        let [hx, hy, hz] = &set.h;
        let [ex, ey, ez] = &mut set.e;
        let [psi_x, psi_y] = &mut set.psi_e;
        let [poles_x, poles_y, poles_z] = &mut set.poles;
        // Plane 0 is the conductor that ends the grid.
        if k > 0 {
            let below = at - layout.layer();
            let curl_x = Curl {
                a: [row(hz, at, width), row(hz, front, width)],
                b: [row(hy, at, width), row(hy, below, width)],
                rates: [rate_y, vertical.rate],
            };
            let curl_y = Curl {
                a: [row(hx, at, width), row(hx, below, width)],
                b: [row(hz, at, width), row(hz, at - 1, width)],
                rates: [vertical.rate, rate_x],
            };
            let ex = row_mut(ex, at, width);
            let ey = row_mut(ey, at, width);
            match (vertical.stretch, shared.absorbing(k)) {
                (Some(bc), Some(slot)) => {
                    let at = layout.at(slot, j as isize);
                    let row = row_mut(psi_x, at, width);
                    Material {
                        shared,
                        axis: 0,
                        j,
                        k,
                    }
                    .step::<SECOND>(
                        ex,
                        curl_x,
                        Psi { row, bc },
                        poles_x,
                        scratch,
                    );
                    let row = row_mut(psi_y, at, width);
                    Material {
                        shared,
                        axis: 1,
                        j,
                        k,
                    }
                    .step::<FIRST>(
                        ey,
                        curl_y,
                        Psi { row, bc },
                        poles_y,
                        scratch,
                    );
                }
                _ => {
                    Material {
                        shared,
                        axis: 0,
                        j,
                        k,
                    }
                    .step::<NEITHER>(ex, curl_x, Psi::none(), poles_x, scratch);
                    Material {
                        shared,
                        axis: 1,
                        j,
                        k,
                    }
                    .step::<NEITHER>(ey, curl_y, Psi::none(), poles_y, scratch);
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
            a: [row(hy, at, width), row(hy, at - 1, width)],
            b: [row(hx, at, width), row(hx, front, width)],
            rates: [rate_x, rate_y],
        };
        Material {
            shared,
            axis: 2,
            j,
            k,
        }
        .step::<NEITHER>(
            row_mut(ez, at, width),
            curl_z,
            Psi::none(),
            poles_z,
            scratch,
        );
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
    fn step<const STRETCHED: usize>(
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
            _ => return e_row::<STRETCHED>(e, row, curl, psi),
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
        e_row_driven::<STRETCHED>(e, row, curl, psi, scratch);
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
