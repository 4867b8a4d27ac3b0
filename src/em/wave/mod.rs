//! The `wave` level: scalar waves through the whole pixel, with absorption per sub-pixel.
//!
//! ```text
//!   plane wave (u, v)
//!   ─────────────────  lens.rs     full scalar field in the lens by FFT (Lippmann-Schwinger), reflections included
//!   ─────────────────  planar.rs   flat layers: each plane-wave order through them (transfer matrix)
//!   █│████│████│█████  silicon.rs  modes of the trenched silicon; absorption of each photodiode
//! ```
//! One pixel repeats (single.rs), or four under a mosaic of colour filters (mosaic.rs).
//!
//! Bloch-periodic: neighbours' light is in it. One scalar run stands for the mean of both polarizations: interfaces
//! reflect the mean power of s and p. It began as FFT propagation through a microlens (Brenner & Singer, Appl. Opt. 32,
//! 4984 (1993)); the volume equation keeps what a one-way method loses: light thrown back by silicon and returned by
//! the lens is a tenth of all.
//!
//! Against vector solutions of six pixels (`tests/response/curves.rs`; θ to 40°, standard settings) the ratio of weak
//! to strong half crosses 0.2 within 1.0°, the strong half is within 8 % (mostly 3 %), the weak half within 0.03, and
//! within 0.04 on the slope where light goes over to the neighbour. On flat layers at 40° it is 6 % off: see the slab
//! test. Not for metals (tungsten walls): a scalar wave does not know their polarization.

mod absorption;
mod budget;
mod kept_modes;
mod krylov;
mod lens;
mod mask;
mod modes;
mod mosaic;
mod planar;
mod settings;
mod silicon;
mod single;
mod spectral;
mod surface;

pub use mosaic::WaveMosaic;
pub use settings::WaveSettings;
pub use single::WaveModel;

/// Name and version of the model: part of every table's key, so a change of the physics changes the key.
pub const MODEL: &str = "wave-2";

/// Residual at which the amplitudes of the trench modes are accepted.
const MATCHING_TOLERANCE: f64 = 1e-4;
