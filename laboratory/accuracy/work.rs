//! How much is measured, and the rendering that several knobs measure: a phone lens, a small pixel, a chart of random
//! cells.

use std::sync::Arc;

use crate::error::LaboratoryError;
use glam::DMat3;
use quadpixel::em::PixelStack;
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::truth::WhiteField;
use quadpixel::render::{Camera, Render, RenderSettings, render};
use quadpixel::response::{AngularResponse, Response};
use quadpixel::sampling::uniform;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;

use super::row::rms;
use quadpixel_generators::scenes::field_of_view::{centre_at, covering};

/// The lens; for what stands in for the paper's, see the README.
pub const LENS: &str = "wide_US20120327520A1_emb3";
/// The pixel.
pub const PIXEL: &str = "1.6um";
/// Where the lens is focused, mm.
pub const FOCUS_MM: f64 = 750.0;
/// Chief-ray angle and azimuth of the window, deg.
const CHIEF_RAY_DEG: (f64, f64) = (15.0, 30.0);
/// Cells along the chart.
const CELLS: usize = 32;
/// Texels along a cell: its edge is one wide.
const TEXELS: usize = 8;

/// How much is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// Small images and few settings where images are measured; as [`Self::Affordable`] elsewhere.
    Draft,
    /// A minute or two per knob at most.
    Affordable,
    /// All rows.
    Full,
}

/// The lens, focused.
pub fn lens() -> Result<Lens, LaboratoryError> {
    let lens = Lens::new(&Prescription::builtin(LENS)?)?;
    let nm = ChannelWavelengths::default().reference_nm();
    Ok(lens.focused_at(FOCUS_MM, FocusBy::Sensor, nm)?)
}

/// A lens, a pixel and a window of the sensor.
pub struct Work {
    lens: Lens,
    sensor: Sensor,
    response: Response,
}

impl Work {
    /// `side` × `side` microlenses with the response that comes with the program.
    pub fn new(side: usize) -> Result<Self, LaboratoryError> {
        let lens = lens()?;
        let stack = PixelStack::builtin(PIXEL)?;
        let table = AngularResponse::shipped(quadpixel::em::Level::Fdtd, &stack)?;
        let table = table.ok_or(LaboratoryError::NoShippedTable(PIXEL))?;
        let system = lens.at(ChannelWavelengths::default().reference_nm())?;
        let centre_mm = centre_at(&system, CHIEF_RAY_DEG.0, CHIEF_RAY_DEG.1)?;
        let sensor = Sensor::new(stack.pitch_um, stack.subpixels, (side, side), centre_mm)?;
        Ok(Self {
            lens,
            sensor,
            response: Response::Table(table),
        })
    }

    /// In words.
    pub fn text(&self) -> String {
        let (side, angle) = (self.sensor.width(), CHIEF_RAY_DEG.0);
        format!(
            "{side} x {side} microlenses of {PIXEL} (the response that comes with the program, 550 nm) at a chief-ray angle of {angle} deg behind {LENS}, focused at {FOCUS_MM} mm, \
             three colours, a chart of {CELLS} x {CELLS} random coloured cells over the window"
        )
    }

    /// Microlenses.
    pub fn pixels(&self) -> f64 {
        (self.sensor.width() * self.sensor.height()) as f64
    }

    /// The camera whose channels are traced at these wavelengths.
    pub fn camera(&self, wavelengths: ChannelWavelengths) -> Result<Camera, LaboratoryError> {
        let (lens, sensor) = (&self.lens, self.sensor.clone());
        Ok(Camera::new(
            lens,
            sensor,
            ShiftRule::ChiefRay,
            &self.response,
            wavelengths,
        )?)
    }

    /// The chart at a distance, just covering what the camera sees; key of its cells: `seed`.
    pub fn scene(
        &self,
        camera: &Camera,
        distance_mm: f64,
        seed: u64,
    ) -> Result<Scene, LaboratoryError> {
        let side = CELLS * TEXELS;
        let texture = Texture::from_fn(side, side, |x, y| {
            let cell = [x / TEXELS, y / TEXELS].map(|c| c as u64);
            [0, 1, 2].map(|channel| uniform(seed, &[cell[0], cell[1], channel]) as f32)
        });
        let (centre, side_mm) = covering(camera, distance_mm, DMat3::IDENTITY)?;
        let texture = Arc::new(texture?);
        let card = TexturedPlane::new(centre, (side_mm, side_mm), (0.0, 0.0, 0.0), texture, None);
        Ok(Scene::new(vec![card?], [0.0; 3]))
    }
}

/// The mosaic of a render.
pub fn mosaic(camera: &Camera, scene: &Scene, rays_per_pixel: usize, seed: u64) -> Vec<f32> {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    let done = render(camera, scene, &settings);
    done.image.mosaic.data().to_vec()
}

/// The same with what a white wall is known to give.
pub fn mosaic_by_white(
    camera: &Camera,
    scene: &Scene,
    white: &WhiteField,
    rays_per_pixel: usize,
    seed: u64,
) -> Vec<f32> {
    let settings = RenderSettings {
        rays_per_pixel,
        seed,
    };
    let done = Render::new(camera, scene, &settings).white(white).run();
    done.image.mosaic.data().to_vec()
}

/// RMS of the difference of two mosaics in per cent of the second's mean.
pub fn percent(image: &[f32], reference: &[f32]) -> f64 {
    let mean = reference.iter().map(|&x| f64::from(x)).sum::<f64>() / reference.len() as f64;
    100.0 * rms(image, reference) / mean
}
