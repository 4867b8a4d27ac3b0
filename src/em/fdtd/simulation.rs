//! A batch of runs on one grid: several members (polarizations, k∥) share the grid, the media and the coefficients.

use std::sync::Arc;

use super::coefficients::Coefficients;
use super::error::{refused, within};
use super::fields::{Component, Part, set_bytes};
use super::layout::Layout;
use super::shared::Shared;
use super::state::State;
use super::{CpmlSettings, MaterialMap, Member, SolverError, Source, YeeGrid, plain, sweep};
use crate::simd::SimdLevel;

/// What is stepped: a grid, its media and its absorbing ends.
#[derive(Clone, Debug)]
pub struct Domain {
    /// The grid.
    pub grid: YeeGrid,
    /// The media on it.
    pub map: Arc<MaterialMap>,
    /// The absorbing ends.
    pub cpml: CpmlSettings,
}

/// The runs, their fields and the time. Each is stepped by one thread; run several simulations for several directions
/// in parallel.
pub struct Simulation {
    shared: Shared,
    members: Vec<State>,
    source: Source,
    dt_um: f64,
    steps: u64,
}

impl Simulation {
    /// Fields of (almost, 1e-20) zero.
    ///
    /// # Errors
    /// A map of another grid, no member, members that differ in which axes have mirrors, a source in an absorbing layer
    /// or in a medium with poles, or `dt_um` above [`super::stable_step_um`].
    pub fn new(
        Domain { grid, map, cpml }: Domain,
        members: &[Member],
        source: Source,
        dt_um: f64,
    ) -> Result<Self, SolverError> {
        let layout = Self::layout(&grid, members)?;
        let coefficients = Coefficients::new(&grid, &map, &layout, &cpml, dt_um)?;
        within(
            "source plane",
            source.plane as f64,
            cpml.below.max(1) as f64,
            (grid.nz() - cpml.above.max(1)) as f64,
        )?;
        if coefficients.polar_layer[source.plane].is_some() {
            return Err(refused(
                "source plane",
                source.plane,
                "a plane without poles",
            ));
        }
        let absorbing = cpml.below + cpml.above;
        let states = members
            .iter()
            .map(|m| State::new(*m, &layout, grid.nz(), absorbing, &coefficients))
            .collect();
        Ok(Self {
            shared: Shared {
                source_plane: source.plane,
                grid,
                map,
                layout,
                coefficients,
                cpml,
            },
            members: states,
            source,
            dt_um,
            steps: 0,
        })
    }

    fn layout(grid: &YeeGrid, members: &[Member]) -> Result<Layout, SolverError> {
        let Some(first) = members.first() else {
            return Err(refused("members", 0, "at least one"));
        };
        let mirrors = |m: &Member| [m.x.is_mirror(), m.y.is_mirror()];
        for member in members {
            member.check()?;
            if mirrors(member) != mirrors(first) {
                return Err(refused(
                    "members",
                    "mirrored and periodic in one axis",
                    "all mirrored or all periodic in an axis",
                ));
            }
        }
        let [x, y] = mirrors(first);
        Ok(Layout::new(grid.nx(), grid.ny(), x, y))
    }

    /// Bytes of the fields of such a batch, with `polar` layers that hold media of up to `poles` poles. Maps and
    /// coefficients come on top: 6 bytes per cell for the map.
    ///
    /// # Errors
    /// No member, or members that differ in which axes have mirrors.
    pub fn bytes(
        grid: &YeeGrid,
        members: &[Member],
        cpml: &CpmlSettings,
        [polar, poles]: [usize; 2],
    ) -> Result<usize, SolverError> {
        let layout = Self::layout(grid, members)?;
        let set = set_bytes(&layout, grid.nz(), cpml.below + cpml.above, [polar, poles]);
        Ok(set * members.iter().map(Member::sets).sum::<usize>())
    }

    /// Steps forward in time: by AVX2 also where there is AVX-512, which is up to 9 % faster on one processor and 7
    /// to 37 % slower on another (`benches/runs/2026-11-28/speed.md`).
    pub fn advance(&mut self, steps: usize) {
        self.advance_at(steps, SimdLevel::detect().min(SimdLevel::Avx2));
    }

    /// As [`Self::advance`], with instructions up to `level`; they change the speed only.
    pub fn advance_at(&mut self, steps: usize, level: SimdLevel) {
        let currents = self.currents(steps);
        for member in &mut self.members {
            sweep::advance(&self.shared, member, &currents, level);
        }
        self.steps += steps as u64;
    }

    /// Steps forward in time with the plain stepper.
    pub fn advance_plain(&mut self, steps: usize) {
        for current in self.currents(steps) {
            for member in &mut self.members {
                plain::step(&self.shared, member, current);
            }
        }
        self.steps += steps as u64;
    }

    /// Waveform × dt / step of the source's plane, for the next steps.
    fn currents(&self, steps: usize) -> Vec<f32> {
        let dual = self.shared.grid.dual_um(self.shared.source_plane);
        (0..steps)
            .map(|n| {
                let t = (self.steps as f64 + n as f64 + 0.5) * self.dt_um;
                ((self.source.waveform)(t) * self.dt_um / dual) as f32
            })
            .collect()
    }

    /// The grid.
    pub fn grid(&self) -> &YeeGrid {
        &self.shared.grid
    }

    /// The media.
    pub fn map(&self) -> &MaterialMap {
        &self.shared.map
    }

    /// The members, in order.
    pub fn members(&self) -> impl ExactSizeIterator<Item = &Member> {
        self.members.iter().map(|s| &s.member)
    }

    /// Time step in µm/c.
    pub fn dt_um(&self) -> f64 {
        self.dt_um
    }

    /// Steps done. E is known at `steps × dt`, H half a step before.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Time of E in µm/c.
    pub fn time_um(&self) -> f64 {
        self.steps as f64 * self.dt_um
    }

    /// Row j of a component in layer k: E of plane k (0 to nz) or of layer k above it for Ez, with the nodes i = 0 … nx
    /// and rows j = 0 … ny, the far ones being those of the next period or on the far wall; H with i = 0 … nx − 1, j =
    /// 0 … ny − 1 (and Hx at i = nx, Hy at j = ny between mirrors). Entries that are no nodes hold nothing of meaning.
    /// `None` if there is no such part or row.
    pub fn row(
        &self,
        member: usize,
        part: Part,
        component: Component,
        j: usize,
        k: usize,
    ) -> Option<&[f32]> {
        let layout = &self.shared.layout;
        if j > layout.ny || k > self.shared.nz() {
            return None;
        }
        let set = self.members.get(member)?.sets.get(part as usize)?;
        let at = layout.at(k, j as isize);
        Some(&set.field(component)[at..at + layout.nx + 1])
    }
}
