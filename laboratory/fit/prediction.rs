//! What a fitted camera says of every field and of the sheet, beside what was measured.

use rayon::prelude::*;
use serde::Serialize;

use super::camera_model::{CameraModel, Set};
use super::error::FitError;
use super::figures::{FieldFigures, relative_rms};
use super::measurements::{FieldKernels, Measurements, PlaneBlock, PlaneShifts};

/// Steps in which a kernel is laid over the measured one.
const PLACE_STEPS: usize = 6;
/// Step of its derivative, px.
const PLACE_STEP: f64 = 0.05;

/// One field.
#[derive(Clone, Debug, Serialize)]
pub struct FieldPrediction {
    /// Column and row of the grid.
    pub field: [usize; 2],
    /// Whether the fit saw it.
    pub held_out: bool,
    /// As measured.
    pub measured: FieldFigures,
    /// As predicted, with the predicted division of the sheet.
    pub predicted: FieldFigures,
    /// RMS of the difference over the RMS of the kernels, both views.
    pub kernel_rms: f64,
    /// The predicted kernels.
    #[serde(skip)]
    pub kernels: [Vec<f64>; 2],
}

/// One column of the sheet.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SheetPrediction {
    /// Place, mm from the middle of the picture.
    pub x_mm: f64,
    /// Whether the fit saw it.
    pub held_out: bool,
    /// Left over right, as measured.
    pub measured: f64,
    /// As predicted.
    pub predicted: f64,
}

/// One plane.
#[derive(Clone, Debug, Serialize)]
pub struct PlanePrediction {
    /// From the sensor, mm.
    pub distance_mm: f64,
    /// F-number over the camera's.
    pub stop: f64,
    /// Wavelength that its channel stands for, nm.
    pub wavelength_nm: f64,
    /// Whether the fit saw it.
    pub held_out: bool,
    /// Its windows.
    pub blocks: Vec<BlockPrediction>,
    /// Mean over the left, the middle and the right third of the picture: as measured, as predicted, px; `None` where
    /// no window has texture.
    pub thirds: [Option<[f64; 2]>; 3],
}

/// One window of a plane.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BlockPrediction {
    /// Its middle, mm on the sensor from the middle of the picture.
    pub place_mm: [f64; 2],
    /// x_L − x_R, px, as measured.
    pub measured_px: f64,
    /// Its standard deviation, px.
    pub sigma_px: f64,
    /// As predicted.
    pub predicted_px: f64,
}

/// All of it.
#[derive(Clone, Debug, Serialize)]
pub struct Prediction {
    /// Row by row.
    pub fields: Vec<FieldPrediction>,
    /// From left to right.
    pub sheet: Vec<SheetPrediction>,
    /// In the order of the description.
    pub planes: Vec<PlanePrediction>,
}

impl Prediction {
    /// By the values of all parameters. Where a kernel lies in its window is no part of it: each is laid over the
    /// measured one.
    ///
    /// # Errors
    /// Values that no camera has.
    pub fn new(
        model: &CameraModel,
        values: &[f64],
        measured: &Measurements,
    ) -> Result<Self, FitError> {
        let set = model.at(values)?;
        let places = set.places_px(measured);
        let columns = measured.grid[0];
        // The same values in other light: nothing is fitted per colour.
        let mut others: Vec<CameraModel> = Vec::new();
        let mut planes = Vec::new();
        for plane in &measured.planes {
            let nm = plane.wavelength_nm;
            if nm == model.wavelength_nm() {
                planes.push(PlanePrediction::new(&set, plane));
                continue;
            }
            if others.iter().all(|other| other.wavelength_nm() != nm) {
                others.push(model.at_wavelength(nm)?);
            }
            for other in others.iter().filter(|other| other.wavelength_nm() == nm) {
                planes.push(PlanePrediction::new(&other.at(values)?, plane));
            }
        }
        let field = |(i, (field, &place)): (usize, (&FieldKernels, &[f64; 2]))| {
            let kernels = laid_over(&set, field, place);
            let side = measured.side;
            FieldPrediction {
                field: [i % columns, i / columns],
                held_out: field.held_out,
                measured: FieldFigures::new(&field.views, field.left_part, side),
                predicted: FieldFigures::new(&kernels, set.left_part(field.place_mm[0]), side),
                kernel_rms: relative_rms(&field.views, &kernels),
                kernels,
            }
        };
        let pairs: Vec<_> = measured.fields.iter().zip(&places).enumerate().collect();
        let sheet = measured.sheet.iter().map(|c| SheetPrediction {
            x_mm: c.x_mm,
            held_out: c.held_out,
            measured: c.ratio,
            predicted: set.sheet_ratio(c.x_mm),
        });
        Ok(Self {
            fields: pairs.into_par_iter().map(field).collect(),
            sheet: sheet.collect(),
            planes,
        })
    }
}

impl PlanePrediction {
    fn new(set: &Set<'_>, plane: &PlaneShifts) -> Self {
        let block = |block: &PlaneBlock| BlockPrediction {
            place_mm: block.place_mm,
            measured_px: block.shift_px,
            sigma_px: block.sigma_px,
            predicted_px: set.plane_shift_px(plane, block.place_mm),
        };
        let blocks: Vec<_> = plane.blocks.par_iter().map(block).collect();
        let half_mm = 0.5 * plane.width_mm;
        let third = |k: usize| {
            let inside = |b: &&BlockPrediction| {
                let part = (b.place_mm[0] / half_mm + 1.0) * 1.5;
                (part.max(0.0) as usize).min(2) == k
            };
            let count = blocks.iter().filter(inside).count() as f64;
            let mean = |of: &dyn Fn(&BlockPrediction) -> f64| {
                blocks.iter().filter(inside).map(of).sum::<f64>() / count
            };
            (count > 0.0).then(|| [mean(&|b| b.measured_px), mean(&|b| b.predicted_px)])
        };
        Self {
            distance_mm: plane.distance_mm,
            stop: plane.stop,
            wavelength_nm: plane.wavelength_nm,
            held_out: plane.held_out,
            thirds: [0, 1, 2].map(third),
            blocks,
        }
    }
}

/// The kernels where they meet the measured ones best, by Gauss-Newton steps of two parameters.
fn laid_over(set: &Set, field: &FieldKernels, mut place: [f64; 2]) -> [Vec<f64>; 2] {
    let kernels = |place: [f64; 2]| set.kernels(field.place_mm, place);
    let mut now = kernels(place);
    for _ in 0..PLACE_STEPS {
        let moved = [[PLACE_STEP, 0.0], [0.0, PLACE_STEP]]
            .map(|d| kernels([place[0] + d[0], place[1] + d[1]]));
        let mut normal = [0.0; 3];
        let mut right = [0.0; 2];
        for view in 0..2 {
            for (i, k) in now[view].iter().enumerate() {
                let [x, y] = [0, 1].map(|axis| (moved[axis][view][i] - k) / PLACE_STEP);
                let r = field.views[view][i] - k;
                normal = [normal[0] + x * x, normal[1] + x * y, normal[2] + y * y];
                right = [right[0] + x * r, right[1] + y * r];
            }
        }
        let determinant = normal[0] * normal[2] - normal[1] * normal[1];
        if determinant <= 0.0 {
            break;
        }
        let dx = (normal[2] * right[0] - normal[1] * right[1]) / determinant;
        let dy = (normal[0] * right[1] - normal[1] * right[0]) / determinant;
        place = [
            place[0] + dx.clamp(-2.0, 2.0),
            place[1] + dy.clamp(-2.0, 2.0),
        ];
        now = kernels(place);
        if dx.hypot(dy) < 1e-3 {
            break;
        }
    }
    now
}
