//! The `rcwa` level: Fourier modal solution of Maxwell's equations for one period of the pixel.
//!
//! ```text
//!   order 0 in air, s and p
//!   ──────────────────────  lens.rs     slices: admittance from below, by matrices alone
//!   ──────────────────────  layers.rs   uniform layers order by order (uniform.rs); walls by their modes (grid.rs)
//!   █│█████│█████│█████│██  silicon.rs  modes of silicon and trenches, class by class; absorption of each photodiode
//! ```
//! Everything between is matrices over the orders of [`basis`], halved by each mirror of pixel and wave. Lengths inside are in units of
//! 1/k0; z points down; time convention e^(−iωt).

mod answer;
mod basis;
mod error;
mod grid;
mod layers;
mod lens;
mod linear;
mod model;
mod quadrature;
mod settings;
mod silicon;
mod uniform;

pub use answer::{RcwaAnswer, RcwaPowers};
pub use error::RcwaError;
pub use model::{MODEL, RcwaModel};
pub use settings::RcwaSettings;
