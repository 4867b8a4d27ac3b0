//! The picture as surfaces through the renderer: every ray through the lens, its diffraction and the response.

use rayon::prelude::*;

use super::apart;
use super::convert::{Conversion, Converted};
use super::error::RgbdError;
use super::halo::Parts;
use super::levels::Levels;
use super::relief::Relief;
use super::surfaces::Surfaces;
use crate::image::Image;
use crate::memory;
use crate::progress::Progress;
use crate::render::truth::WhiteField;
use crate::render::{Camera, Render, RenderSettings, SubPixelImage};
use crate::spectrum::ChannelWavelengths;

/// Rays of a pixel, at most, that find out which part of its light is made up.
const MADE_UP_RAYS: usize = 64;
/// Bytes of a pixel of the relief: its patch, corners, part of the tree, radiance.
const RELIEF_BYTES: u64 = 600;

impl Conversion<'_> {
    /// Converts by rays through the same relief that [`Self::run`] scatters. `progress` hears of finished rows.
    ///
    /// # Errors
    /// As of [`Self::run`].
    pub fn trace(
        &self,
        settings: &RenderSettings,
        progress: &dyn Progress,
    ) -> Result<Converted, RgbdError> {
        let camera = self.camera;
        let (width, height) = self.check_window()?;
        let levels = Levels::new(camera, self.picture.inverse_range_per_mm())?;
        let margin = self.margin(self.reach_px(&levels)?);
        let pixels = ((width + 2 * margin) * (height + 2 * margin)) as u64;
        memory::check("surfaces of a picture", RELIEF_BYTES * pixels)?;
        let relief = Relief::new(self.picture, &levels, margin);
        let aperture = apart::aperture(camera, margin).ok_or(RgbdError::Dark)?;
        let all = (camera.sensor(), 0..height);
        let parts = Parts::of_bank(&aperture);
        let mut target = apart::target((&aperture, &parts), &relief, all, self.tile);
        let surfaces = Surfaces::new(camera, self.sight, &relief, &levels)?;
        let scene = surfaces.scene();
        let seen = self.sight.geometry(camera, &scene).surfaces;
        let white = WhiteField::from_fields(camera, self.fields);
        let rendered = Render::new(camera, &scene, settings)
            .white(&white)
            .occlusion(seen.as_slice())
            .progress(progress)
            .run();
        let few = RenderSettings {
            rays_per_pixel: settings.rays_per_pixel.min(MADE_UP_RAYS),
            ..*settings
        };
        let made_up = Render::new(camera, &surfaces.made_up(), &few).run();
        shade(camera, &white, &mut target);
        Ok(Converted {
            made_up: share_of_white(camera, &white, &made_up.image),
            occlusion: (rendered.occlusion).unwrap_or_else(|| Image::zeros(width, height, 1)),
            rays: rendered.stats.rays + made_up.stats.rays,
            image: rendered.image,
            target,
        })
    }
}

/// Brings a target of radiance to the unit of the sum of the sub-pixels.
fn shade(camera: &Camera, white: &WhiteField, target: &mut Image) {
    let sensor = camera.sensor();
    let rows = (target.data_mut())
        .par_chunks_mut(3 * sensor.width())
        .enumerate();
    rows.for_each(|(row, out)| {
        for (column, pixel) in out.chunks_exact_mut(3).enumerate() {
            let white = white.sum_sr(sensor.position_mm(column as f64, row as f64));
            (pixel.iter_mut().zip(white)).for_each(|(p, w)| *p *= w as f32);
        }
    });
}

/// Of each pixel, the sum of its sub-pixels over that of a white wall, in the reference channel.
fn share_of_white(camera: &Camera, white: &WhiteField, image: &SubPixelImage) -> Image {
    let sensor = camera.sensor();
    let channel = ChannelWavelengths::REFERENCE;
    let mut share = Image::zeros(sensor.width(), sensor.height(), 1);
    let views: Vec<Image> = (0..image.subpixels.count())
        .map(|s| image.view(s))
        .collect();
    for y in 0..sensor.height() {
        for x in 0..sensor.width() {
            let sum: f32 = views.iter().map(|v| v.pixel(x, y)[channel]).sum();
            let white = white.sum_sr(sensor.position_mm(x as f64, y as f64))[channel];
            share.pixel_mut(x, y)[0] = (sum / white as f32).min(1.0);
        }
    }
    share
}
