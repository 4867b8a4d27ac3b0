//! Cameras whose pixels see the pupil in parts: from the scene, through a real lens and the microlenses, into the
//! sub-pixels. Modules stand in the order in which light travels.
//!
//! ```text
//! scene ─ rays ─▶ lens ─ rays ─▶ sensor ─ (u,v) ─▶ response ─ weights ─▶ render ─▶ SubPixelImage
//!                                                    ▲
//!                                     em (pixel stack, wave propagation, FDTD)
//! ```

pub mod command;
pub mod effects;
pub mod em;
pub mod field;
pub mod file;
pub mod frames;
pub mod hash;
pub mod image;
pub mod journal;
pub mod lens;
mod npz;
pub mod progress;
pub mod range;
pub mod rays;
pub mod render;
pub mod response;
pub mod sampling;
pub mod scene;
pub mod sensor;
pub mod shard;
pub mod simd;
pub mod spectrum;
pub mod units;

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct ReadmeExample;
