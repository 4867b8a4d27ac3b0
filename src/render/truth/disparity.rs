//! Disparity of each view by traced, response-weighted centroids, and its paraxial value.
//!
//! Pixel p sees, through sub-pixel i, the direction q_i(p, D) at depth D on average, and q̄(p, D) through all together.
//! A point that the sum shows at p is shown by view i where q_i equals it; to first order in the shift
//!
//! ```text
//! Δ_i(p, D) = −J⁻¹ (q_i − q̄),    J = ∂q̄/∂p        (px, ΔX right, ΔY down in the stored image)
//! ```
//!
//! q and J are linear in 1/D (see `bundle`), so a grid over the sensor serves every depth (see `sight_field`). The
//! paraxial value is that of an ideal lens of the same focal length, focus and pupil filling: with m̄ the
//! response-weighted mean slopes of the light at the sensor and z′ the paraxial image of depth D (see [`Defocus`]), Δx
//! = (m̄_i − m̄) · D_xp (z_s − z′)/s′. The difference of the two is the disparity of the lens's aberrations.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::Defocus;
use super::bundle::{Centroid, centroids};
use super::sight_field::{Sight, SightField};
use super::sight_line::SightLine;
use crate::image::{Image, rows_of};
use crate::render::Camera;
use crate::sampling::SobolSet;
use crate::spectrum::ChannelWavelengths;

/// Rays of a bundle for the Jacobian of one place, and the step of its central difference, px.
const RAYS: usize = 1024;
const STEP_PX: f64 = 2.0;

/// Disparity at every place of the window and every depth, in one channel.
#[derive(Clone, Debug)]
pub struct DisparityField {
    sight: SightField,
    pitch_mm: f64,
    defocus: Defocus,
}

/// Disparity maps of all sub-pixels: each image is W × H × 2 (ΔX, ΔY), px, NaN where not valid.
#[derive(Clone, Debug)]
pub struct DisparityMaps {
    /// By traced centroids.
    pub traced: Vec<Image>,
    /// Of the ideal lens.
    pub paraxial: Vec<Image>,
}

/// How the sub-pixels of one place see a point; NaN where dark.
pub(in crate::render) struct Seen {
    /// What each gets of a white wall.
    pub weights_sr: Vec<f64>,
    /// Where each shows it, from where the sum does.
    pub shifts_px: Vec<DVec2>,
    /// Where the sum shows what another line of sight meets, from that line's place.
    pub to_sum_px: DVec2,
}

impl Seen {
    fn new(sight: &Sight, depth_mm: f64, line: SightLine) -> Self {
        let weights_sr: Vec<f64> = sight.weights_sr().collect();
        let mut shifts_px = vec![DVec2::ZERO; weights_sr.len()];
        traced(sight, depth_mm, &mut shifts_px);
        Self {
            weights_sr,
            shifts_px,
            to_sum_px: shift_to_sum(sight, depth_mm, line),
        }
    }

    /// Of a group of sub-pixels: what they get of a white wall together, sr, and the mean of their shifts from the sum,
    /// px. NaN where one of them is dark.
    pub fn group(&self, members: &[usize]) -> (f64, DVec2) {
        let light: f64 = members.iter().map(|&s| self.weights_sr[s]).sum();
        let sum: DVec2 = members.iter().map(|&s| self.shifts_px[s]).sum();
        (light, sum / members.len() as f64)
    }
}

impl DisparityField {
    /// The fields of R, G and B, or one for all where they see the same; `None` for bare pixels.
    pub fn of_channels(camera: &Camera) -> Option<Vec<Self>> {
        match camera.colours().alike() {
            true => Some(vec![Self::new(camera, ChannelWavelengths::REFERENCE)?]),
            false => (0..3).map(|channel| Self::new(camera, channel)).collect(),
        }
    }

    /// Tabulates the field of `channel` relative to the sum of the same channel; `None` for bare pixels, which have no
    /// focus.
    pub fn new(camera: &Camera, channel: usize) -> Option<Self> {
        Some(Self {
            defocus: Defocus::new(camera)?,
            sight: SightField::new(camera, channel),
            pitch_mm: camera.sensor().pitch_mm(),
        })
    }

    /// What its pixels see and get.
    pub(super) fn sight(&self) -> &SightField {
        &self.sight
    }

    /// Mean slope of the light that each sub-pixel gets at a sensor position, from the sum's; `None`: it is dark.
    pub(in crate::render) fn slopes(&self, xy_mm: DVec2) -> Vec<Option<DVec2>> {
        let sight = self.sight.at(xy_mm);
        let seen = sight.beside().zip(sight.weights_sr());
        let slopes = seen.map(|([_, _, slope], weight)| (weight > 0.0).then_some(slope));
        slopes.map(|s| s.filter(|s| s.is_finite())).collect()
    }

    /// Sub-pixels of a pixel.
    pub fn subpixels(&self) -> usize {
        self.sight.subpixels()
    }

    /// Traced (ΔX, ΔY) px of each sub-pixel for a point at `depth_mm` (+∞ allowed) shown at `xy_mm`; NaN where dark.
    pub fn traced_px(&self, xy_mm: DVec2, depth_mm: f64, out: &mut [DVec2]) {
        traced(&self.sight.at(xy_mm), depth_mm, out);
    }

    /// Paraxial (ΔX, ΔY) px of each sub-pixel, as [`Self::traced_px`].
    pub fn paraxial_px(&self, xy_mm: DVec2, depth_mm: f64, out: &mut [DVec2]) {
        self.paraxial(&self.sight.at(xy_mm), depth_mm, out);
    }

    /// The line of the places that the sum of all sub-pixels sees from a sensor position; not finite where it is dark.
    pub fn sight_line(&self, xy_mm: DVec2) -> SightLine {
        self.sight.line(xy_mm)
    }

    /// Where the sum shows the point at `depth_mm` (+∞ allowed) of another line of sight from `xy_mm`, from there, px
    /// (x right, y down as stored).
    pub fn shift_to_sum_px(&self, xy_mm: DVec2, depth_mm: f64, line: SightLine) -> DVec2 {
        shift_to_sum(&self.sight.at(xy_mm), depth_mm, line)
    }

    /// Change of the sum's direction per px at a sensor position, J₀ and J₁ (mm) of J = J₀ + J₁/D; columns: x right, y
    /// down as stored. Not finite where it is dark.
    pub(crate) fn jacobian(&self, xy_mm: DVec2) -> [DMat2; 2] {
        let sight = self.sight.at(xy_mm);
        let infinity = sight.jacobian(0.0);
        [infinity, sight.jacobian(1.0) - infinity]
    }

    /// Of a group of sub-pixels, for a point at `depth_mm` (+∞ allowed) that the sum shows at `xy_mm`: what they get of
    /// a white wall together, sr, and the mean of their (ΔX, ΔY) from the sum, px. NaN where one of them is dark.
    pub fn group_px(&self, xy_mm: DVec2, depth_mm: f64, members: &[usize]) -> (f64, DVec2) {
        let sight = self.sight.at(xy_mm);
        Seen::new(&sight, depth_mm, sight.line()).group(members)
    }

    /// How the place at `xy_mm` sees the point at `depth_mm` (+∞ allowed) of a line of sight from there.
    pub(in crate::render) fn seen(&self, xy_mm: DVec2, depth_mm: f64, line: SightLine) -> Seen {
        Seen::new(&self.sight.at(xy_mm), depth_mm, line)
    }

    /// Both for every pixel of the camera's window, at the depths of a W × H × 1 map in mm (NaN: not valid).
    pub fn maps(&self, camera: &Camera, depth_mm: &Image) -> DisparityMaps {
        let sensor = camera.sensor();
        let (width, height, subpixels) = (sensor.width(), sensor.height(), self.subpixels());
        // Traced, then paraxial, of every sub-pixel.
        let mut images = vec![Image::zeros(width, height, 2); 2 * subpixels];
        let row = |(row, out): (usize, &mut Vec<&mut [f32]>)| {
            let first = sensor.position_mm(0.0, row as f64);
            let along = self.sight.row(first.y);
            let mut sight = along.at(first.x);
            let mut shifts = vec![DVec2::ZERO; 2 * subpixels];
            for column in 0..width {
                let depth = f64::from(depth_mm.pixel(column, row)[0]);
                let place = sensor.position_mm(column as f64, row as f64);
                along.read(place.x, &mut sight);
                let (of_lens, of_ideal) = shifts.split_at_mut(subpixels);
                traced(&sight, depth, of_lens);
                self.paraxial(&sight, depth, of_ideal);
                for (out, shift) in out.iter_mut().zip(&shifts) {
                    out[2 * column..][..2].copy_from_slice(&shift.as_vec2().to_array());
                }
            }
        };
        rows_of(&mut images)
            .par_iter_mut()
            .enumerate()
            .for_each(row);
        let paraxial = images.split_off(subpixels);
        DisparityMaps {
            traced: images,
            paraxial,
        }
    }

    fn paraxial(&self, sight: &Sight, depth_mm: f64, out: &mut [DVec2]) {
        let lever_px = self.defocus.lever_mm(depth_mm) / self.pitch_mm;
        for (o, [_, _, slope]) in out.iter_mut().zip(sight.beside()) {
            // Camera x runs against the stored columns.
            *o = DVec2::new(-slope.x, slope.y) * lever_px;
        }
    }
}

/// As [`DisparityField::traced_px`], of what is seen there.
pub(super) fn traced(sight: &Sight, depth_mm: f64, out: &mut [DVec2]) {
    let inverse = 1.0 / depth_mm;
    let solve = -sight.jacobian(inverse).inverse();
    for (o, [q0, q1_mm, _]) in out.iter_mut().zip(sight.beside()) {
        *o = solve * (q0 + inverse * q1_mm);
    }
}

/// As [`DisparityField::shift_to_sum_px`], of what is seen there.
pub(super) fn shift_to_sum(sight: &Sight, depth_mm: f64, line: SightLine) -> DVec2 {
    let (sum, inverse) = (sight.line(), 1.0 / depth_mm);
    let beside = line.q0 - sum.q0 + inverse * (line.q1_mm - sum.q1_mm);
    sight.jacobian(inverse).inverse() * beside
}

/// J₀ and J₁ of J(D) = J₀ + J₁/D at one sensor position, by central differences; J₁ in mm/px.
pub(crate) fn jacobian_at(camera: &Camera, channel: usize, p: DVec2) -> Option<[DMat2; 2]> {
    let samples = SobolSet::new(RAYS);
    let step = STEP_PX * camera.sensor().pitch_mm();
    let at = |d: DVec2| centroids(camera, channel, p + d, &samples).map(|c| c.1);
    let difference = |a: Centroid, b: Centroid| {
        (
            (a.q0 - b.q0) / (2.0 * STEP_PX),
            (a.q1_mm - b.q1_mm) / (2.0 * STEP_PX),
        )
    };
    let (x0, x1) = difference(at(DVec2::X * step)?, at(-DVec2::X * step)?);
    let (y0, y1) = difference(at(DVec2::Y * step)?, at(-DVec2::Y * step)?);
    Some([DMat2::from_cols(x0, y0), DMat2::from_cols(x1, y1)])
}
