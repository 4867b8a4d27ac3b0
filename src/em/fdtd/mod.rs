//! The `fdtd` level: Maxwell's equations in time on a Yee grid, for one period of the pixel.
//!
//! ```text
//!   grid, medium ─▶ coefficients ─┐    members: sides (Bloch phase or mirrors) and polarization of each run of a batch
//!   member, source, cpml ─────────┴▶ simulation ─ advance ─▶ rows of E and H
//!                                     ├ sweep   rows by vectors, several steps deep (kernel, sides)
//!                                     └ plain   node by node: the oracle, equal to the bit
//! ```
//! Units: c = ε0 = μ0 = 1, lengths in µm, so time is in µm/c and ω, σ in 1/µm; fields f32, set-up and sums f64. Time
//! convention e^(−iωt). Light travels to −z. A simulation is stepped by one thread; directions are what runs in
//! parallel.
//!
//! # The floor, and how near it is
//!
//! A real cell step needs 42 additions and multiplications (18 for H, 24 for E), 36 loads and 6 stores of the
//! first-level cache; by AVX-512 with two loads and two sums a cycle that is 1.3 cycles, 2 G cells/s at 2.6 GHz. From
//! the second-level cache it takes 64 bytes (six components in and out, E from above, H from below): at half of 64
//! bytes a cycle 1.3 G cells/s. From memory 48 bytes for every pass, which at 15 GB/s bounds a stepper without passes
//! to 0.3 G cells/s; with passes of d steps (`sweep` takes up to eight while the layers fit into 1 MiB) to d times
//! that. A complex cell is two real ones. The coefficients take next to nothing: rows of equal media are stored once.
//! Layers with far nodes take ten sums and products more a cell. Measured before these were there (`benches/fdtd.rs`, a
//! shared machine): 0.77 G real and 0.28 to 0.35 G complex cells/s on grids of 62 × 62, absorbing layers and source
//! included; 0.45 to 0.55 and 0.20 on 140 × 140, where a complex pass is one step deep. Two poles in silicon halve it.

mod answer;
mod cell;
mod coefficients;
mod cpml;
mod dispersion;
mod error;
mod fields;
mod fills;
mod footprint;
mod grid;
mod incident;
mod kernel;
mod layout;
mod matter;
mod medium;
mod member;
mod mesh;
mod monitored;
mod palette;
mod phasors;
mod plain;
mod poles;
mod powers;
mod pulse;
mod raster;
mod run;
mod settings;
mod shared;
mod sides;
mod simulation;
mod solver;
mod source;
mod state;
mod sweep;

pub use answer::{BALANCE, FdtdRun};
pub use coefficients::stable_step_um;
pub use cpml::CpmlSettings;
pub use fields::{Component, Part};
pub use grid::{Stencil, YeeGrid};
pub use medium::{MaterialMap, Medium, Pole};
pub use member::{Lateral, Member, Wall};
pub use run::{CHECK_UM, MODEL, solve};
pub use settings::FdtdSettings;
pub use simulation::{Domain, Simulation};
pub(super) use solver::FdtdSolver;
pub use source::{Source, Waveform};

use crate::em::SolverError;
