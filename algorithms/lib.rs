//! Algorithms on images of pixels that see the pupil in parts, in the order in which they are used.
//!
//! ```text
//! mosaic ─ sai ─▶ views ─ disparity ─▶ shifts ─ field ─▶ smooth field (─ centroid ─▶ of the spots' centroids) ─ warp ─▶ corrected views ─ sum ─▶ metrics
//! ```
//!
//! They see pictures and sub-pixel layouts only, never the scene, the lens or the pixel model: no truth can leak in.

pub mod aberration_score;
pub mod autofocus;
pub mod calibrated_camera;
pub mod calibration;
pub mod camera;
pub mod capture;
pub mod centroid;
pub mod correct;
pub mod depth;
pub mod disparity;
pub mod field;
pub mod load;
pub mod map_channels;
pub mod maps;
pub mod metrics;
pub mod pictures;
#[cfg(test)]
#[path = "../tests/common/random.rs"]
mod random;
pub mod refocus;
pub mod sai;
pub mod table;
pub mod trust;
pub mod warp;
