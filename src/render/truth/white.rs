//! What a white wall (unit radiance everywhere) gives on each sub-pixel and channel: exposure and shading.

use glam::DVec2;

use super::bundle::centroids;
use super::disparity::DisparityField;
use super::sight_field::{Sight, SightField};
use crate::field::FieldGrid;
use crate::image::Image;
use crate::render::Camera;
use crate::sampling::SobolSet;
use crate::sensor::Sensor;
use crate::spectrum::ChannelWavelengths;

/// Rays of the bundle in the middle of the window.
const RAYS: usize = 16384;

/// ∫ P_id cos θ dω over the window, sr, per channel and sub-pixel.
#[derive(Clone, Debug)]
pub struct WhiteField {
    /// Of R, G, B, or one for all.
    channels: Vec<SightField>,
    centre_mm: DVec2,
    quantum_efficiency: f64,
}

impl WhiteField {
    /// Tabulates the camera's window.
    pub fn new(camera: &Camera) -> Self {
        let channels = match camera.colours().alike() {
            true => vec![SightField::new(camera, ChannelWavelengths::REFERENCE)],
            false => (0..3)
                .map(|channel| SightField::new(camera, channel))
                .collect(),
        };
        Self::from_sights(camera, channels)
    }

    /// Of the fields of a camera's channels ([`DisparityField::of_channels`]), which know it already.
    pub fn from_fields(camera: &Camera, fields: &[DisparityField]) -> Self {
        Self::from_sights(camera, fields.iter().map(|f| f.sight().clone()).collect())
    }

    fn from_sights(camera: &Camera, channels: Vec<SightField>) -> Self {
        let centre_mm = camera.sensor().centre_mm();
        let samples = SobolSet::new(RAYS);
        let middle = centroids(camera, ChannelWavelengths::REFERENCE, centre_mm, &samples);
        Self {
            channels,
            centre_mm,
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
        let first = &self.channels[0];
        let mut images = vec![Image::zeros(width, height, 3); first.subpixels()];
        for y in 0..height {
            for x in 0..width {
                let place = sensor.position_mm(x as f64, y as f64);
                let sights: Vec<Sight> = self.channels.iter().map(|c| c.at(place)).collect();
                for channel in 0..3 {
                    let sight = &sights[channel.min(sights.len() - 1)];
                    for (image, weight) in images.iter_mut().zip(sight.weights_sr()) {
                        image.pixel_mut(x, y)[channel] = weight as f32;
                    }
                }
            }
        }
        images
    }

    /// What each sub-pixel receives at a sensor position, sr: R, G, B outermost, then sub-pixels as stored.
    pub(in crate::render) fn read_subpixels_sr(&self, xy_mm: DVec2, out: &mut Vec<f64>) {
        out.clear();
        for field in &self.channels {
            out.extend(field.at(xy_mm).weights_sr());
        }
        if self.channels.len() == 1 {
            let subpixels = out.len();
            out.extend_from_within(..subpixels);
            out.extend_from_within(..subpixels);
        }
    }

    /// What each sub-pixel receives, sr, as a field over the window: R, G, B outermost, then sub-pixels as stored.
    pub(crate) fn grid(&self, sensor: &Sensor) -> FieldGrid {
        let window = sensor.window_mm();
        let size = [sensor.width(), sensor.height()].map(FieldGrid::nodes_for);
        let size = (size[0], size[1]);
        let components = 3 * self.channels[0].subpixels();
        let last = self.channels.len() - 1;
        let node = |k: usize| {
            let place = FieldGrid::node_mm(window, size, (k % size.0, k / size.0));
            let of = |channel: usize| -> Vec<f64> {
                let sight = self.channels[channel.min(last)].at(place);
                sight.weights_sr().collect()
            };
            [0, 1, 2].map(of).concat()
        };
        let data = (0..size.0 * size.1).flat_map(node).collect();
        FieldGrid::new(window, size, components, data)
            .unwrap_or_else(|| unreachable!("components a node"))
    }

    /// The largest that a sub-pixel receives in any channel, over the sum in the middle of the window in the reference
    /// channel.
    pub fn largest_share(&self) -> f64 {
        let largest = self.channels.iter().map(SightField::largest_weight_sr);
        largest.fold(0.0, f64::max) / self.reference_sr()
    }

    /// Per channel, the sum over sub-pixels at a sensor position, sr.
    pub fn sum_sr(&self, xy_mm: DVec2) -> [f64; 3] {
        let last = self.channels.len() - 1;
        std::array::from_fn(|channel| {
            let sight = self.channels[channel.min(last)].at(xy_mm);
            sight.weights_sr().sum()
        })
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
