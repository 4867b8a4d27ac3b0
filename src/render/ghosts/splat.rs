//! Rays that land on pixels.

use std::ops::Range;

use super::super::Camera;
use super::Ghosts;
use super::front::inwards;
use super::sources::radiance;
use super::spread::Pixels;
use super::table::Drawn;
use crate::frames::{sensor_from_camera, uv_from_camera_direction};
use crate::lens::Reflected;
use crate::rays::RayBatch;
use crate::sampling::hash;
use crate::sensor::Sensor;

/// Light on a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landed {
    pub column: usize,
    pub row: usize,
    /// Direction cosines in which it arrives.
    uv: [f32; 2],
    /// Of each channel: radiance × share × weight, mm² times the unit of radiance.
    light: [f64; 3],
}

impl Landed {
    /// Of all channels together.
    pub fn light(&self) -> f64 {
        self.light.iter().sum()
    }
}

/// A ray that came to the window in some channels.
struct Met {
    drawn: Drawn,
    channels: Range<usize>,
    column: usize,
    row: usize,
    uv: [f32; 2],
    share: f64,
}

impl Ghosts<'_> {
    /// Follows rays of these numbers among `rays`.
    pub(super) fn batch(&self, numbers: Range<usize>, rays: usize, seed: u64) -> Vec<Landed> {
        let mut met = Vec::new();
        let first = numbers.start;
        for number in numbers {
            if let Some(drawn) = self.table.draw(&self.front, number, rays, seed) {
                self.meet(&drawn, &mut met);
            }
        }
        let mut batch = RayBatch::with_capacity(met.len());
        met.iter()
            .for_each(|m| batch.push(m.drawn.place_mm, m.drawn.direction));
        let key = hash(seed, &[first as u64]);
        let radiance = radiance(self.camera, self.scene, &mut batch, key);
        let landed = met.into_iter().enumerate().map(|(i, m)| {
            let mut light = [0.0; 3];
            for channel in m.channels {
                light[channel] = f64::from(radiance[channel][i]) * m.share * m.drawn.weight;
            }
            Landed {
                column: m.column,
                row: m.row,
                uv: m.uv,
                light,
            }
        });
        landed.filter(|l| l.light != [0.0; 3]).collect()
    }

    /// Where a drawn ray comes to the window, by the lens at each channel's wavelength.
    fn meet(&self, drawn: &Drawn, met: &mut Vec<Met>) {
        let Some(reflections) = self.camera.reflections() else {
            return;
        };
        let light = inwards(drawn.place_mm, drawn.direction);
        let pair = self.table.pairs[drawn.pair];
        let each = if self.camera.is_dispersive() { 1 } else { 3 };
        for first in (0..3).step_by(each) {
            let channels = first..first + each;
            let system = self.camera.system(channels.start);
            let Some(Reflected { ray, share }) = reflections.trace_pair(system, pair, light) else {
                continue;
            };
            let at = sensor_from_camera(ray.origin_mm).truncate();
            let Some((column, row)) = pixel_at(self.camera.sensor(), at) else {
                continue;
            };
            let uv = uv_from_camera_direction(ray.direction);
            met.push(Met {
                drawn: *drawn,
                channels,
                column,
                row,
                uv: [uv.x as f32, uv.y as f32],
                share: share / reflections.transmission_on_axis(system),
            });
        }
    }
}

/// Column and row of the pixel at a sensor position.
fn pixel_at(sensor: &Sensor, at_mm: glam::DVec2) -> Option<(usize, usize)> {
    let from_corner = (at_mm - sensor.position_mm(-0.5, -0.5)) / sensor.pitch_mm();
    let inside = from_corner.x >= 0.0
        && from_corner.y >= 0.0
        && from_corner.x < sensor.width() as f64
        && from_corner.y < sensor.height() as f64;
    inside.then_some((from_corner.x as usize, from_corner.y as usize))
}

/// Puts light on sub-pixels.
pub(super) struct Splatter<'a> {
    camera: &'a Camera,
    /// 1/(N A), per mm².
    scale: f64,
}

impl<'a> Splatter<'a> {
    /// Of so many rays.
    pub fn new(camera: &'a Camera, rays: usize) -> Self {
        let pitch_mm = camera.sensor().pitch_mm();
        Self {
            camera,
            scale: 1.0 / (rays as f64 * pitch_mm * pitch_mm),
        }
    }

    /// Adds light, in equal parts on some pixels, to a mosaic as [`super::super::SubPixelImage`] has it.
    pub fn add(&self, landed: &Landed, pixels: &Pixels, mosaic: &mut [f64]) {
        let sensor = self.camera.sensor();
        let (m, n) = (sensor.subpixels().m(), sensor.subpixels().n());
        let stride = sensor.width() * m;
        let part = 1.0 / (pixels.columns.len() * pixels.rows.len()) as f64;
        self.for_each(landed, |channel, subpixel, value| {
            for row in pixels.rows.clone() {
                for column in pixels.columns.clone() {
                    let (x, y) = (column * m + subpixel % m, row * n + subpixel / m);
                    mosaic[(y * stride + x) * 3 + channel] += part * value;
                }
            }
        });
    }

    /// `take(channel, sub-pixel, value)`.
    pub fn for_each(&self, landed: &Landed, mut take: impl FnMut(usize, usize, f64)) {
        let sensor = self.camera.sensor();
        let count = sensor.subpixels().count();
        let at = sensor.position_mm(landed.column as f64, landed.row as f64);
        let shift_um = self.camera.shift_at_um(at).to_array();
        let colours = self.camera.colours();
        let middle = colours.count() / 2;
        let mut weights = vec![0.0; count];
        let mut responded = None;
        for channel in 0..3 {
            if landed.light[channel] == 0.0 {
                continue;
            }
            let number = colours.response_number(channel, middle);
            if responded != Some(number) {
                let ([mut u], [mut v]) = ([landed.uv[0]], [landed.uv[1]]);
                let (u, v) = (std::slice::from_mut(&mut u), std::slice::from_mut(&mut v));
                let response = colours.response(number);
                response.weights_under(shift_um, u, v, &mut weights);
                responded = Some(number);
            }
            for (subpixel, weight) in weights.iter().enumerate() {
                take(
                    channel,
                    subpixel,
                    self.scale * landed.light[channel] * f64::from(*weight),
                );
            }
        }
    }
}
