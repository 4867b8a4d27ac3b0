//! Diffraction at the main lens's aperture.
//!
//! Seen from a place on the sensor, the aperture is a cone of directions. A wave that fills it does not meet in a point
//! but in the cone's diffraction pattern ([`pattern`]), so the sensor shows the picture of the rays blurred by it. The
//! renderer draws this blur with the rays: each starts beside its place on the sensor, by a displacement drawn from the
//! pattern at its wavelength, towards the same point of the pupil; the pixel's response sees it arrive undisplaced.
//!
//! ```text
//! E(x) = ∫ K(d; Ω(x), λ) E_rays(x − d) d²d ,     ∫ K = 1
//! ```
//!
//! That is exact in focus for a lens without aberrations. With aberrations or out of focus the blurs of rays and
//! pattern are not independent: [`kernel`] has how a ray's displacement depends on its place in the pupil, and
//! `docs/effects.md` how near that comes to waves that carry the lens's own phases.

#[cfg(test)]
mod against_waves;
mod blur;
mod kernel;
mod pattern;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;

use crate::field::FieldGrid;
use crate::frames::camera_from_sensor_mm;
use crate::lens::ExitPupilMap;
use crate::sampling::uniform;
pub(super) use blur::{BlurField, PixelBlur};
use kernel::Kernel;

/// Radii of an outline, in units of its own ellipse, that differ from 1 by no more than this: diffracts as that one.
const ELLIPTIC: f64 = 0.01;
/// Every so many nodes of the pupil's map has a kernel of its own.
const EVERY: usize = 4;
/// Keeps the choice of a node apart from the samples.
const NODE: u64 = 0xD1FF_0DE5;
/// Steps of the golden ratio fill [0, 1) evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The pattern over a window.
#[derive(Clone, Debug)]
pub(super) struct LensDiffraction {
    /// Of the ellipse with the pupil's second moments, in direction cosines (camera frame, backward): its middle (2),
    /// and the columns of the map from there to the unit disk (4).
    ellipses: FieldGrid,
    /// At [`ExitPupilMap::NODES`]² / [`EVERY`]² nodes; a single one where all are ellipses.
    kernels: Vec<Arc<Kernel>>,
    /// For the weights of `kernels` at a place.
    nodes: FieldGrid,
}

impl LensDiffraction {
    /// From the outlines of the pupil over a window, for a sensor at `sensor_z_mm`; `None` where no light passes.
    pub fn new(pupils: &ExitPupilMap, sensor_z_mm: f64) -> Option<Self> {
        let shapes: Vec<Option<Shape>> = (pupils.outlines().par_iter())
            .map(|(place_mm, outline)| {
                Shape::new(camera_from_sensor_mm(*place_mm, sensor_z_mm), outline)
            })
            .collect();
        let lit = shapes.iter().flatten().next()?;
        let side = ExitPupilMap::NODES;
        let ellipses = shapes
            .iter()
            .flat_map(|s| s.as_ref().unwrap_or(lit).ellipse());
        let ellipses = FieldGrid::new(pupils.window(), (side, side), 6, ellipses.collect())?;
        let few = (side - 1) / EVERY + 1;
        let nodes = FieldGrid::new(pupils.window(), (few, few), 1, vec![0.0; few * few])?;
        let disk = Arc::new(Kernel::disk());
        let kernels = if shapes.iter().flatten().all(|s| s.clipped.is_none()) {
            vec![disk]
        } else {
            let kernel = |k: usize| {
                let shape = &shapes[k / few * EVERY * side + k % few * EVERY];
                match shape.as_ref().and_then(|s| s.clipped.as_ref()) {
                    Some(outline) => Arc::new(Kernel::new(outline)),
                    None => disk.clone(),
                }
            };
            (0..few * few).into_par_iter().map(kernel).collect()
        };
        Some(Self {
            ellipses,
            kernels,
            nodes,
        })
    }

    /// What the rays of a pixel draw from; its place: sensor frame, mm. `key`: the pixel's.
    pub fn at(&self, place_mm: DVec2, key: u64) -> PlaceDiffraction<'_> {
        let (middle, to_disk) = self.ellipse(place_mm);
        PlaceDiffraction {
            middle,
            to_disk,
            scale: to_disk.transpose() * (1.0 / std::f64::consts::TAU),
            kernels: self.around(place_mm),
            turn: uniform(key, &[NODE]),
        }
    }

    /// Displacements that the pattern at a place gives a picture, px (x right, y down as stored), by pairs of samples
    /// in [0, 1).
    pub fn displacements_px(
        &self,
        place_mm: DVec2,
        [wavelength_mm, pitch_mm]: [f64; 2],
        samples: impl Iterator<Item = (f64, f64)>,
    ) -> Vec<DVec2> {
        let here = self.at(place_mm, 0);
        let scale = here.to_disk.transpose();
        // Columns grow with x of the sensor frame, against that of the camera frame.
        let to_px = wavelength_mm / pitch_mm / std::f64::consts::TAU * DVec2::new(-1.0, 1.0);
        let displacement = |(i, (s, t))| to_px * (scale * here.pick(i).displacement_at(s, t));
        samples.enumerate().map(displacement).collect()
    }

    fn ellipse(&self, place_mm: DVec2) -> (DVec2, DMat2) {
        let mut e = [0.0; 6];
        self.ellipses.sample(place_mm, &mut e);
        let [x, y, columns @ ..] = e;
        (DVec2::new(x, y), DMat2::from_cols_array(&columns))
    }

    /// The kernels around a place and their weights.
    fn around(&self, place_mm: DVec2) -> [(&Kernel, f64); 4] {
        let around = self.nodes.around(place_mm);
        around.map(|(node, weight)| (self.kernel(node), weight))
    }

    fn kernel(&self, node: usize) -> &Kernel {
        self.kernels.get(node).unwrap_or(&self.kernels[0])
    }
}

/// The pattern at one place: a mixture of those of the four nodes around it.
pub(in crate::render) struct PlaceDiffraction<'a> {
    middle: DVec2,
    to_disk: DMat2,
    scale: DMat2,
    kernels: [(&'a Kernel, f64); 4],
    turn: f64,
}

impl PlaceDiffraction<'_> {
    /// Displacement over wavelength, camera frame, of ray `number` of these direction cosines by a sample in [0, 1).
    #[inline]
    pub fn displacement(&self, number: usize, direction: DVec2, sample: f64) -> DVec2 {
        let q = self.to_disk * (direction - self.middle);
        self.scale * self.pick(number).displacement(q, sample)
    }

    /// The nodes take turns by their weights.
    #[inline]
    fn pick(&self, number: usize) -> &Kernel {
        let mut rest = (self.turn + number as f64 * GOLDEN).fract();
        for (kernel, weight) in &self.kernels {
            if rest < *weight {
                return kernel;
            }
            rest -= weight;
        }
        self.kernels[0].0
    }
}

/// An aperture as a place sees it.
struct Shape {
    middle: DVec2,
    /// From the ellipse with the second moments of its direction cosines to the unit disk.
    to_disk: DMat2,
    /// Its outline there, if it is no disk.
    clipped: Option<Vec<DVec2>>,
}

impl Shape {
    /// Of an outline (camera frame, mm) seen from a place; `None` for one without area.
    fn new(place_mm: DVec3, outline_mm: &[DVec3]) -> Option<Self> {
        let cosines = outline_mm
            .iter()
            .map(|p| (*p - place_mm).normalize().truncate());
        let cosines: Vec<DVec2> = cosines.collect();
        let (middle, covariance) = moments(&cosines)?;
        // Cholesky's root of 4 × the covariance, which is B Bᵀ of an ellipse B · (unit disk).
        let xx = 2.0 * covariance.x_axis.x.sqrt();
        let xy = 4.0 * covariance.x_axis.y / xx;
        let yy = (4.0 * covariance.y_axis.y - xy * xy).sqrt();
        if !(xx > 0.0 && yy > 0.0) {
            return None;
        }
        let to_disk = DMat2::from_cols_array(&[xx, xy, 0.0, yy]).inverse();
        let scaled: Vec<DVec2> = cosines.iter().map(|w| to_disk * (*w - middle)).collect();
        let is_disk = scaled.iter().all(|q| (q.length() - 1.0).abs() <= ELLIPTIC);
        Some(Self {
            middle,
            to_disk,
            clipped: (!is_disk).then_some(scaled),
        })
    }

    fn ellipse(&self) -> [f64; 6] {
        let [a, b, c, d] = self.to_disk.to_cols_array();
        [self.middle.x, self.middle.y, a, b, c, d]
    }
}

/// Centroid and covariance of a polygon's area; `None` if it has none.
fn moments(outline: &[DVec2]) -> Option<(DVec2, DMat2)> {
    let origin = outline.iter().sum::<DVec2>() / outline.len() as f64;
    let (mut area, mut first) = (0.0, DVec2::ZERO);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        // The triangle origin, a, b: its moments are those of its corners.
        let (a, b) = (*a - origin, *b - origin);
        let triangle = 0.5 * a.perp_dot(b);
        area += triangle;
        first += triangle / 3.0 * (a + b);
        xx += triangle / 6.0 * (a.x * a.x + b.x * b.x + a.x * b.x);
        yy += triangle / 6.0 * (a.y * a.y + b.y * b.y + a.y * b.y);
        xy += triangle / 12.0 * (2.0 * (a.x * a.y + b.x * b.y) + a.x * b.y + b.x * a.y);
    }
    if area == 0.0 || !area.is_finite() {
        return None;
    }
    let mean = first / area;
    let (xx, xy, yy) = (
        xx / area - mean.x * mean.x,
        xy / area - mean.x * mean.y,
        yy / area - mean.y * mean.y,
    );
    Some((origin + mean, DMat2::from_cols_array(&[xx, xy, xy, yy])))
}
