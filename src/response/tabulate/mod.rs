//! A table from a pixel solver.
//!
//! ```text
//! settings ─▶ plan ─▶ runs, shift_axis ─ solver ─▶ table_of_runs ─ resample ─▶ AngularResponse, report
//! ```

mod chief_ray;
mod plan;
mod report;
pub(super) mod resample;
mod runs;
mod shift_axis;
#[cfg(test)]
mod shifted_tests;
mod shipped_runs;
mod table_of_runs;
#[cfg(test)]
mod tests;

pub use plan::{TablePlan, build_table};
pub use report::{BuildReport, BuiltTable};
pub(super) use runs::RunJournal;
