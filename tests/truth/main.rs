//! Every number that a sample tells is held to pictures of a small spot: rendered, and measured by centroids here,
//! which share no code with the renderer's truths. Over layouts of sub-pixels, lenses, ideal and wave pixels, colours,
//! places of the field and signs of defocus.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

mod disparity;
mod gratings;
mod mirror;
mod rays;
mod registration;
#[path = "../common/shots.rs"]
mod shots;
mod white;

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::image::Image;
use quadpixel::lens::{Lens, trace_backward};
use quadpixel::rays::Ray;
use quadpixel::render::Camera;
use quadpixel::response::Response;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};

/// Lens, pitch (µm), focus and image heights (mm) of a camera.
struct Case {
    lens: &'static str,
    pitch_um: f64,
    /// Of the ideal microlens: its boxes end about where the lens's pupil does.
    focal_um: f64,
    focus_mm: f64,
    heights_mm: [f64; 3],
}

/// Two phones, a photographic lens and a telephoto lens: on the axis, half-way and far out.
const CASES: [Case; 4] = [
    Case {
        lens: "wide_US20120327520A1_emb3",
        pitch_um: 2.0,
        focal_um: 5.0,
        focus_mm: 500.0,
        heights_mm: [0.0, 1.2, 2.0],
    },
    Case {
        lens: "wide_US11940605B2_emb1",
        pitch_um: 2.0,
        focal_um: 5.0,
        focus_mm: 500.0,
        heights_mm: [0.0, 1.0, 1.8],
    },
    Case {
        lens: "lib_double_gauss_100mm_glass",
        pitch_um: 8.0,
        focal_um: 40.0,
        focus_mm: 3000.0,
        heights_mm: [0.0, 6.0, 12.0],
    },
    Case {
        lens: "lib_50mm_US20210263286_ex1",
        pitch_um: 6.0,
        focal_um: 15.0,
        focus_mm: 2000.0,
        heights_mm: [0.0, 5.0, 9.0],
    },
];

impl Case {
    fn focused(&self) -> Lens {
        shots::focused(self.lens, self.focus_mm)
    }

    /// A window of `side` pixels on the diagonal at one of the heights.
    fn camera(&self, lens: &Lens, response: &Response, field: usize, side: usize) -> Camera {
        let place = DVec2::new(0.8, 0.6) * self.heights_mm[field];
        shots::camera(lens, response, (side, side), place)
    }
}

/// A scene with one white spot, of raised-cosine profile and `side_px` pixels wide, where the window's middle looks at
/// `depth_mm`; its size in the picture is reckoned from the paraxial lens.
fn spot(camera: &Camera, depth_mm: f64, side_px: f64) -> Scene {
    let place = camera.sensor().centre_mm();
    let system = camera.system(1);
    let pupil = camera.pupil_at(place).unwrap();
    let origin = quadpixel::frames::camera_from_sensor_mm(place, system.sensor_z_mm);
    let ray = Ray {
        origin_mm: origin,
        direction: (pupil.centre_mm - origin).normalize(),
    };
    let ray = trace_backward(system, ray).unwrap();
    let centre = ray.origin_mm + (-depth_mm - ray.origin_mm.z) / ray.direction.z * ray.direction;
    let per_px = camera.sensor().pitch_mm() * depth_mm / camera.paraxial().unwrap().efl_mm;
    let n = 64;
    let profile = |i: usize| 1.0 - (TAU * (i as f64 + 0.5) / n as f64).cos();
    let spot = Texture::from_fn(n, n, |x, y| [(0.25 * profile(x) * profile(y)) as f32]);
    let centre = DVec3::new(centre.x, centre.y, -depth_mm);
    let size = (side_px * per_px, side_px * per_px);
    let card = TexturedPlane::new(centre, size, (0.0, 0.0, 0.0), Arc::new(spot.unwrap()), None);
    Scene::new(vec![card.unwrap()], [0.0; 3])
}

/// Depths at which the paraxial blur disk has about this diameter, px: nearer and farther than the focus.
fn depths_mm(camera: &Camera, coc_px: f64) -> [f64; 2] {
    let paraxial = camera.paraxial().unwrap();
    let focus = camera.focus_distance_mm();
    let efl = paraxial.efl_mm;
    // c = f A (1/d_f − 1/d), A = f/N.
    let per_mm = coc_px * camera.sensor().pitch_mm() * paraxial.f_number / (efl * efl);
    [
        1.0 / (1.0 / focus + per_mm),
        1.0 / (1.0 / focus - per_mm).max(1e-9),
    ]
}

/// Column and row of a channel's centroid.
fn centroid(image: &Image, channel: usize) -> DVec2 {
    let (mut sum, mut total) = (DVec2::ZERO, 0.0);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let w = f64::from(image.pixel(x, y)[channel]);
            sum += w * DVec2::new(x as f64, y as f64);
            total += w;
        }
    }
    sum / total
}

/// Mean and root mean square of differences.
fn bias_and_rms(differences: &[f64]) -> (f64, f64) {
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let square = differences.iter().map(|d| d * d).sum::<f64>() / n;
    (mean, square.sqrt())
}
