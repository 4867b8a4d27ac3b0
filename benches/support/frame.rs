//! The frame that renders are timed on: a flat, finely textured chart at 750 mm through the five-element phone lens.

use std::error::Error;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::em::PixelStack;
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::{Camera, Execution, RenderSettings, Rendered, render};
use quadpixel::response::Response;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;

/// Rays a sub-pixel and channel.
pub const RAYS_PER_SUBPIXEL: usize = 32;
const CHART_MM: f64 = 750.0;

/// Pixel, lens and chart.
pub struct Frame {
    pub stack: PixelStack,
    pub lens: Lens,
    scene: Scene,
}

impl Frame {
    /// Of the 1.6 µm pixel.
    pub fn new() -> Result<Self, Box<dyn Error>> {
        let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3")?)?;
        // A fine checkerboard with shades: every ray looks its texture up.
        let texture = Texture::from_fn(4096, 4096, |x, y| {
            let check = if (x / 8 + y / 8) % 2 == 0 { 0.9 } else { 0.1 };
            [check, 0.5 * check + x as f32 / 8192.0, y as f32 / 4096.0]
        })?;
        let plane = TexturedPlane::new(
            DVec3::new(0.0, 0.0, -CHART_MM),
            (700.0, 700.0),
            (0.0, 0.0, 0.0),
            Arc::new(texture),
            None,
        )?;
        Ok(Self {
            stack: PixelStack::builtin("1.6um")?,
            lens: lens.focused_at(CHART_MM, FocusBy::Sensor, 550.0)?,
            scene: Scene::new(vec![plane], [0.0; 3]),
        })
    }

    /// The camera of `side` × `side` microlenses.
    pub fn camera(
        &self,
        side: usize,
        response: &Response,
        wavelengths: ChannelWavelengths,
    ) -> Result<Camera, Box<dyn Error>> {
        let stack = &self.stack;
        let sensor = Sensor::new(stack.pitch_um, stack.subpixels, (side, side), DVec2::ZERO)?;
        let rule = ShiftRule::ChiefRay;
        Ok(Camera::new(
            &self.lens,
            sensor,
            rule,
            response,
            wavelengths,
        )?)
    }

    /// Renders.
    pub fn shot(&self, camera: &Camera) -> Rendered {
        let settings = RenderSettings {
            rays_per_pixel: RAYS_PER_SUBPIXEL * self.stack.subpixels.count(),
            seed: 1,
        };
        let execution = Execution::default();
        render(camera, &self.scene, &settings, &execution, None, &|_| ())
    }
}
