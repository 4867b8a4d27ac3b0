//! The `rcwa` level: Fourier modal solution of Maxwell's equations for one period of the pixel.
//!
//! ```text
//!   order 0 in air, s and p
//!   ──────────────────────  lens.rs     slices: admittance from below, by matrices alone
//!   ──────────────────────  layers.rs   uniform layers order by order (uniform.rs); walls by their modes (grid.rs)
//!   █│█████│█████│█████│██  silicon.rs  modes of silicon and trenches, class by class; absorption of each photodiode
//! ```
//! `column.rs` stacks them; everything is matrices over the orders of `basis.rs`, halved by each mirror of pixel and
//! wave. Lengths inside are in units of 1/k0; z points down; time convention e^(−iωt). One direction is one thread's.
//! Under a mosaic of colour filters the period is 2×2 microlenses (`supercell.rs`): lens and silicon stay as they are,
//! class by class; the filters couple all. Under many shifts of the lens (`shifts.rs`) a direction is solved once: lens
//! (`free_lens.rs`) and what lies below it (`forms.rs`: what the photodiodes absorb) meet with other phases.
//!
//! # What makes it fast
//!
//! Silicon needs many orders, and its modes cost their number cubed. But its trenches part every sub-pixel alike: it
//! has half of a quad pixel's period, and couples a quarter of the orders at a time, one sixteenth of the work. The
//! lens needs few orders but many slices, which here take no modes. Li's rule for the trenches halves the number of
//! orders. Measured errors and times: `benches/runs/2026-11-21/rcwa.md`.

mod basis;
mod block;
mod checker;
mod column;
mod detector;
mod fields;
mod forms;
mod free_lens;
mod grid;
mod layers;
mod lens;
mod lighting;
mod linear;
mod model;
mod powers;
mod quadrature;
mod settings;
mod shifts;
mod silicon;
mod solver;
mod supercell;
mod uniform;

pub use fields::PhotodiodeFields;
pub use model::{MODEL, RcwaModel};
pub use settings::RcwaSettings;
pub(super) use solver::RcwaSolver;

use crate::em::SolverError;
