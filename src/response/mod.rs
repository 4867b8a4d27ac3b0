//! What a pixel does with light that arrives from (u, v): the one seam between pixel physics and rendering.
//!
//! Every pixel model gives P_i(u, v), the power absorbed in sub-pixel i's photodiode over `irradiance × pitch² × cos θ`,
//! so 0 ≤ P_i and Σ P_i ≤ 1. The renderer asks a [`ResponseLookup`] and knows nothing of what is behind it:
//!
//! ```text
//! PixelStack ── em::wave ──▶ AngularResponse ──┐
//! file (.npz), cache ───────▶ (a table)        ├─▶ Response ─ at a wavelength ─▶ ResponseLookup ─▶ weights
//! GeometricResponse (eq. 2, exact) ────────────┘
//! ```

mod cache;
mod error;
mod file;
mod frame;
mod geometric;
mod interpolator;
mod lookup;
mod table;
mod wave;

pub use cache::{CacheWarning, ResponseCache};
pub use error::ResponseError;
pub use frame::MovingFrame;
pub use geometric::GeometricResponse;
pub use interpolator::Interpolator;
pub use lookup::{Response, ResponseLookup};
pub use table::{AngularResponse, ResponseAxes, ResponseMeta};
pub use wave::{WaveTable, wave_response};
