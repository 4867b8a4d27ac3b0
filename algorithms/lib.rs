//! Algorithms on images of pixels that see the pupil in parts, in the order in which they are used.
//!
//! ```text
//! mosaic ─ sai ─▶ views ─ disparity ─▶ shifts ─ field, centroid ─▶ smooth field ─ warp ─▶ corrected views ─▶ metrics
//!                   ├─ dense: two different blurs ─▶ disparity and its deviation at every pixel
//!                   └─ depth: shifts of opposite halves, and what the camera says of itself ─▶ metres
//! ```
//!
//! They see pictures, sub-pixel layouts and a [`CameraDescription`](quadpixel_datasets::CameraDescription), never the
//! scene, the lens or the pixel model: no truth can leak in. What compares an estimate with a truth reads it by itself,
//! afterwards: [`depth::DepthScore`], [`aberration_score`], [`metrics::disparity_error`].
//!
//! # Match and correct
//!
//! Views are matched against each other, the shifts are fitted by a smooth field, and each view is warped by its field.
//!
//! ```
//! use quadpixel::image::Image;
//! use quadpixel_algorithms::disparity::{MatchSettings, match_images};
//! use quadpixel_algorithms::field::{Loss, SmoothField};
//! use quadpixel_algorithms::warp::{Border, Lobes, Map, warp};
//! use quadpixel::simd::SimdLevel;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Two views of a smooth pattern: what lies at x in the left one lies at x + 0.6 px in the right one.
//! let view = |shift: f32| {
//!     let value = |i: usize| {
//!         let (x, y) = ((i % 64) as f32 - shift, (i / 64) as f32);
//!         0.5 + 0.2 * (0.7 * x + 0.2 * y).sin() + 0.2 * (0.3 * x - 0.6 * y).cos()
//!     };
//!     Image::from_vec(64, 64, 1, (0..64 * 64).map(value).collect()).expect("64 × 64 values")
//! };
//! let (left, right) = (view(0.0), view(0.6));
//!
//! let matched = match_images(&left, &right, &MatchSettings::default())?;
//! let fit = SmoothField::fit(&matched.observations(), 1, Loss::Huber)?;
//! let [dx, dy] = fit.field.at([32.0, 32.0]);
//! assert!((dx - 0.6).abs() < 0.02 && dy.abs() < 0.02);
//!
//! // The right view, corrected, is the left one.
//! let moved = |x: usize, y: usize| {
//!     let [dx, dy] = fit.field.at([x as f64, y as f64]);
//!     (x as f64 + dx, y as f64 + dy)
//! };
//! let map = Map::from_fn(64, 64, moved)?;
//! let corrected = warp(&right, &map, Lobes::Four, Border::Replicate, SimdLevel::detect());
//! let difference = corrected.image.pixel(32, 32)[0] - left.pixel(32, 32)[0];
//! assert!(difference.abs() < 0.01);
//! # Ok(())
//! # }
//! ```
//!
//! From files it begins with [`capture::Capture::read`].

pub mod aberration_score;
pub mod autofocus;
pub mod calibrated_camera;
pub mod calibration;
pub mod camera;
pub mod capture;
pub mod centroid;
pub mod correct;
pub mod dense;
pub mod depth;
pub mod disparity;
pub mod field;
pub mod load;
pub mod map_channels;
pub mod maps;
pub mod metrics;
pub mod pictures;
pub mod plane_error;
#[cfg(test)]
#[path = "../tests/common/random.rs"]
mod random;
pub mod refocus;
pub mod sai;
pub mod table;
pub mod trust;
pub mod view_pair;
pub mod warp;
