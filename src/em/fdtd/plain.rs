//! The plain stepper: the equations node by node, all of H and then all of E. It is the oracle of [`super::sweep`],
//! which must give the same bits, and shares with it the coefficients of a medium and the order of operations, but
//! neither the rows of coefficients nor the places beyond the sides.

use super::coefficients::Vertical;
use super::fields::Set;
use super::shared::Shared;
use super::sides::{Side, e_beyond, turned};
use super::state::State;

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
        // Not for the stepping, which looks across the sides itself, but for who reads rows of E.
        e_beyond(&mut state.sets, state.sides, layout, k);
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
    let in_layer = shared.coefficients.in_layer[k];
    let on_plane = shared.coefficients.on_plane[k];
    let vertical = shared.coefficients.h_vertical[k];
    // H stands half a step on: its near nodes are its own and the next.
    let old = Reader {
        shared,
        state,
        part,
    };
    let e = |axis, along, step| old.value(Field::E(axis), node, along, step);
    let across = |axis, along, rates| difference(&|step| e(axis, along, step + 1), rates);
    let x_ey = if in_x { across(1, 0, on_plane.x) } else { 0.0 };
    let x_ez = if in_x { across(2, 0, in_layer.x) } else { 0.0 };
    let y_ex = if in_y { across(0, 1, on_plane.y) } else { 0.0 };
    let y_ez = if in_y { across(2, 1, in_layer.y) } else { 0.0 };
    let [z_ex, z_ey] = [0, 1].map(|axis| {
        let up = [i, j, k + 1];
        old.value(Field::E(axis), up, 0, 0) - e(axis, 0, 0)
    });

    let Set { h, psi_h, .. } = &mut state.sets[part];
    let mut none = [0.0; 2];
    let [psi_x, psi_y] = match shared.absorbing(k) {
        Some(slot) => psi_h
            .each_mut()
            .map(|psi| &mut psi[layout.at(slot, j as isize) + i]),
        None => none.each_mut(),
    };
    if in_y {
        h[0][at] -= y_ez - along_z(vertical, z_ey, psi_x);
    }
    if in_x {
        h[1][at] -= along_z(vertical, z_ex, psi_y) - x_ez;
    }
    if in_x && in_y {
        h[2][at] -= x_ey - y_ex;
    }
}

fn step_e(shared: &Shared, state: &mut State, part: usize, node: Node, current: f32) {
    let layout = &shared.layout;
    let [i, j, k] = node;
    let (in_x, in_y) = (i < layout.nx, j < layout.ny);
    let in_layer = shared.coefficients.in_layer[k];
    let on_plane = shared.coefficients.on_plane[k];
    let vertical = shared.coefficients.e_vertical[k];
    let old = Reader {
        shared,
        state,
        part,
    };
    let h = |axis, along, step| old.value(Field::H(axis), node, along, step);
    let across = |axis, along, rates| difference(&|step| h(axis, along, step), rates);
    let x_hy = across(1, 0, in_layer.x);
    let x_hz = across(2, 0, on_plane.x);
    let y_hx = across(0, 1, in_layer.y);
    let y_hz = across(2, 1, on_plane.y);

    if k > 0 {
        let at = layout.at(k, j as isize) + i;
        let below = layout.at(k - 1, j as isize) + i;
        let [z_hx, z_hy] =
            [0, 1].map(|axis| state.sets[part].h[axis][at] - state.sets[part].h[axis][below]);
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
            curl_x = y_hz - along_z(vertical, z_hy, psi_x);
        }
        if in_y {
            curl_y = along_z(vertical, z_hx, psi_y) - x_hz;
        }
        if in_x {
            step_material(shared, &mut state.sets[part], 0, node, curl_x);
        }
        if in_y {
            step_material(shared, &mut state.sets[part], 1, node, curl_y);
        }
        if k == shared.source_plane {
            for (axis, inside) in [(0, in_x), (1, in_y)] {
                if inside {
                    let cb = shared.medium_step(axis, node).cb;
                    let amplitude = state.sheet.amplitude[part][axis][j * layout.width + i];
                    state.sets[part].e[axis][at] -= cb * (amplitude * current);
                }
            }
        }
    }
    step_material(shared, &mut state.sets[part], 2, node, x_hy - y_hx);
}

/// E and the poles of one node; `curl` is dt curl H.
fn step_material(shared: &Shared, set: &mut Set, axis: usize, node: Node, curl: f32) {
    let [i, j, k] = node;
    let at = shared.layout.at(k, j as isize) + i;
    let medium = shared.medium_step(axis, node);
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

/// A component of E or H.
#[derive(Clone, Copy)]
enum Field {
    E(usize),
    H(usize),
}

/// A difference by its weights: `value(0)` and `value(−1)` are the near nodes, `value(1)` and `value(−2)` the far ones.
fn difference(value: &dyn Fn(isize) -> f32, [near, far]: [f32; 2]) -> f32 {
    let sum = (value(0) - value(-1)) * near;
    if far == 0.0 {
        return sum;
    }
    sum + (value(1) - value(-2)) * far
}

/// Fields of one part of a member as they are before a step.
struct Reader<'a> {
    shared: &'a Shared,
    state: &'a State,
    part: usize,
}

impl Reader<'_> {
    /// A component `step` nodes from `node` along x (0) or y (1), across the sides if need be.
    fn value(&self, field: Field, node: Node, along: usize, step: isize) -> f32 {
        let (state, layout) = (self.state, &self.shared.layout);
        let [i, j, k] = node;
        let at = |part: usize, place: isize| {
            let (i, j) = if along == 0 {
                (place, j as isize)
            } else {
                (i as isize, place)
            };
            let at = (layout.at(k, j) as isize + i) as usize;
            match field {
                Field::E(axis) => state.sets[part].e[axis][at],
                Field::H(axis) => state.sets[part].h[axis][at],
            }
        };
        let n = [layout.nx, layout.ny][along] as isize;
        let mut place = [i, j][along] as isize + step;
        let turn = |by: [f32; 2], value: &dyn Fn(usize) -> f32| -> f32 {
            if state.sets.len() == 1 {
                by[0] * value(0)
            } else {
                turned(value(0), value(1), by)[self.part]
            }
        };
        match state.sides[along] {
            Side::Bloch([c, s]) => {
                let periods = place.div_euclid(n);
                place -= periods * n;
                let by = if periods > 0 { [c, s] } else { [c, -s] };
                if periods == 0 {
                    at(self.part, place)
                } else {
                    turn(by, &|part| at(part, place))
                }
            }
            Side::Mirror(sign) => {
                let mut factor = 1.0;
                loop {
                    let (image, flip) = match field {
                        Field::E(_) if place < 0 => (-place, -sign),
                        Field::E(_) if place > n => (2 * n - place, -sign),
                        Field::H(_) if place < 0 => (-1 - place, sign),
                        Field::H(_) if place >= n => (2 * n - 1 - place, sign),
                        _ => return factor * at(self.part, place),
                    };
                    (place, factor) = (image, factor * flip);
                }
            }
        }
    }
}
