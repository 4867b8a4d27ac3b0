//! Arrays of the fields of one member.

use super::layout::{Layout, VECTOR};

/// A field component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum Component {
    Ex,
    Ey,
    Ez,
    Hx,
    Hy,
    Hz,
}

/// Which of a member's sets of fields; a real member has only [`Part::Re`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // their names say it
pub enum Part {
    Re,
    Im,
}

/// Numbers of 4 bytes in a page.
const PAGE: usize = 1024;

/// Numbers that start on a cache line.
pub(super) struct Aligned {
    data: Vec<f32>,
    start: usize,
    len: usize,
}

impl Aligned {
    /// `len` zeros that start `lines` cache lines into a page, or near: rows of components that are used together must
    /// not meet in the same lines of the first-level cache, which looks at the place within a page only.
    pub fn zeros(len: usize, lines: usize) -> Self {
        let data = vec![0.0f32; len + PAGE];
        // `align_offset` may decline; then rows are only slower.
        let page = data.as_ptr().align_offset(4 * PAGE);
        let start = (page % PAGE + lines * VECTOR) % PAGE;
        Self { data, start, len }
    }
}

impl std::ops::Deref for Aligned {
    type Target = [f32];
    #[inline(always)]
    fn deref(&self) -> &[f32] {
        &self.data[self.start..self.start + self.len]
    }
}

impl std::ops::DerefMut for Aligned {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.data[self.start..self.start + self.len]
    }
}

/// q = J dt and P of one pole.
pub(super) struct Polarization {
    pub q: Aligned,
    pub p: Aligned,
}

/// One set of real fields.
pub(super) struct Set {
    pub e: [Aligned; 3],
    pub h: [Aligned; 3],
    /// ψ of Ex, Ey in the absorbing layers.
    pub psi_e: [Aligned; 2],
    /// ψ of Hx, Hy in the absorbing layers.
    pub psi_h: [Aligned; 2],
    /// By component, by pole.
    pub poles: [Vec<Polarization>; 3],
}

impl Set {
    #[inline(always)]
    pub fn field(&self, component: Component) -> &Aligned {
        match component {
            Component::Ex => &self.e[0],
            Component::Ey => &self.e[1],
            Component::Ez => &self.e[2],
            Component::Hx => &self.h[0],
            Component::Hy => &self.h[1],
            Component::Hz => &self.h[2],
        }
    }

    #[inline(always)]
    pub fn field_mut(&mut self, component: Component) -> &mut Aligned {
        match component {
            Component::Ex => &mut self.e[0],
            Component::Ey => &mut self.e[1],
            Component::Ez => &mut self.e[2],
            Component::Hx => &mut self.h[0],
            Component::Hy => &mut self.h[1],
            Component::Hz => &mut self.h[2],
        }
    }

    pub fn new(
        layout: &Layout,
        nz: usize,
        absorbing: usize,
        polar: [usize; 2],
        part: usize,
    ) -> Self {
        let mut arrays = 6 * part;
        let mut zeros = |layers| {
            arrays += 1;
            Aligned::zeros(layout.places(layers), 5 * arrays)
        };
        let e = [zeros(nz + 1), zeros(nz + 1), zeros(nz + 1)];
        let h = [zeros(nz + 1), zeros(nz + 1), zeros(nz + 1)];
        let psi_e = [zeros(absorbing), zeros(absorbing)];
        let psi_h = [zeros(absorbing), zeros(absorbing)];
        let mut poles = [vec![], vec![], vec![]];
        for component in &mut poles {
            for _ in 0..polar[1] {
                component.push(Polarization {
                    q: zeros(polar[0]),
                    p: zeros(polar[0]),
                });
            }
        }
        Self {
            e,
            h,
            psi_e,
            psi_h,
            poles,
        }
    }
}

/// Bytes of one set of fields.
pub(super) fn set_bytes(layout: &Layout, nz: usize, absorbing: usize, polar: [usize; 2]) -> usize {
    let places = 6 * layout.places(nz + 1)
        + 4 * layout.places(absorbing)
        + 6 * polar[1] * layout.places(polar[0]);
    4 * places
}
