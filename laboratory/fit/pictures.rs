//! Kernels measured, predicted, and their difference, as pictures.

use std::path::Path;

use quadpixel::image::ImageError;
use quadpixel::image::colour::{Rgb, blue_white_red, viridis};
use quadpixel::image::raster;

use super::measurements::Measurements;
use super::prediction::Prediction;

/// Writes a contact sheet: per field left measured, predicted, difference, and below it right. Differences are full
/// colour at a quarter of the peak.
///
/// # Errors
/// The picture cannot be encoded; `path` is for that message only.
pub fn residuals_png(
    path: &Path,
    measured: &Measurements,
    predicted: &Prediction,
) -> Result<Vec<u8>, ImageError> {
    let side = measured.side;
    let [columns, rows] = measured.grid;
    let (width, height) = (columns * (3 * side + 2), rows * (2 * side + 2));
    let mut codes = vec![255u8; 3 * width * height];
    for (i, (field, model)) in measured.fields.iter().zip(&predicted.fields).enumerate() {
        let corner = [i % columns * (3 * side + 2), i / columns * (2 * side + 2)];
        for (k, (m, p)) in field.views.iter().zip(&model.kernels).enumerate() {
            let peak = m.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            for at in 0..side * side {
                let (x, y) = (corner[0] + at % side, corner[1] + k * side + at / side);
                let difference = 0.5 + 2.0 * (p[at] - m[at]) / peak;
                let colours: [Rgb; 3] = [
                    viridis((m[at] / peak) as f32),
                    viridis((p[at] / peak) as f32),
                    blue_white_red(difference as f32),
                ];
                for (panel, colour) in colours.iter().enumerate() {
                    let to = 3 * (y * width + x + panel * side);
                    codes[to..to + 3].copy_from_slice(colour);
                }
            }
        }
    }
    raster::encode_png8(path, &codes, width, height, 3)
}
