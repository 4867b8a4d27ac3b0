//! The camera's disparity against distance over the field, from the simulation: the calibration file of `qpalgo depth`.

use quadpixel::render::Camera;
use quadpixel::render::truth::{ReceptiveField, TextureSpectrum};
use quadpixel_algorithms::depth::FieldCurve;
use rayon::prelude::*;
use std::error::Error;

use crate::measure::GREEN;

/// Nodes over the picture.
const NODES: (usize, usize) = (9, 7);
const RAYS: usize = 512;
/// 1/Z from 0.1 to 2.4 per m.
const DISTANCES: usize = 24;
const STEP_PER_M: f64 = 0.1;
/// What the curve may be wrong by: the pixel is known from one capture, and a match of blurred texture is off by its
/// texture.
const RELATIVE_ERROR: f64 = 0.05;
const OFFSET_ERROR_PX: f64 = 0.02;

/// x_L − x_R, as a matcher of windows of `window_px` finds it, at each node and distance.
pub fn of_camera(
    camera: &Camera,
    source: String,
    window_px: usize,
) -> Result<FieldCurve, Box<dyn Error>> {
    let sensor = camera.sensor();
    let texture = TextureSpectrum {
        window_px: window_px as f64,
        ..TextureSpectrum::default()
    };
    let inverse: Vec<f64> = (1..=DISTANCES).map(|k| STEP_PER_M * k as f64).collect();
    let places = |n: usize, px: usize| -> Vec<f64> {
        (0..n)
            .map(|i| i as f64 / (n - 1) as f64 * (px - 1) as f64)
            .collect()
    };
    let (columns_px, rows_px) = (
        places(NODES.0, sensor.width()),
        places(NODES.1, sensor.height()),
    );
    let node = |x: f64, y: f64| -> Option<Vec<f64>> {
        let field = ReceptiveField::new(camera, GREEN, sensor.position_mm(x, y), RAYS)?;
        let at = |i: &f64| {
            let depth_mm = 1e3 / i - camera.sensor_z_mm();
            field.matched_shift_px(depth_mm, [0, 1], &texture)
        };
        Some(inverse.iter().map(at).collect())
    };
    let disparity_px = (rows_px.par_iter())
        .map(|&y| columns_px.iter().map(|&x| node(x, y)).collect())
        .collect::<Option<Vec<Vec<Vec<f64>>>>>()
        .ok_or("no light reaches a part of the sensor")?;
    let curve = FieldCurve {
        source,
        counted_from: "the sensor".to_owned(),
        width_px: sensor.width(),
        height_px: sensor.height(),
        inverse_distances_per_m: inverse,
        columns_px,
        rows_px,
        disparity_px,
        relative_error: RELATIVE_ERROR,
        offset_error_px: OFFSET_ERROR_PX,
    };
    // Checked as it will be when it is read.
    let text = serde_json::to_string(&curve)?;
    FieldCurve::from_json(&text, "simulated curve").map_err(Into::into)
}
