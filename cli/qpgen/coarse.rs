//! A first look at a scene within about a second: few rays, large pixels, the same lens, focus and window.

use std::path::Path;

use crate::exit::CommandError;
use quadpixel::file::write_aside;
use quadpixel::image::{Image, raster, srgb};
use quadpixel::render::truth::WhiteField;
use quadpixel::render::{RenderSettings, render};

use quadpixel_generators::assemble;
use quadpixel_generators::sample::Prepared;

/// Pixels in a row, about.
const WIDTH_PX: usize = 128;
/// Rays a pixel and channel.
const RAYS: usize = 16;
const QUALITY: u8 = 85;

/// A coarse image: the sum of all sub-pixels, linear, 1 for a white wall of radiance 1 in the middle.
pub(crate) struct Coarse {
    sum: Image,
}

impl Coarse {
    /// Renders it.
    ///
    /// # Errors
    /// A window too small to be coarsened for this lens.
    pub fn new(prepared: &Prepared) -> Result<Self, CommandError> {
        let mut recipe = prepared.recipe().clone();
        let factor = recipe.sensor.width.div_ceil(WIDTH_PX).max(1);
        recipe.sensor.width = (recipe.sensor.width / factor).max(1);
        recipe.sensor.height = (recipe.sensor.height / factor).max(1);
        recipe.sensor.pitch_um *= factor as f64;
        let camera = assemble::camera(&recipe, prepared.response())?;
        let settings = RenderSettings {
            rays_per_pixel: RAYS,
            ..recipe.render
        };
        let scene = prepared.scene();
        let image = render(&camera, scene, &settings).image;
        let mut sum = image.sum();
        let gain = (1.0 / WhiteField::new(&camera).reference_sr()) as f32;
        sum.data_mut().iter_mut().for_each(|v| *v *= gain);
        Ok(Self { sum })
    }

    /// Stops of exposure at which 95 % of the pixels are below 0.8 of the sensor's white; 0 for a black image.
    pub fn exposure_ev(&self) -> f64 {
        let mut greens: Vec<f32> = self.sum.data().iter().skip(1).step_by(3).copied().collect();
        greens.sort_by(f32::total_cmp);
        let bright = f64::from(greens[(greens.len() * 95 / 100).min(greens.len() - 1)]);
        if bright > 0.0 {
            // Two digits, as a person would write it.
            ((0.8 / bright).log2().clamp(-16.0, 16.0) * 100.0).round() / 100.0
        } else {
            0.0
        }
    }

    /// Writes it as a JPEG at the exposure `ev`.
    ///
    /// # Errors
    /// The disk.
    pub fn write(&self, path: &Path, ev: f64) -> Result<(), CommandError> {
        let gain = ev.exp2() as f32;
        let codes: Vec<u8> = (self.sum.data().iter())
            .map(|&v| srgb::code_from_linear((v * gain).clamp(0.0, 1.0)))
            .collect();
        let (width, height) = (self.sum.width(), self.sum.height());
        let jpeg = raster::encode_jpeg(path, &codes, width, height, QUALITY)
            .map_err(CommandError::failed)?;
        Ok(write_aside(path, &jpeg)?)
    }
}
