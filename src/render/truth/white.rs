//! What a white wall (unit radiance everywhere) gives on each sub-pixel and channel: exposure and shading.

use glam::DVec2;
use rayon::prelude::*;

use super::bundle::centroids;
use crate::field::FieldGrid;
use crate::image::Image;
use crate::render::Camera;
use crate::sampling::SobolSet;
use crate::sensor::Sensor;
use crate::spectrum::ChannelWavelengths;

const RAYS: usize = 1024;

/// ∫ P_id cos θ dω over the window, sr, per channel and sub-pixel.
#[derive(Clone, Debug)]
pub struct WhiteField {
    grid: FieldGrid,
    subpixels: usize,
    centre_mm: DVec2,
    quantum_efficiency: f64,
}

impl WhiteField {
    /// Tabulates the camera's window.
    pub fn new(camera: &Camera) -> Self {
        let sensor = camera.sensor();
        let size = (
            FieldGrid::nodes_for(sensor.width()),
            FieldGrid::nodes_for(sensor.height()),
        );
        let subpixels = sensor.subpixels().count();
        let samples = SobolSet::new(RAYS);
        let data = (0..size.0 * size.1)
            .into_par_iter()
            .flat_map_iter(|k| {
                let p = FieldGrid::node_mm(sensor.window_mm(), size, (k % size.0, k / size.0));
                let white = |channel| {
                    let c = centroids(camera, channel, p, &samples);
                    c.map_or(vec![0.0; subpixels], |(s, _)| {
                        s.iter().map(|s| s.weight).collect()
                    })
                };
                if camera.colours().alike() {
                    white(0).repeat(3)
                } else {
                    (0..3).flat_map(white).collect()
                }
            })
            .collect();
        let grid = FieldGrid::new(sensor.window_mm(), size, 3 * subpixels, data)
            .unwrap_or_else(|| unreachable!("three channels of sub-pixels a node"));
        let middle = centroids(
            camera,
            ChannelWavelengths::REFERENCE,
            sensor.centre_mm(),
            &samples,
        );
        Self {
            grid,
            subpixels,
            centre_mm: sensor.centre_mm(),
            quantum_efficiency: middle.map_or(0.0, |(_, all)| all.weight / all.incident),
        }
    }

    /// Part of the photons arriving on a pixel in the middle of the window that its photodiodes absorb together,
    /// reference channel.
    pub fn quantum_efficiency(&self) -> f64 {
        self.quantum_efficiency
    }

    /// What each sub-pixel receives over the window, sr: one image of three channels per sub-pixel, in stored order.
    pub fn of_subpixels_sr(&self, sensor: &Sensor) -> Vec<Image> {
        let (width, height) = (sensor.width(), sensor.height());
        let mut images = vec![Image::zeros(width, height, 3); self.subpixels];
        let mut values = vec![0.0; 3 * self.subpixels];
        for y in 0..height {
            for x in 0..width {
                let place = sensor.position_mm(x as f64, y as f64);
                self.grid.sample(place, &mut values);
                for (s, image) in images.iter_mut().enumerate() {
                    let channels = image.pixel_mut(x, y).iter_mut().enumerate();
                    channels.for_each(|(c, to)| *to = values[c * self.subpixels + s] as f32);
                }
            }
        }
        images
    }

    /// The largest that a sub-pixel receives in any channel, over the sum in the middle of the window in the reference
    /// channel.
    pub fn largest_share(&self) -> f64 {
        let largest = self.grid.data().iter().fold(0.0, |m: f64, &v| m.max(v));
        largest / self.reference_sr()
    }

    /// Per channel, the sum over sub-pixels at a sensor position, sr.
    pub fn sum_sr(&self, xy_mm: DVec2) -> [f64; 3] {
        let mut c = vec![0.0; 3 * self.subpixels];
        self.grid.sample(xy_mm, &mut c);
        std::array::from_fn(|channel| c[channel * self.subpixels..][..self.subpixels].iter().sum())
    }

    /// The sum over sub-pixels in the middle of the window, per channel, sr.
    pub fn middle_sr(&self) -> [f64; 3] {
        self.sum_sr(self.centre_mm)
    }

    /// Of it the reference channel: what exposure is counted from.
    pub fn reference_sr(&self) -> f64 {
        self.middle_sr()[ChannelWavelengths::REFERENCE]
    }
}

/// The sum over sub-pixels that a white wall gives at a sensor position, reference channel, sr; 0 where it is dark.
pub(crate) fn white_sum_sr(camera: &Camera, xy_mm: DVec2) -> f64 {
    let samples = SobolSet::new(RAYS);
    centroids(camera, ChannelWavelengths::REFERENCE, xy_mm, &samples).map_or(0.0, |c| c.1.weight)
}
