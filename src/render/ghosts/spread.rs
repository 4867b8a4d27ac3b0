//! Over how many pixels the light of a ray is spread.

use std::ops::Range;

use super::splat::Landed;
use crate::sensor::Sensor;

/// Rays whose squares overlap, about.
const OVERLAP: f64 = 16.0;
/// Largest distance from the middle of a square to its side, pixels.
const LARGEST: f64 = 48.0;

/// A rectangle of pixels, never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Pixels {
    pub columns: Range<usize>,
    pub rows: Range<usize>,
}

/// Sides of squares by the light of their rays: of a ray of mean light so many pixels that [`OVERLAP`] squares overlap,
/// of brighter ones more in proportion, so that no ray shows by itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    /// Pixels of a square per unit of light.
    pixels_per_light: f64,
    width: usize,
    height: usize,
}

impl Spread {
    /// From all rays that landed on the sensor.
    pub fn new(all: &[Landed], sensor: &Sensor) -> Self {
        let light: f64 = all.iter().map(Landed::light).sum();
        let pixels = (sensor.width() * sensor.height()) as f64;
        Self {
            pixels_per_light: if light > 0.0 {
                OVERLAP * pixels / light
            } else {
                0.0
            },
            width: sensor.width(),
            height: sensor.height(),
        }
    }

    /// The pixels that share a ray's light: a square around its own, less what is beside the sensor.
    pub fn pixels(&self, landed: &Landed) -> Pixels {
        let side = (self.pixels_per_light * landed.light()).sqrt();
        let reach = (0.5 * (side - 1.0)).clamp(0.0, LARGEST) as usize;
        let around = |at: usize, size: usize| at.saturating_sub(reach)..size.min(at + reach + 1);
        Pixels {
            columns: around(landed.column, self.width),
            rows: around(landed.row, self.height),
        }
    }
}
