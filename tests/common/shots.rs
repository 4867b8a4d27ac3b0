//! Cameras and renders that several test programs take.

#![allow(dead_code)] // because each test binary uses its own part

use std::sync::LazyLock;

use glam::{DVec2, DVec3};
use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::wave::WaveSettings;
use quadpixel::lens::{FocusBy, Lens, Prescription, PupilEllipse};
use quadpixel::render::{Camera, Render, RenderSettings, Rendered};
use quadpixel::response::{GeometricResponse, Response, TableSettings, build_table};
use quadpixel::scene::Scene;
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;

pub const PHONE: &str = "wide_US20120327520A1_emb3";

/// A lens of the library, focused by its sensor.
pub fn focused(name: &str, focus_mm: f64) -> Lens {
    let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
    lens.focused_at(focus_mm, FocusBy::Sensor, 550.0).unwrap()
}

/// An ideal pixel whose boxes reach to tan θ = pitch / (2 · focal length).
pub fn boxes(m: usize, n: usize, pitch_um: f64, focal_um: f64) -> Response {
    let subpixels = Subpixels::new(m, n).unwrap();
    Response::Geometric(GeometricResponse::new(subpixels, pitch_um, focal_um).unwrap())
}

/// A coarse wave table of a small pixel.
pub fn wave_pixel() -> Response {
    // Made once for all tests of a program.
    static PIXEL: LazyLock<Response> = LazyLock::new(|| wave_pixel_at(vec![550.0]));
    PIXEL.clone()
}

/// The same at some wavelengths, nm.
pub fn wave_pixel_at(wavelengths_nm: Vec<f64>) -> Response {
    let settings = TableSettings {
        model: PixelModel::Wave(WaveSettings::draft()),
        wavelengths_nm,
        cosine_max: 0.6,
        steps: 4,
        refine: 1,
        shifts: None,
    };
    let stack = PixelStack::paper(1.2, 0.85, 0.85, 0.75);
    let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
    Response::Table(built.table)
}

/// A window of `size` pixels at `centre_mm`, microlenses shifted by the chief ray.
pub fn camera(lens: &Lens, response: &Response, size: (usize, usize), centre_mm: DVec2) -> Camera {
    let sensor = Sensor::new(response.pitch_um(), response.subpixels(), size, centre_mm).unwrap();
    let bands = ChannelWavelengths::default();
    Camera::new(lens, sensor, ShiftRule::ChiefRay, response, bands).unwrap()
}

/// Bare pixels that look at a disk of radius `semi_mm`, `far_mm` away.
pub fn bare(
    response: &Response,
    size: (usize, usize),
    [semi_mm, far_mm]: [f64; 2],
    wavelengths: ChannelWavelengths,
) -> Camera {
    let sensor = Sensor::new(response.pitch_um(), response.subpixels(), size, DVec2::ZERO).unwrap();
    let target = PupilEllipse {
        centre_mm: DVec3::new(0.0, 0.0, -far_mm),
        axis_a_mm: DVec2::X * semi_mm,
        axis_b_mm: DVec2::Y * semi_mm,
    };
    Camera::bare(sensor, response, wavelengths, target).unwrap()
}

/// An even wall of radiance 1 at infinity.
pub fn white() -> Scene {
    Scene::new(Vec::new(), [1.0; 3])
}

/// A render with the default execution.
pub fn shoot(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Rendered {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    Render::new(camera, scene, &settings).run()
}

/// Does `work` on a pool of so many threads.
pub fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.unwrap().install(work)
}
