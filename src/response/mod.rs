//! What a pixel does with light that arrives from (u, v): the one seam between pixel physics and rendering.
//!
//! Every pixel model gives P_i(u, v), the power absorbed in sub-pixel i's photodiode over `irradiance × pitch² × cos θ`,
//! so 0 ≤ P_i and Σ P_i ≤ 1. The renderer asks a [`ResponseLookup`] and knows nothing of what is behind it:
//!
//! ```text
//! PixelStack ── em::wave, em::rcwa, em::fdtd ── build ──▶ table ──┐
//! file (.npz), import (.csv), cache, shipped ──▶ table  ├─▶ Response ─ at a wavelength ─▶ ResponseLookup ─▶ weights
//! GeometricResponse (eq. 2, exact) ─────────────────────┘
//! ```

mod build;
mod cache;
mod error;
mod file;
mod frame;
mod geometric;
mod import;
mod interpolator;
mod journal;
mod lookup;
mod plane_wave;
mod rejection;
mod resample;
mod settings;
mod shipped;
mod symmetry;
mod table;

pub use build::{BuildReport, BuiltTable, build_table};
pub use cache::{CacheWarning, CachedTable, PartOfTable, ResponseCache};
pub use error::ResponseError;
pub use frame::MovingFrame;
pub use geometric::GeometricResponse;
pub use import::ImportSettings;
pub use interpolator::Interpolator;
pub use lookup::{Response, ResponseLookup};
pub use plane_wave::{LitPixel, PlaneWaveAnswer, Powers, direction_cosines};
pub use rejection::{REJECTION_THRESHOLD, RejectionRanges};
pub use settings::{PixelModel, TableSettings};
pub use table::{AngularResponse, ResponseAxes, ResponseMeta};
