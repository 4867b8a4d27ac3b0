//! The frame that renders are timed on: a flat, finely textured chart at 750 mm through the five-element phone lens.

use std::error::Error;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::em::PixelStack;
use quadpixel::em::ShiftGrid;
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::{Camera, LensTracing, Render, RenderSettings, Rendered};
use quadpixel::response::{
    AngularResponse, Provenance, Response, ResponseAxes, ResponseMeta, TableSettings,
};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;

/// Rays per sub-pixel and channel.
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

    /// The same camera with maps of its lens, as `qpgen render` has them.
    pub fn mapped(&self, camera: Camera) -> Camera {
        camera.with_lens_maps(&LensTracing::default(), self.rays_per_pixel())
    }

    fn rays_per_pixel(&self) -> usize {
        RAYS_PER_SUBPIXEL * self.stack.subpixels.count()
    }

    /// Renders.
    pub fn shot(&self, camera: &Camera) -> Rendered {
        let settings = RenderSettings {
            rays_per_pixel: self.rays_per_pixel(),
            seed: 1,
        };
        Render::new(camera, &self.scene, &settings).run()
    }
}

/// A made-up table on the directions of `settings`, at `wavelengths_nm`, of the centred lens or of all shifts. Cost
/// needs tables of the size that `qpgen` makes, not their values, and those take minutes.
pub fn made_up_table(
    stack: &PixelStack,
    settings: &TableSettings,
    wavelengths_nm: Vec<f64>,
    shifts: Option<ShiftGrid>,
) -> Result<Response, Box<dyn Error>> {
    let half = (settings.steps * settings.refine) as i32;
    let axis: Vec<f64> = (-half..=half)
        .map(|i| settings.cosine_max * f64::from(i) / f64::from(half))
        .collect();
    let side = |c: f64| 1.0 / (1.0 + (-8.0 * c).exp());
    let mut plane = Vec::new();
    for &v in &axis {
        for &u in &axis {
            let share = |i: usize| {
                let (x, y) = stack.subpixels.centre(i);
                0.8 * side(u * x.signum()) * side(v * y.signum())
            };
            plane.extend((0..stack.subpixels.count()).map(|i| share(i) as f32));
        }
    }
    let shifts_um = match &shifts {
        None => vec![[0.0, 0.0]],
        Some(grid) => (0..=grid.per_pitch / 2)
            .flat_map(|i| (0..=i).map(move |j| [i, j]))
            .map(|node| grid.shift_um(node))
            .collect(),
    };
    let planes = wavelengths_nm.len() * shifts_um.len();
    let meta = ResponseMeta {
        model: "made-up".into(),
        settings: Provenance::Imported {
            file: "made up".into(),
            symmetric: false,
        },
        pixel: stack.clone(),
        pitch_um: stack.pitch_um,
        subpixels: stack.subpixels,
        frame: stack.moving_frame(550.0)?,
        key: String::new(),
        shift_grid: shifts,
        chief_ray_shifts: None,
        corrections: Vec::new(),
        charge: Default::default(),
    };
    let axes = ResponseAxes {
        wavelengths_nm,
        shifts_um,
        u: axis.clone(),
        v: axis,
    };
    Ok(Response::Table(AngularResponse::new(
        axes,
        meta,
        plane.repeat(planes),
    )?))
}
