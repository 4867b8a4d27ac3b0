//! The renderer held to closed forms and to itself: radiometry, disparity and its sign, truths, and bytes that do not depend on
//! how the work is done.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

mod disparity;
mod execution;
mod radiometry;
mod spectral;
mod truth;

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::{Camera, Execution, RenderSettings, Rendered, render};
use quadpixel::response::{GeometricResponse, Response};
use quadpixel::scene::coverage::Coverage;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;

const PHONE: &str = "wide_US20120327520A1_emb3";

fn lens(name: &str, focus_mm: f64) -> Lens {
    let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
    lens.focused_at(focus_mm, FocusBy::Sensor, 550.0).unwrap()
}

/// An ideal pixel of 2 µm whose boxes reach to tan θ = 2 µm / (2 · focal length).
fn geometric(m: usize, n: usize, focal_um: f64) -> Response {
    Response::Geometric(
        GeometricResponse::new(Subpixels::new(m, n).unwrap(), 2.0, focal_um).unwrap(),
    )
}

fn camera(lens: &Lens, response: &Response, size: (usize, usize), centre_mm: DVec2) -> Camera {
    let sensor = Sensor::new(2.0, response.subpixels(), size, centre_mm).unwrap();
    Camera::new(
        lens,
        sensor,
        ShiftRule::ChiefRay,
        response,
        ChannelWavelengths::default(),
    )
    .unwrap()
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

/// A render with the default execution.
fn shoot(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Rendered {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    render(
        camera,
        scene,
        &settings,
        &Execution::default(),
        None,
        &|_| (),
    )
}

fn white() -> Scene {
    Scene::new(Vec::new(), [1.0; 3])
}
