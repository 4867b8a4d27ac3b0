//! What lies beyond the sides of the period, copied to the places that [`super::layout`] keeps for it.
//!
//! Two nodes deep, as far as the wide differences reach. With p = e^(i phase): E(nx + i) = p E(i), H(−1 − i) = p* H(nx
//! − 1 − i), and so on. Behind a mirror tangential H is even (electric wall) or odd (magnetic), H(−1 − i) = ± H(i),
//! H(nx + i) = ± H(nx − 1 − i), and tangential E the other way round: E(−1) = ∓ E(1), E(nx + 1) = ∓ E(nx − 1). E on the
//! wall is a node as any other; on an electric wall these images keep it at zero.

use super::fields::{Component, Set};
use super::layout::Layout;
use super::member::{Lateral, Wall};

/// The factor between the two sides of an axis: cos and sin of the Bloch phase, or the sign of tangential H behind a
/// wall.
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

/// A place beyond the sides, the place that its value comes from, and the factor.
type Image = (isize, isize, [f32; 2]);

/// The images of H along an axis of `n` cells, in the order in which they can be set (of a single cell some are images
/// of images).
#[inline(always)]
fn h_images(side: Side, n: usize) -> ([Image; 4], usize) {
    let n = n as isize;
    match side {
        Side::Bloch([c, s]) => {
            let none = (0, 0, [1.0, 0.0]);
            let back = [c, -s];
            (
                [(-1, n - 1, back), (-2, n - 2, back), (n, 0, [c, s]), none],
                3,
            )
        }
        Side::Mirror(sign) => {
            let f = [sign, 0.0];
            (
                [(-1, 0, f), (n, n - 1, f), (-2, 1, f), (n + 1, n - 2, f)],
                4,
            )
        }
    }
}

/// The images of tangential E.
#[inline(always)]
fn e_images(side: Side, n: usize) -> ([Image; 4], usize) {
    let n = n as isize;
    let none = (0, 0, [1.0, 0.0]);
    match side {
        Side::Bloch([c, s]) => {
            let on = [c, s];
            ([(n, 0, on), (n + 1, 1, on), (-1, n - 1, [c, -s]), none], 3)
        }
        Side::Mirror(sign) => {
            let f = [-sign, 0.0];
            ([(-1, 1, f), (n + 1, n - 1, f), none, none], 2)
        }
    }
}

fn place(row: usize, i: isize) -> usize {
    (row as isize + i) as usize
}

/// Sets H of layer k beyond all sides: Hy and Hz in x, Hx and Hz in y.
#[inline(always)]
pub(super) fn h_beyond(sets: &mut [Set], sides: [Side; 2], layout: &Layout, k: usize) {
    let (images, count) = h_images(sides[0], layout.nx);
    for j in 0..layout.rows {
        let row = layout.at(k, j as isize);
        for (to, from, factor) in &images[..count] {
            let places = [place(row, *from), place(row, *to), 1];
            carry(sets, Component::Hy, places, *factor);
            carry(sets, Component::Hz, places, *factor);
        }
    }
    let (images, count) = h_images(sides[1], layout.ny);
    for (to, from, factor) in &images[..count] {
        let places = [layout.at(k, *from), layout.at(k, *to), layout.lanes];
        carry(sets, Component::Hx, places, *factor);
        carry(sets, Component::Hz, places, *factor);
    }
}

/// Sets E of layer k beyond all sides; the first nodes beyond are those of the next period, in all components.
#[inline(always)]
pub(super) fn e_beyond(sets: &mut [Set], sides: [Side; 2], layout: &Layout, k: usize) {
    let (images, count) = e_images(sides[0], layout.nx);
    for j in 0..layout.rows {
        let row = layout.at(k, j as isize);
        for (to, from, factor) in &images[..count] {
            for component in [Component::Ex, Component::Ey, Component::Ez] {
                let places = [place(row, *from), place(row, *to), 1];
                carry(sets, component, places, *factor);
            }
        }
    }
    let (images, count) = e_images(sides[1], layout.ny);
    for (to, from, factor) in &images[..count] {
        let places = [layout.at(k, *from), layout.at(k, *to), layout.nx + 1];
        for component in [Component::Ex, Component::Ey, Component::Ez] {
            carry(sets, component, places, *factor);
        }
    }
}
