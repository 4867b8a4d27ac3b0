//! What a pixel does with light that arrives from (u, v): the one seam between pixel physics and rendering.
//!
//! Every pixel model gives P_i(u, v), the power absorbed in sub-pixel i's photodiode over
//! `irradiance × pitch² × cos θ`, so 0 ≤ P_i and Σ P_i ≤ 1. The renderer asks a [`ResponseLookup`] and knows nothing of
//! what is behind it:
//!
//! ```text
//! PixelStack ── em's solvers ── tabulate ──▶ table ──┐      (at one or several wavelengths, of one or all lens shifts)
//! store: cache, file, import, shipped ─────▶ table   ├─▶ read: Response ─ at a wavelength ─▶ ResponseLookup ─▶ weights
//! GeometricResponse (eq. 2, exact) ──────────────────┘
//! ```

mod chief_ray_shifts;
mod error;
mod meta;
mod read;
mod rejection;
mod settings;
mod store;
mod table;
mod tabulate;
mod wavelengths;

pub use crate::em::geometric::GeometricResponse;
pub use chief_ray_shifts::{ChiefRayShifts, FoundShift};
pub use error::ResponseError;
pub use meta::{Provenance, ResponseMeta};
pub use read::{Interpolator, Response, ResponseLookup, ShiftedInterpolator};
pub use rejection::{REJECTION_THRESHOLD, RejectionRanges};
pub use settings::{ShiftSettings, TableSettings};
pub use store::{
    CacheWarning, CachedTable, CachedTables, ImportSettings, PartOfTable, ResponseCache,
};
pub use table::{AngularResponse, ResponseAxes};
pub use tabulate::{BuildReport, BuiltTable, TablePlan, build_table};
