//! What a pixel does with light that arrives from (u, v): the one seam between pixel physics and rendering.
//!
//! Every pixel model gives P_i(u, v), the power absorbed in sub-pixel i's photodiode over `irradiance × pitch² × cos θ`,
//! so 0 ≤ P_i and Σ P_i ≤ 1. The renderer asks a [`ResponseLookup`] and knows nothing of what is behind it:
//!
//! ```text
//! PixelStack ── em::wave, em::rcwa, em::fdtd ── build ──▶ table ──┐      (at one or several wavelengths)
//! file (.npz), import (.csv), cache, shipped ──▶ table  ├─▶ Response ─ at a wavelength ─▶ ResponseLookup ─▶ weights
//! GeometricResponse (eq. 2, exact) ─────────────────────┘
//! ```

mod build;
mod build_shifted;
mod cache;
mod chief_ray;
mod corrected;
mod error;
mod file;
mod frame;
mod geometric;
mod import;
mod interpolator;
mod journal;
mod lookup;
mod mosaic;
mod plane_wave;
mod rejection;
mod resample;
mod settings;
mod shift_grid;
mod shifted_interpolator;
mod shifted_pixel;
mod shipped;
mod symmetry;
mod table;
mod wavelengths;

pub use build::{BuildReport, BuiltTable, build_table};
pub use build_shifted::{ShiftedSettings, build_shifted_table};
pub use cache::{CacheWarning, CachedTable, PartOfTable, ResponseCache};
pub use chief_ray::{ChiefRayShifts, FoundShift};
pub use corrected::{CorrectedSettings, Correction, CorrectionError, ExactRun, Incidence, spread};
pub use error::ResponseError;
pub use frame::MovingFrame;
pub use geometric::GeometricResponse;
pub use import::ImportSettings;
pub use interpolator::Interpolator;
pub use lookup::{Response, ResponseLookup};
pub use mosaic::{MosaicTables, build_mosaic_tables};
pub use plane_wave::{LitPixel, PlaneWaveAnswer, Powers, direction_cosines};
pub use rejection::{REJECTION_THRESHOLD, RejectionRanges};
pub use settings::{PixelModel, TableSettings};
pub use shift_grid::ShiftGrid;
pub use shifted_interpolator::ShiftedInterpolator;
pub use shifted_pixel::ShiftedPixel;
pub use table::{AngularResponse, ResponseAxes, ResponseMeta};
