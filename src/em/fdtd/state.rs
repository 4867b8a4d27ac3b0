//! The fields of one member.

use super::layout::{Layout, VECTOR};
use super::member::{Lateral, Wall};
use super::sides::{Side, e_beyond};
use super::{Member, coefficients::Coefficients};

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

/// Size of the noise that fields start with, against currents of about 1.
const NOISE: f32 = 1e-20;

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

    fn new(layout: &Layout, nz: usize, absorbing: usize, polar: [usize; 2], part: usize) -> Self {
        let mut made = 6 * part;
        let mut zeros = |layers| {
            made += 1;
            Aligned::zeros(layout.places(layers), 5 * made)
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

/// The current sheet on its plane.
pub(super) struct Sheet {
    /// By part, by component (Jx, Jy): amplitude of each node (i, j), rows of `width`, zero beyond the nodes.
    pub amplitude: Vec<[Vec<f32>; 2]>,
}

/// One member's fields and sides.
pub(super) struct State {
    pub member: Member,
    pub sides: [Side; 2],
    pub sets: Vec<Set>,
    pub sheet: Sheet,
    /// A row for the sum over poles.
    pub scratch: Aligned,
}

impl State {
    pub fn new(
        member: Member,
        layout: &Layout,
        nz: usize,
        absorbing: usize,
        coefficients: &Coefficients,
    ) -> Self {
        let mut state = Self {
            member,
            sides: [Side::new(member.x), Side::new(member.y)],
            sets: (0..member.sets())
                .map(|part| Set::new(layout, nz, absorbing, coefficients.polar, part))
                .collect(),
            sheet: Sheet::new(&member, layout),
            scratch: Aligned::zeros(layout.width, 0),
        };
        state.seed(layout, nz);
        state
    }

    /// Starts E with noise of 1e-20: ahead of a pulse the fields of an empty grid are so small (below 1e-38) that the
    /// CPU takes ten times as long for each, which halved the speed of the first thousands of steps.
    fn seed(&mut self, layout: &Layout, nz: usize) {
        // Nodes on walls stay zero.
        let [from_x, from_y] =
            [self.member.x, self.member.y].map(|side| usize::from(side.is_mirror()));
        let mut hash = 1u32;
        for k in 1..nz {
            for j in from_y..layout.ny {
                for i in from_x..layout.nx {
                    for field in self.sets.iter_mut().flat_map(|set| &mut set.e) {
                        // Numerical Recipes' quick generator.
                        hash = hash.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        let value = (hash >> 8) as f32 / (1 << 24) as f32 - 0.5;
                        field[layout.at(k, j as isize) + i] = NOISE * value;
                    }
                }
            }
            e_beyond(&mut self.sets, self.sides, layout, k);
        }
    }
}

impl Sheet {
    fn new(member: &Member, layout: &Layout) -> Self {
        let phase = |lateral| match lateral {
            Lateral::Bloch { phase_rad } => phase_rad,
            Lateral::Mirror(_) => 0.0,
        };
        let turn = [
            phase(member.x) / layout.nx as f64,
            phase(member.y) / layout.ny as f64,
        ];
        let row = |part: usize, axis: usize| {
            let mut amplitude = vec![0.0; layout.width * layout.rows];
            for j in 0..layout.rows {
                for i in 0..layout.lanes {
                    // Jx stands half a step to the right, Jy half a step up; on an electric wall there is no current
                    // along it.
                    let (x, y) = match axis {
                        0 => (i as f64 + 0.5, j as f64),
                        _ => (i as f64, j as f64 + 0.5),
                    };
                    let beyond = (axis == 0 && i == layout.nx) || (axis == 1 && j == layout.ny);
                    let shorted = match axis {
                        0 => member.y == Lateral::Mirror(Wall::Electric) && j % layout.ny == 0,
                        _ => member.x == Lateral::Mirror(Wall::Electric) && i % layout.nx == 0,
                    };
                    if !beyond && !shorted {
                        let angle = turn[0] * x + turn[1] * y;
                        let wave = if part == 0 { angle.cos() } else { angle.sin() };
                        amplitude[j * layout.width + i] = (member.current[axis] * wave) as f32;
                    }
                }
            }
            amplitude
        };
        Self {
            amplitude: (0..member.sets())
                .map(|part| [row(part, 0), row(part, 1)])
                .collect(),
        }
    }
}
