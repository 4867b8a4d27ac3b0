//! What leaving an effect out does to the values of the sub-pixels.
//!
//! A few hundred pixels, spread evenly over the window, are rendered with and without the effect, by the same rays,
//! each image in units of what a white wall gives it in the middle. Two sets of rays of different seeds have
//! independent errors, so that
//!
//! ```text
//! d² = ⟨(b₁ − a₁)(b₂ − a₂)⟩,     RMS ≤ √(d² + 2 s/√n) / ⟨a⟩
//! ```
//!
//! estimates the squared difference of the converged images without bias; s is the standard deviation of the products
//! of the n pixels. An effect that moves the rays is looked at with few rays first: where the difference is above the
//! tolerance by three of its standard errors, that is answer enough.

use super::Shot;
use crate::render::truth::white_sum_sr;
use crate::render::{Execution, RenderSettings, probe};
use crate::sampling::{hash, uniform};

/// Pixels along each side of the window that are probed, at most.
const SIDE: usize = 16;
/// Rays per pixel and channel in each of the two sets, at most: cards, and worlds, whose paths scatter.
const RAYS: usize = 32;
const PATHS: usize = 64;
/// The same, whatever the image has, for an effect that moves the rays: some at the pupil's edge pass with it alone or
/// without it alone, which is noise that the two sets do not share.
const MOVED_RAYS: usize = 128;
/// Keeps the probes' random numbers apart from the image's.
const KEY: u64 = 0x0EFF_EC75;

/// What an effect does to the rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// They stay as they are, or few are asked for.
    Same,
    /// They are moved.
    Moved,
}

/// How far two shots differ, by their probes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Difference {
    /// By three standard errors less.
    pub at_least: f64,
    /// By two more.
    pub at_most: f64,
}

/// The probed pixels of the whole.
pub(super) struct Probes {
    places: Vec<(usize, usize)>,
    settings: [RenderSettings; 2],
    values: [Vec<f64>; 2],
    mean: f64,
    /// Values per pixel.
    count: usize,
}

impl Probes {
    /// Of a shot that is to be rendered with `settings`.
    pub fn new(shot: &Shot, settings: &RenderSettings, look: Look) -> Self {
        let sensor = shot.camera.sensor();
        let seed = hash(settings.seed, &[KEY]);
        // The middle pixel of each cell would fall in step with charts' patterns, so a random one is taken.
        let along = |cell: usize, of: usize, length: usize, key: u64| {
            let (from, to) = (cell * length / of, (cell + 1) * length / of);
            from + (uniform(seed, &[cell as u64, key]) * (to - from) as f64) as usize
        };
        let (columns, rows) = (SIDE.min(sensor.width()), SIDE.min(sensor.height()));
        let places: Vec<_> = (0..columns * rows)
            .map(|k| {
                let (i, j) = (k % columns, k / columns);
                (
                    along(i, columns, sensor.width(), 2 * j as u64),
                    along(j, rows, sensor.height(), 2 * i as u64 + 1),
                )
            })
            .collect();
        let most = if shot.scene.world().is_some() {
            PATHS
        } else {
            RAYS
        };
        let settings = [1, 2].map(|set| RenderSettings {
            rays_per_pixel: match look {
                Look::Moved => MOVED_RAYS,
                Look::Same => settings.rays_per_pixel.min(most),
            },
            seed: hash(seed, &[set]),
        });
        let values = settings.map(|s| probed(shot, &s, &places));
        let all = values.iter().flatten();
        let mean = all.clone().sum::<f64>() / all.count().max(1) as f64;
        Self {
            count: 3 * sensor.subpixels().count(),
            places,
            settings,
            values,
            mean,
        }
    }

    /// The RMS difference of another shot, over the mean; 0 where both are black, infinite where this one alone is.
    pub fn difference(&self, other: &Shot) -> Difference {
        let others = self.settings.map(|s| probed(other, &s, &self.places));
        let off = |set: usize, k: usize| others[set][k] - self.values[set][k];
        let products: Vec<f64> = (0..self.places.len())
            .map(|place| {
                let values = place * self.count..(place + 1) * self.count;
                values.map(|k| off(0, k) * off(1, k)).sum::<f64>() / self.count as f64
            })
            .collect();
        let n = products.len() as f64;
        let mean = products.iter().sum::<f64>() / n;
        let variance =
            products.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
        let error = (variance / n).sqrt();
        let over_mean = |square: f64| match square.max(0.0).sqrt() {
            0.0 => 0.0,
            rms => rms / self.mean,
        };
        Difference {
            at_least: over_mean(mean - 3.0 * error),
            at_most: over_mean(mean + 2.0 * error),
        }
    }
}

/// The values of some pixels, a white wall's being 1 in the middle.
fn probed(shot: &Shot, settings: &RenderSettings, places: &[(usize, usize)]) -> Vec<f64> {
    let Shot { camera, scene } = shot;
    let mut values = probe(camera, scene, settings, &Execution::default(), places);
    let white = white_sum_sr(camera, camera.sensor().centre_mm());
    if white > 0.0 {
        values.iter_mut().for_each(|v| *v /= white);
    }
    values
}
