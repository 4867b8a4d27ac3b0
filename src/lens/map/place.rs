//! A map at one place on the sensor: its nodes' coefficients, blended.

use glam::{DMat2, DVec2};

use super::LensMap;
use super::edge::DIRECTIONS;
use super::kernel::{CHANGES, OUTPUTS};
use crate::frames::camera_from_sensor_mm;

/// Reach where no surface limits the bundle.
const UNLIMITED: f32 = 1e9;

/// Values of a node in f64: what the outputs are in the middle of the pupil, and how they change with the place.
pub(super) const CONSTANTS: usize = OUTPUTS + CHANGES;

/// Buffers for one map, which a thread takes from place to place; places of one row share work.
#[derive(Clone, Debug, Default)]
pub struct PlaceBuffers {
    /// y of the row that is blended, mm.
    row: Option<f64>,
    row_constants: Vec<f64>,
    row_values: Vec<f32>,
    pub(super) place: Place,
    pub(super) rays: super::kernel::Doubtful,
}

/// The least of the outlines of all limiting surfaces.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// Reach in each direction, and the first again.
    pub reach: [f32; DIRECTIONS + 1],
    /// How far the bundle may go beyond the chord from a direction to the next: where two outlines cross between them,
    /// it has a corner.
    pub corner: [f32; DIRECTIONS],
}

impl Default for Edge {
    fn default() -> Self {
        Self {
            reach: [UNLIMITED; DIRECTIONS + 1],
            corner: [0.0; DIRECTIONS],
        }
    }
}

impl Edge {
    fn set(&mut self, outlines: &[f32]) {
        self.reach.fill(UNLIMITED);
        self.corner.fill(UNLIMITED);
        let least = |a: f32, b: f32| if b < a { b } else { a };
        for outline in outlines.chunks_exact(DIRECTIONS) {
            for k in 0..DIRECTIONS {
                let middle = 0.5 * (outline[k] + outline[(k + 1) % DIRECTIONS]);
                self.reach[k] = least(self.reach[k], outline[k]);
                self.corner[k] = least(self.corner[k], middle);
            }
        }
        self.reach[DIRECTIONS] = self.reach[0];
        for k in 0..DIRECTIONS {
            // The chord is concave with one bend: at the bend it is at most twice as high as in the middle.
            let chord = 0.5 * (self.reach[k] + self.reach[k + 1]);
            self.corner[k] = 2.0 * (self.corner[k] - chord);
        }
    }
}

/// What the kernel takes.
#[derive(Clone, Debug, Default)]
pub(super) struct Place {
    /// The place, camera frame, mm.
    pub origin: DVec2,
    /// Pupil coordinates: (p, q) = inverse · (target − centre − drift · off), `off` being from the place to the ray's start.
    pub centre: DVec2,
    pub inverse: DMat2,
    pub drift: DMat2,
    pub constants: [f64; CONSTANTS],
    /// Coefficients, changes' coefficients, outlines.
    pub values: Vec<f32>,
    /// The least of the outlines, and its first value again.
    pub edge: Edge,
}

impl PlaceBuffers {
    /// Goes to a place.
    pub(super) fn go(&mut self, map: &LensMap, place_mm: DVec2) {
        let (nx, ny) = map.nodes;
        let stride = map.stride();
        let w = &map.window;
        let (first, weights) = stencil(place_mm.y - w.centre.y, w.half_height, ny);
        if self.row != Some(place_mm.y) {
            self.row = Some(place_mm.y);
            let rows = |len: usize| {
                (0..4).map(move |k| (first + k) * nx * len..(first + k + 1) * nx * len)
            };
            blend64(
                &mut self.row_constants,
                rows(CONSTANTS).map(|r| &map.constants[r]),
                weights,
            );
            blend32(
                &mut self.row_values,
                rows(stride).map(|r| &map.values[r]),
                weights,
            );
        }
        let (first, weights) = stencil(place_mm.x - w.centre.x, w.half_width, nx);
        let place = &mut self.place;
        place.constants = [0.0; CONSTANTS];
        for (k, weight) in weights.iter().enumerate() {
            let node = &self.row_constants[(first + k) * CONSTANTS..][..CONSTANTS];
            place
                .constants
                .iter_mut()
                .zip(node)
                .for_each(|(c, n)| *c += weight * n);
        }
        let nodes = (0..4).map(|k| &self.row_values[(first + k) * stride..][..stride]);
        blend32(&mut place.values, nodes, weights);
        place
            .edge
            .set(&place.values[stride - map.limits * DIRECTIONS..]);
        let disk = map.pupil.at(place_mm);
        place.origin = camera_from_sensor_mm(place_mm, 0.0).truncate();
        place.centre = disk.centre;
        place.drift = disk.drift;
        place.inverse = disk.shape.inverse();
    }
}

/// The first of four nodes of n over ±half, and the weights of the cubic through them at offset x from the middle.
fn stencil(x: f64, half: f64, n: usize) -> (usize, [f64; 4]) {
    let f = ((x / half + 1.0) * 0.5 * (n - 1) as f64).clamp(0.0, (n - 1) as f64);
    let f = if f.is_finite() {
        f
    } else {
        0.5 * (n - 1) as f64
    };
    let first = (f as usize).saturating_sub(1).min(n - 4);
    let t = f - first as f64;
    let (a, b, c, d) = (t, t - 1.0, t - 2.0, t - 3.0);
    let weights = [
        -b * c * d / 6.0,
        a * c * d / 2.0,
        -a * b * d / 2.0,
        a * b * c / 6.0,
    ];
    (first, weights)
}

fn blend64<'a>(out: &mut Vec<f64>, parts: impl Iterator<Item = &'a [f64]>, weights: [f64; 4]) {
    out.clear();
    for (part, weight) in parts.zip(weights) {
        out.resize(part.len(), 0.0);
        out.iter_mut().zip(part).for_each(|(o, p)| *o += weight * p);
    }
}

fn blend32<'a>(out: &mut Vec<f32>, parts: impl Iterator<Item = &'a [f32]>, weights: [f64; 4]) {
    let parts: Vec<&[f32]> = parts.collect();
    let [w0, w1, w2, w3] = weights.map(|w| w as f32);
    out.resize(parts[0].len(), 0.0);
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| &parts[k][..out.len()]);
    for (i, out) in out.iter_mut().enumerate() {
        *out = (w0 * a[i] + w1 * b[i]) + (w2 * c[i] + w3 * d[i]);
    }
}
