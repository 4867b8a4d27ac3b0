//! The `fdtd` level: Maxwell's equations in time on a Yee grid, for one period of the pixel.
//!
//! Units: c = ε0 = μ0 = 1, lengths in µm, so time is in µm/c and ω, σ in 1/µm; fields f32, set-up and sums f64. Time convention e^(−iωt).
//! Light travels to −z.

mod coefficients;
mod cpml;
mod dispersion;
mod error;
mod grid;
mod incident;
mod kernel;
mod layout;
mod medium;
mod member;
mod mesh;
mod phasors;
mod plain;
mod poles;
mod powers;
mod pulse;
mod raster;
mod run;
mod settings;
mod sides;
mod simulation;
mod source;
mod state;
mod sweep;

pub use coefficients::stable_step_um;
pub use cpml::CpmlSettings;
pub use error::FdtdError;
pub use grid::YeeGrid;
pub use medium::{MaterialMap, Medium, Pole};
pub use member::{Lateral, Member, Wall};
pub use run::{BALANCE, CHECK_UM, FdtdAnswer, FdtdPowers, FdtdProgress, FdtdRun, MODEL, solve};
pub use settings::FdtdSettings;
pub use simulation::Simulation;

pub use source::{Source, Waveform};
pub use state::{Component, Part};
