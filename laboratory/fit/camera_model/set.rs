//! What a camera of one set of values answers: kernels, the sheet's division, shifts of planes.

use std::sync::Arc;

use glam::DVec2;
use quadpixel::render::truth::{TextureSpectrum, matched_shift_px};
use quadpixel::sensor::Wandering;
use rayon::prelude::*;

use super::super::lens_law::LensLaw;
use super::super::measurements::{FieldKernels, Measurements, PlaneShifts, centroid_px, sum_of};
use super::super::parameters::Name;
use super::super::pixel_table::PixelTable;
use super::CameraModel;

/// Farthest that a microlens that parts the light equally stands beside where it brings the chief ray to the middle, of
/// the pitch; halvings of that.
const LARGEST_LEAN: f64 = 0.2;
const BISECTIONS: usize = 20;
/// Sign of the defocus of near points in the lens's law: their light comes together behind the sensor, so that what
/// goes to the right falls on the left of it.
const NEAR: f64 = -1.0;

/// The model at one set of values.
pub struct Set<'a> {
    pub(super) model: &'a CameraModel<'a>,
    pub(super) values: &'a [f64],
    pub(super) table: Arc<PixelTable>,
    pub(super) wandering: Wandering,
}

impl Set<'_> {
    fn value(&self, name: Name) -> f64 {
        self.values[name as usize]
    }

    /// How far a microlens stands beside where it would bring the chief ray to the middle of its pixel, µm along the
    /// split.
    pub fn shift_um(&self, x_mm: f64) -> f64 {
        let x = x_mm - self.value(Name::CentreXMm);
        let law = self.value(Name::Shift1)
            + x * x * (self.value(Name::Shift3) + x * x * self.value(Name::Shift5));
        self.value(Name::ShiftUm) + x * law
    }

    /// Direction cosines of the chief ray, from a pupil `pupil_mm` before the sensor.
    pub fn chief(&self, place_mm: [f64; 2]) -> [f64; 2] {
        let x = place_mm[0] - self.value(Name::CentreXMm);
        let y = place_mm[1] - self.value(Name::CentreYMm);
        let far = x.hypot(y).hypot(self.value(Name::PupilMm));
        [x / far, y / far]
    }

    /// P of left and right of every place in the pupil.
    fn weights(&self, place_mm: [f64; 2]) -> Vec<[f64; 2]> {
        self.weights_under(place_mm, self.shift_um(place_mm[0]), 1.0)
    }

    /// The same of a microlens so far beside where it would bring the chief ray to the middle, in a pupil of another
    /// F-number, over the camera's. From aside a pupil looks smaller, `∂(u, v)/∂(X, Y) = cos θ (1 − d dᵀ)` with d the
    /// chief ray: by cos³ θ along the field and cos θ across.
    fn weights_under(&self, place_mm: [f64; 2], shift_um: f64, stop: f64) -> Vec<[f64; 2]> {
        let rim = 0.5 / (self.value(Name::FNumber) * stop);
        let [u, v] = self.chief(place_mm);
        let smaller = rim * (1.0 - u * u - v * v).sqrt();
        let [along, both, across] = [1.0 - u * u, -u * v, 1.0 - v * v].map(|part| smaller * part);
        let shift = self.table.shift_for_um(u) + shift_um;
        let [diffusion, crosstalk] = [Name::DiffusionUm, Name::Crosstalk].map(|n| self.value(n));
        let halves = self
            .table
            .shifted(shift, diffusion, crosstalk, &self.wandering);
        let pupil = self.model.pupil.iter();
        pupil
            .map(|[x, y]| halves.at(u + along * x + both * y, both * x + across * y))
            .collect()
    }

    /// A white sheet in the left view over that in the right one, as recorded.
    pub fn sheet_ratio(&self, x_mm: f64) -> f64 {
        let weights = self.weights([x_mm, 0.0]);
        let sum = |half: usize| weights.iter().map(|w| w[half]).sum::<f64>();
        self.value(Name::LeftOverRight) * sum(0) / sum(1)
    }

    /// How far a microlens stands beside where both halves would get the same of a white sheet, µm along the split.
    pub fn beside_balance_um(&self, x_mm: f64) -> f64 {
        // The light goes along with the lens.
        let lean = |shift_um: f64| {
            let weights = self.weights_under([x_mm, 0.0], shift_um, 1.0);
            weights
                .iter()
                .map(|[left, right]| right - left)
                .sum::<f64>()
        };
        let most = LARGEST_LEAN * self.model.stack.pitch_um;
        let (mut low, mut high) = (-most, most);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match lean(middle) < 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        self.shift_um(x_mm) - 0.5 * (low + high)
    }

    /// Part of the sheet's signal that the left view has.
    pub fn left_part(&self, x_mm: f64) -> f64 {
        let ratio = self.sheet_ratio(x_mm);
        ratio / (1.0 + ratio)
    }

    /// Kernels of left and right at a field, each of sum 1, the chief ray `place_px` from their middle.
    pub fn kernels(&self, field_mm: [f64; 2], place_px: [f64; 2]) -> [Vec<f64>; 2] {
        let side = self.model.optics.side;
        let law = LensLaw::new(self.values, field_mm, self.model.optics.unit_mm);
        let weights = self.weights(field_mm);
        let sigma = self.value(Name::BlurPx);
        let middle = (side as f64 - 1.0) * 0.5;
        let reach = 4.5 * sigma;
        let mut views = [vec![0.0; side * side], vec![0.0; side * side]];
        let mut across = Vec::with_capacity(side);
        for (&rho, weight) in self.model.pupil.iter().zip(&weights) {
            let at = law.at(rho);
            let [x, y] = [0, 1].map(|axis| at[axis] + place_px[axis] + middle);
            let span = |c: f64| {
                let low = (c - reach).ceil().max(0.0) as usize;
                let high = (c + reach).floor().min(side as f64 - 1.0);
                let end = if high < 0.0 { 0 } else { high as usize + 1 };
                low.min(end)..end
            };
            let gauss = |i: usize, c: f64| (-0.5 * ((i as f64 - c) / sigma).powi(2)).exp();
            let columns = span(x);
            across.clear();
            across.extend(columns.clone().map(|i| gauss(i, x)));
            for j in span(y) {
                let down = gauss(j, y);
                for (view, p) in views.iter_mut().zip(weight) {
                    let row = &mut view[j * side..][..side];
                    let factor = down * p;
                    for (to, g) in row[columns.clone()].iter_mut().zip(&across) {
                        *to += factor * g;
                    }
                }
            }
        }
        for view in &mut views {
            let sum: f64 = view.iter().sum();
            view.iter_mut()
                .for_each(|v| *v /= sum.max(f64::MIN_POSITIVE));
        }
        views
    }

    /// x_L − x_R that a matcher finds in a window of a textured plane, px of the views.
    pub fn plane_shift_px(&self, plane: &PlaneShifts, place_mm: [f64; 2]) -> f64 {
        let optics = &self.model.optics;
        let sine = 0.5 / self.value(Name::FNumber);
        let tangent = sine / (1.0 - sine * sine).sqrt();
        let focus_mm = self.value(Name::FocusMm);
        let radius_mm = (optics.conjugates).disk_radius_mm(focus_mm, plane.distance_mm, tangent);
        let radius_px = NEAR * 1e3 * radius_mm / optics.view_pixel_um;
        let law = LensLaw::new(self.values, place_mm, optics.unit_mm);
        let law = law.defocused(self.values, radius_px);
        let weights = self.weights_under(place_mm, self.shift_um(place_mm[0]), plane.stop);
        // A pixel sees a texture where its kernel puts a point, the other way.
        let offsets = self.model.pupil.iter().map(|rho| {
            let [x, y] = law.at(rho.map(|r| r / plane.stop));
            -DVec2::new(x, y)
        });
        let texture = TextureSpectrum {
            window_px: plane.window_px,
            ..TextureSpectrum::default()
        };
        matched_shift_px(&offsets.collect::<Vec<_>>(), &weights, &texture)
    }

    /// The places at which the measured kernels of each field lie, as far as centroids tell.
    pub fn places_px(&self, measured: &Measurements) -> Vec<[f64; 2]> {
        let side = measured.side;
        let place = |field: &FieldKernels| {
            let sum = sum_of(&field.views, field.left_part);
            let model = self.kernels(field.place_mm, [0.0; 2]);
            let model = sum_of(&model, self.left_part(field.place_mm[0]));
            let [a, b] = [centroid_px(&sum, side), centroid_px(&model, side)];
            [a[0] - b[0], a[1] - b[1]]
        };
        measured.fields.par_iter().map(place).collect()
    }
}
