//! The plain stepper: the equations node by node, all of H and then all of E. It is the oracle of [`super::sweep`], which must give the same
//! bits, and shares with it the coefficients of a medium and the order of operations, but neither the rows of coefficients nor
//! the places beyond the sides.

use super::coefficients::Vertical;
use super::sides::{Side, e_beyond_x, e_row_beyond_y, turned};
use super::simulation::Shared;
use super::state::{Set, State};

type Node = [usize; 3];

/// One time step of one member; `current` is the waveform times dt over the step of the source's plane.
pub(super) fn step(shared: &Shared, state: &mut State, current: f32) {
    let layout = &shared.layout;
    for k in 0..shared.nz() {
        for j in 0..layout.rows {
            for i in 0..layout.lanes {
                for part in 0..state.sets.len() {
                    step_h(shared, state, part, [i, j, k]);
                }
            }
        }
    }
    for k in 0..shared.nz() {
        for j in 0..layout.rows {
            for i in 0..layout.lanes {
                for part in 0..state.sets.len() {
                    step_e(shared, state, part, [i, j, k], current);
                }
            }
        }
        for j in 0..layout.rows {
            e_beyond_x(&mut state.sets, state.sides[0], layout, k, j);
        }
        e_row_beyond_y(&mut state.sets, state.sides[1], layout, k);
    }
}

/// The difference of a curl along z, stretched in the absorbing layers.
fn along_z(vertical: Vertical, difference: f32, psi: &mut f32) -> f32 {
    match vertical.stretch {
        None => difference * vertical.rate,
        Some([b, c]) => {
            *psi = b * *psi + c * difference;
            difference * vertical.rate + *psi
        }
    }
}

fn step_h(shared: &Shared, state: &mut State, part: usize, node: Node) {
    let layout = &shared.layout;
    let [i, j, k] = node;
    let (in_x, in_y) = (i < layout.nx, j < layout.ny);
    let at = layout.at(k, j as isize) + i;
    let [rate_x, rate_y] = shared.coefficients.lateral;
    let vertical = shared.coefficients.h_vertical[k];
    let e = |axis, node| e_at(shared, state, part, axis, node);
    let [ex, ey, ez] = [0, 1, 2].map(|axis| e(axis, node));
    // Differences that leave the grid are not used below.
    let x_ey = if in_x { e(1, [i + 1, j, k]) - ey } else { 0.0 };
    let x_ez = if in_x { e(2, [i + 1, j, k]) - ez } else { 0.0 };
    let y_ex = if in_y { e(0, [i, j + 1, k]) - ex } else { 0.0 };
    let y_ez = if in_y { e(2, [i, j + 1, k]) - ez } else { 0.0 };
    let z_ex = e(0, [i, j, k + 1]) - ex;
    let z_ey = e(1, [i, j, k + 1]) - ey;

    let Set { h, psi_h, .. } = &mut state.sets[part];
    let mut none = [0.0; 2];
    let [psi_x, psi_y] = match shared.absorbing(k) {
        Some(slot) => psi_h
            .each_mut()
            .map(|psi| &mut psi[layout.at(slot, j as isize) + i]),
        None => none.each_mut(),
    };
    if in_y {
        h[0][at] -= y_ez * rate_y - along_z(vertical, z_ey, psi_x);
    }
    if in_x {
        h[1][at] -= along_z(vertical, z_ex, psi_y) - x_ez * rate_x;
    }
    if in_x && in_y {
        h[2][at] -= x_ey * rate_x - y_ex * rate_y;
    }
}

fn step_e(shared: &Shared, state: &mut State, part: usize, node: Node, current: f32) {
    let layout = &shared.layout;
    let [i, j, k] = node;
    let (in_x, in_y) = (i < layout.nx, j < layout.ny);
    let [rate_x, rate_y] = shared.coefficients.lateral;
    let vertical = shared.coefficients.e_vertical[k];
    let [hx, hy, hz] = [0, 1, 2].map(|axis| state.sets[part].h[axis][layout.at(k, j as isize) + i]);
    let left = |axis| h_left(shared, state, part, axis, node);
    let front = |axis| h_front(shared, state, part, axis, node);
    // At i = nx, j = ny there is H only as the image behind a mirror.
    let hy_here = if in_x {
        hy
    } else {
        h_right(shared, state, part, 1, node)
    };
    let hz_right = if in_x {
        hz
    } else {
        h_right(shared, state, part, 2, node)
    };
    let hx_here = if in_y {
        hx
    } else {
        h_back(shared, state, part, 0, node)
    };
    let hz_back = if in_y {
        hz
    } else {
        h_back(shared, state, part, 2, node)
    };
    let x_hy = hy_here - left(1);
    let x_hz = hz_right - left(2);
    let y_hx = hx_here - front(0);
    let y_hz = hz_back - front(2);

    if k > 0 {
        let below = layout.at(k - 1, j as isize) + i;
        let z_hx = hx - state.sets[part].h[0][below];
        let z_hy = hy - state.sets[part].h[1][below];
        let mut none = [0.0; 2];
        let [psi_x, psi_y] = match shared.absorbing(k) {
            Some(slot) => state.sets[part]
                .psi_e
                .each_mut()
                .map(|psi| &mut psi[layout.at(slot, j as isize) + i]),
            None => none.each_mut(),
        };
        // On the middle planes of ψ only the nodes that exist move on.
        let (mut curl_x, mut curl_y) = (0.0, 0.0);
        if in_x {
            curl_x = y_hz * rate_y - along_z(vertical, z_hy, psi_x);
        }
        if in_y {
            curl_y = along_z(vertical, z_hx, psi_y) - x_hz * rate_x;
        }
        if in_x {
            step_material(shared, state, part, 0, node, curl_x);
        }
        if in_y {
            step_material(shared, state, part, 1, node, curl_y);
        }
        if k == shared.source_plane {
            for (axis, inside) in [(0, in_x), (1, in_y)] {
                if inside {
                    let at = layout.at(k, j as isize) + i;
                    let cb = shared.medium_step(axis, node).cb;
                    let amplitude = state.sheet.amplitude[part][axis][j * layout.width + i];
                    state.sets[part].e[axis][at] -= cb * (amplitude * current);
                }
            }
        }
    }
    let curl_z = x_hy * rate_x - y_hx * rate_y;
    step_material(shared, state, part, 2, node, curl_z);
}

/// E and the poles of one node; `curl` is dt curl H.
fn step_material(
    shared: &Shared,
    state: &mut State,
    part: usize,
    axis: usize,
    node: Node,
    curl: f32,
) {
    let [i, j, k] = node;
    let at = shared.layout.at(k, j as isize) + i;
    let medium = shared.medium_step(axis, node);
    let set = &mut state.sets[part];
    let before = set.e[axis][at];
    let Some(slot) = shared.coefficients.polar_layer[k] else {
        set.e[axis][at] = medium.ca * before + medium.cb * curl;
        return;
    };
    let at_pole = shared.layout.at(slot, j as isize) + i;
    let mut drive = 0.0;
    for (pole, polarization) in medium.poles.iter().zip(&set.poles[axis]) {
        drive += pole.g * polarization.q[at_pole] - pole.h * polarization.p[at_pole];
    }
    let after = (medium.ca * before + medium.cb * curl) - drive;
    let sum = after + before;
    for (pole, polarization) in medium.poles.iter().zip(&mut set.poles[axis]) {
        let (q, p) = (polarization.q[at_pole], polarization.p[at_pole]);
        let next = (pole.alpha * q - pole.beta * p) + pole.xi * sum;
        polarization.q[at_pole] = next;
        polarization.p[at_pole] = p + 0.5 * (q + next);
    }
    set.e[axis][at] = after;
}

/// E of a node that may be the first one beyond the far sides.
fn e_at(shared: &Shared, state: &State, part: usize, axis: usize, [i, j, k]: Node) -> f32 {
    let layout = &shared.layout;
    let at = |i, j: usize| layout.at(k, j as isize) + i;
    let value = |part: usize, place: usize| state.sets[part].e[axis][place];
    let (place, factor) = match state.sides {
        [Side::Bloch(factor), _] if i == layout.nx => (at(0, j), factor),
        [_, Side::Bloch(factor)] if j == layout.ny => (at(i, 0), factor),
        _ => return value(part, at(i, j)),
    };
    fetch(state, part, factor, |part| value(part, place))
}

/// A value on the other side of the period, times the factor.
fn fetch(state: &State, part: usize, factor: [f32; 2], value: impl Fn(usize) -> f32) -> f32 {
    if state.sets.len() == 1 {
        factor[0] * value(0)
    } else {
        turned(value(0), value(1), factor)[part]
    }
}

/// H half a step to the left of an E node.
fn h_left(shared: &Shared, state: &State, part: usize, axis: usize, [i, j, k]: Node) -> f32 {
    let layout = &shared.layout;
    let value = |part: usize, i: usize| state.sets[part].h[axis][layout.at(k, j as isize) + i];
    if i > 0 {
        return value(part, i - 1);
    }
    match state.sides[0] {
        Side::Bloch([c, s]) => fetch(state, part, [c, -s], |part| value(part, layout.nx - 1)),
        Side::Mirror(sign) => fetch(state, part, [sign, 0.0], |part| value(part, 0)),
    }
}

/// H half a step in front (−y) of an E node.
fn h_front(shared: &Shared, state: &State, part: usize, axis: usize, [i, j, k]: Node) -> f32 {
    let layout = &shared.layout;
    let value = |part: usize, j: usize| state.sets[part].h[axis][layout.at(k, j as isize) + i];
    if j > 0 {
        return value(part, j - 1);
    }
    match state.sides[1] {
        Side::Bloch([c, s]) => fetch(state, part, [c, -s], |part| value(part, layout.ny - 1)),
        Side::Mirror(sign) => fetch(state, part, [sign, 0.0], |part| value(part, 0)),
    }
}

/// H behind the right mirror.
fn h_right(shared: &Shared, state: &State, part: usize, axis: usize, [i, j, k]: Node) -> f32 {
    image(
        state,
        part,
        0,
        axis,
        shared.layout.at(k, j as isize) + i - 1,
    )
}

/// H behind the far mirror in y.
fn h_back(shared: &Shared, state: &State, part: usize, axis: usize, [i, j, k]: Node) -> f32 {
    image(
        state,
        part,
        1,
        axis,
        shared.layout.at(k, j as isize - 1) + i,
    )
}

fn image(state: &State, part: usize, side: usize, axis: usize, place: usize) -> f32 {
    let Side::Mirror(sign) = state.sides[side] else {
        return 0.0;
    };
    fetch(state, part, [sign, 0.0], |part| {
        state.sets[part].h[axis][place]
    })
}
