//! One member's fields, the sides of its period and its source.

use super::fields::{Aligned, Set};
use super::layout::Layout;
use super::member::{Lateral, Wall};
use super::sides::{Side, e_beyond};
use super::{Member, coefficients::Coefficients};

/// Size of the noise that fields start with, against currents of about 1.
const NOISE: f32 = 1e-20;

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
