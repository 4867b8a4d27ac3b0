//! The renderer held to closed forms and to itself: radiometry, disparity and its sign, truths, and bytes that do not
//! depend on how the work is done.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

mod control;
mod disparity;
mod execution;
mod footprints;
mod ghosts;
mod kernels;
mod radiometry;
mod rgbd;
#[path = "../common/shots.rs"]
mod shots;
mod spectral;
mod truth;

use std::sync::Arc;

use glam::DVec3;
use quadpixel::response::Response;
use quadpixel::scene::TexturedPlane;
use quadpixel::scene::coverage::Coverage;
use quadpixel::scene::texture::Texture;

/// Pixels of 2 µm.
fn geometric(m: usize, n: usize, focal_um: f64) -> Response {
    shots::boxes(m, n, 2.0, focal_um)
}

/// A square card of radiance 1, square to the axis.
fn card(centre_mm: DVec3, side_mm: f64, coverage: Option<Coverage>) -> TexturedPlane {
    let white = Arc::new(Texture::from_fn(1, 1, |_, _| [1.0]).unwrap());
    TexturedPlane::new(
        centre_mm,
        (side_mm, side_mm),
        (0.0, 0.0, 0.0),
        white,
        coverage.map(Arc::new),
    )
    .unwrap()
}
