//! What lies beyond the sides of the period, copied to the places that [`super::layout`] keeps for it.
//!
//! With p = e^(i phase): E(nx) = p E(0) and H(−1) = p* H(nx − 1). Behind a mirror tangential H is even (electric wall) or odd (magnetic):
//! H(−1) = ± H(0), H(nx) = ± H(nx − 1), while E on the wall is a node as any other; on an electric wall these images keep it at zero.

use super::layout::Layout;
use super::member::{Lateral, Wall};
use super::state::{Component, Set};

/// The factor between the two sides of an axis: cos and sin of the Bloch phase, or the sign of tangential H behind a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Side {
    Bloch([f32; 2]),
    Mirror(f32),
}

impl Side {
    pub fn new(lateral: Lateral) -> Self {
        match lateral {
            Lateral::Bloch { phase_rad } => {
                Self::Bloch([phase_rad.cos() as f32, phase_rad.sin() as f32])
            }
            Lateral::Mirror(Wall::Electric) => Self::Mirror(1.0),
            Lateral::Mirror(Wall::Magnetic) => Self::Mirror(-1.0),
        }
    }
}

/// (re, im) × (c + is).
#[inline(always)]
pub(super) fn turned(re: f32, im: f32, [c, s]: [f32; 2]) -> [f32; 2] {
    [c * re - s * im, s * re + c * im]
}

/// Copies `len` places of one component, times c + is.
#[inline(always)]
fn carry(sets: &mut [Set], component: Component, [from, to, len]: [usize; 3], factor: [f32; 2]) {
    match sets {
        [re, im] => {
            let (re, im) = (re.field_mut(component), im.field_mut(component));
            for i in 0..len {
                [re[to + i], im[to + i]] = turned(re[from + i], im[from + i], factor);
            }
        }
        sets => {
            for set in sets {
                let real = set.field_mut(component);
                for i in 0..len {
                    real[to + i] = factor[0] * real[from + i];
                }
            }
        }
    }
}

/// Sets Hy, Hz beyond the x sides of row j of layer k.
#[inline(always)]
pub(super) fn h_beyond_x(sets: &mut [Set], side: Side, layout: &Layout, k: usize, j: usize) {
    let at = layout.at(k, j as isize);
    let nx = layout.nx;
    for component in [Component::Hy, Component::Hz] {
        match side {
            Side::Bloch([c, s]) => carry(sets, component, [at + nx - 1, at - 1, 1], [c, -s]),
            Side::Mirror(sign) => {
                carry(sets, component, [at, at - 1, 1], [sign, 0.0]);
                carry(sets, component, [at + nx - 1, at + nx, 1], [sign, 0.0]);
            }
        }
    }
}

/// Sets E at node nx of row j of layer k from node 0.
#[inline(always)]
pub(super) fn e_beyond_x(sets: &mut [Set], side: Side, layout: &Layout, k: usize, j: usize) {
    let Side::Bloch(factor) = side else {
        return;
    };
    let at = layout.at(k, j as isize);
    for component in [Component::Ex, Component::Ey, Component::Ez] {
        carry(sets, component, [at, at + layout.nx, 1], factor);
    }
}

/// Sets a row of Hx, Hz from row `from`: row −1 or, behind a mirror, row ny.
#[inline(always)]
pub(super) fn h_row_beyond_y(
    sets: &mut [Set],
    factor: [f32; 2],
    layout: &Layout,
    k: usize,
    [from, to]: [isize; 2],
) {
    let places = [layout.at(k, from), layout.at(k, to), layout.lanes];
    carry(sets, Component::Hx, places, factor);
    carry(sets, Component::Hz, places, factor);
}

/// Sets row ny of E in layer k from row 0.
#[inline(always)]
pub(super) fn e_row_beyond_y(sets: &mut [Set], side: Side, layout: &Layout, k: usize) {
    let Side::Bloch(factor) = side else {
        return;
    };
    let places = [
        layout.at(k, 0),
        layout.at(k, layout.ny as isize),
        layout.nx + 1,
    ];
    carry(sets, Component::Ex, places, factor);
    carry(sets, Component::Ey, places, factor);
    carry(sets, Component::Ez, places, factor);
}
