//! Dead leaves: opaque disks and rectangles whose radii follow r^−3, one upon another: the same statistics at every
//! scale, edges and occlusions as in natural images (Lee, Mumford & Huang, IJCV 41, 35 (2001)).
//!
//! Radii have the density 2 a² b² / (b² − a²) r^−3 on [a, b], so r = (b^−2 + (a^−2 − b^−2)(1 − u))^(−1/2) for uniform
//! u, and the mean area of a disk is π 2 a² b² / (b² − a²) ln(b/a).

use super::error::{ChartError, side, within};
use super::keyed::Key;
use super::paint::{BAND_ROWS, canvas};
use quadpixel::scene::texture::Texture;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

const NAME: &str = "dead-leaves";
/// Mean number of leaves over a point; e^−8 = 0.03 % of the ground stays bare.
const DEPTH: f64 = 8.0;

/// Parameters of the `dead-leaves` chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DeadLeaves {
    /// Smallest radius as a share of the side, 0.0005..=0.1; default 0.002.
    pub least_radius: f64,
    /// Largest radius as a share of the side, more than the smallest, ..=0.5; default 0.2.
    pub largest_radius: f64,
    /// Share of rectangles (turned at random, of the disk's area) among the leaves, 0..=1; default 0.3.
    pub rectangles: f64,
    /// Strength of the colours, 0 (grey) ..=1; default 0.5.
    pub saturation: f64,
}

impl Default for DeadLeaves {
    fn default() -> Self {
        Self {
            least_radius: 0.002,
            largest_radius: 0.2,
            rectangles: 0.3,
            saturation: 0.5,
        }
    }
}

/// One leaf in units of the side.
#[derive(Clone, Copy)]
pub(super) struct Leaf {
    centre: [f32; 2],
    pub(super) radius: f32,
    /// Half sides and turn of a rectangle; none for a disk.
    rectangle: Option<([f32; 2], f32)>,
    colour: [f32; 3],
}

impl DeadLeaves {
    pub(super) fn random(key: Key) -> Self {
        Self {
            least_radius: 0.001 * 8f64.powf(key.uniform(0)),
            largest_radius: key.range(1, 0.08, 0.3),
            rectangles: key.range(2, 0.0, 1.0),
            saturation: key.range(3, 0.0, 1.0),
        }
    }

    fn check(&self) -> Result<(), ChartError> {
        within(NAME, "least_radius", self.least_radius, 0.0005, 0.1)?;
        within(
            NAME,
            "largest_radius",
            self.largest_radius,
            self.least_radius * 1.01,
            0.5,
        )?;
        within(NAME, "rectangles", self.rectangles, 0.0, 1.0)?;
        within(NAME, "saturation", self.saturation, 0.0, 1.0)
    }

    pub(super) fn draw(&self, seed: u64, size_px: usize) -> Result<Texture, ChartError> {
        self.check()?;
        side(size_px)?;
        let leaves = self.leaves(seed);
        let size = size_px as f32;
        let slabs: Vec<Vec<u32>> = (0..size_px.div_ceil(BAND_ROWS))
            .into_par_iter()
            .map(|k| {
                let (top, bottom) = ((k * BAND_ROWS) as f32, ((k + 1) * BAND_ROWS) as f32);
                (0u32..)
                    .zip(&leaves)
                    .filter(|(_, leaf)| {
                        // A rectangle of aspect ≤ 2 and the disk's area reaches 1.41 radii.
                        let (y, reach) = (leaf.centre[1] * size, 1.5 * leaf.radius * size + 2.0);
                        y + reach > top && y - reach < bottom
                    })
                    .map(|(i, _)| i)
                    .collect()
            })
            .collect();
        canvas(size_px, [0.4; 3], |band| {
            for &i in slabs
                .get(band.first_row() / BAND_ROWS)
                .into_iter()
                .flatten()
            {
                let leaf = &leaves[i as usize];
                let centre = leaf.centre.map(|v| v * size);
                match leaf.rectangle {
                    Some((half, angle)) => {
                        band.rectangle(centre, half.map(|v| v * size), angle, leaf.colour)
                    }
                    None => band.disk(centre, leaf.radius * size, leaf.colour),
                }
            }
        })
    }

    /// All leaves, the lowest first.
    pub(super) fn leaves(&self, seed: u64) -> Vec<Leaf> {
        let (a, b) = (self.least_radius, self.largest_radius);
        let mean_area = PI * 2.0 * (a * b).powi(2) / (b * b - a * a) * (b / a).ln();
        // Centres reach one largest radius beyond the chart, so that its border is like its middle.
        let span = 1.0 + 2.0 * b;
        let count = (DEPTH * span * span / mean_area).ceil() as u64;
        let key = Key::new(seed, NAME);
        (0..count)
            .into_par_iter()
            .map(|i| {
                let key = key.with(i);
                let radius =
                    (b.powi(-2) + (a.powi(-2) - b.powi(-2)) * (1.0 - key.uniform(0))).powf(-0.5);
                let rectangle = (key.uniform(3) < self.rectangles).then(|| {
                    let aspect = key.range(4, 0.5, 2.0).sqrt();
                    let half = 0.5 * PI.sqrt() * radius;
                    (
                        [(half * aspect) as f32, (half / aspect) as f32],
                        key.range(5, 0.0, PI) as f32,
                    )
                });
                let grey = key.range(6, 0.03, 0.85);
                Leaf {
                    centre: [
                        key.range(1, -b, 1.0 + b) as f32,
                        key.range(2, -b, 1.0 + b) as f32,
                    ],
                    radius: radius as f32,
                    rectangle,
                    colour: [7, 8, 9].map(|c| {
                        (grey + self.saturation * (key.range(c, 0.03, 0.85) - grey)) as f32
                    }),
                }
            })
            .collect()
    }
}
