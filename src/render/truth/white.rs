//! What a white wall (unit radiance everywhere) gives on each sub-pixel and channel: exposure and shading.

use glam::DVec2;
use rayon::prelude::*;

use super::bundle::centroids;
use crate::render::Camera;
use crate::sampling::SobolSet;
use crate::sensor::FieldGrid;

const RAYS: usize = 1024;

/// ∫ P_id cos θ dω over the window, sr, per channel and sub-pixel.
#[derive(Clone, Debug)]
pub struct WhiteField {
    grid: FieldGrid,
    subpixels: usize,
    centre_mm: DVec2,
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
                if camera.is_dispersive() {
                    (0..3).flat_map(white).collect()
                } else {
                    white(0).repeat(3)
                }
            })
            .collect();
        let grid = FieldGrid::new(sensor.window_mm(), size, 3 * subpixels, data)
            .unwrap_or_else(|| unreachable!("three channels of sub-pixels a node"));
        Self {
            grid,
            subpixels,
            centre_mm: sensor.centre_mm(),
        }
    }

    /// Per channel, the sum over sub-pixels at a sensor position, sr.
    pub fn sum_sr(&self, xy_mm: DVec2) -> [f64; 3] {
        let mut c = vec![0.0; 3 * self.subpixels];
        self.grid.sample(xy_mm, &mut c);
        std::array::from_fn(|channel| c[channel * self.subpixels..][..self.subpixels].iter().sum())
    }

    /// The sum over sub-pixels in the middle of the window, reference channel, sr: what exposure is counted from.
    pub fn reference_sr(&self) -> f64 {
        self.sum_sr(self.centre_mm)[crate::spectrum::ChannelWavelengths::REFERENCE]
    }
}
