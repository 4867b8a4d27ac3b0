//! The coherent study in numbers.

use std::fmt::Write;

use quadpixel::em::PixelStack;
use serde::Serialize;

use super::spot::{Spot, Transfer, disparity_px};
use super::{Curves, GREEN_NM};

/// Places in a pixel over which errors are taken, along x and along y.
const PLACES: usize = 24;
/// Places per pixel of the curves, and pixels to each side of the middle.
const PER_PIXEL: i32 = 24;

/// A pixel behind a lens, in focus or with a blur.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Row {
    pixel: String,
    pitch_um: f64,
    f_number: f64,
    /// λ F/pitch: the spot in pixels.
    spot_px: f64,
    blur_px: f64,
    /// Depth below the microlenses' tops at which both halves see the same, µm.
    plane_um: f64,
    /// Mean over all places of what both halves absorb, coherent and over the cone.
    mean_coherent: f64,
    mean_cone: f64,
    /// RMS of the halves for points in the pixel, over their mean, %.
    point_percent: f64,
    /// RMS of the halves for a texture of points, over that of the signal, %.
    texture_percent: f64,
    /// Contrast at the pixels' Nyquist frequency, left half.
    nyquist_coherent: f64,
    nyquist_model: f64,
    /// Disparity of the halves, px.
    disparity_coherent_px: f64,
    disparity_model_px: f64,
}

impl Row {
    pub fn new(
        stack: &PixelStack,
        f_number: f64,
        (blur_px, plane_um): (f64, f64),
        spot: &Spot,
    ) -> Self {
        let mean = |halves: &[Transfer; 2]| halves.iter().map(Transfer::mean).sum();
        Self {
            pixel: stack.name.clone(),
            pitch_um: stack.pitch_um,
            f_number,
            spot_px: 1e-3 * GREEN_NM * f_number / stack.pitch_um,
            blur_px,
            plane_um,
            mean_coherent: mean(&spot.coherent),
            mean_cone: mean(&spot.incoherent),
            point_percent: 100.0 * spot.point_error(PLACES),
            texture_percent: 100.0 * spot.texture_error(),
            nyquist_coherent: spot.coherent[0].nyquist(),
            nyquist_model: spot.incoherent[0].nyquist(),
            disparity_coherent_px: disparity_px(&spot.coherent),
            disparity_model_px: disparity_px(&spot.incoherent),
        }
    }
}

/// Every row.
pub(super) fn csv(rows: &[Row]) -> String {
    let mut text = String::from(
        "pixel,pitch_um,f_number,spot_px,blur_px,plane_um,mean_coherent,mean_cone,point_percent,texture_percent,\
         nyquist_coherent,nyquist_model,disparity_coherent_px,disparity_model_px\n",
    );
    for r in rows {
        // Writing to a String cannot fail, here and below.
        let _ = writeln!(
            text,
            "\"{}\",{},{},{:.4},{},{:.4},{:.6},{:.6},{:.3},{:.3},{:.4},{:.4},{:.4},{:.4}",
            r.pixel,
            r.pitch_um,
            r.f_number,
            r.spot_px,
            r.blur_px,
            r.plane_um,
            r.mean_coherent,
            r.mean_cone,
            r.point_percent,
            r.texture_percent,
            r.nyquist_coherent,
            r.nyquist_model,
            r.disparity_coherent_px,
            r.disparity_model_px
        );
    }
    text
}

/// Places of a curve, px from the middle of the pixel.
pub(super) fn places_px() -> Vec<f64> {
    (-PER_PIXEL..=PER_PIXEL)
        .map(|k| f64::from(k) / f64::from(PER_PIXEL))
        .collect()
}

/// The curves in focus: what each half of a pixel absorbs of the light of a spot, over the spot's place on the line
/// y = 0 through the pixel's middle.
pub(super) fn places_csv(curves: &[Curves]) -> String {
    let mut text =
        String::from("pixel,f_number,x_px,left_coherent,right_coherent,left_model,right_model\n");
    for c in curves {
        let [a, b] = [0, 1].map(|half| c.spot.coherent[half].line(0.0));
        let [m, n] = [0, 1].map(|half| c.spot.incoherent[half].line(0.0));
        for x in places_px() {
            let _ = writeln!(
                text,
                "\"{}\",{},{x:.4},{:.5},{:.5},{:.5},{:.5}",
                c.pixel,
                c.f_number,
                a.share(x),
                b.share(x),
                m.share(x),
                n.share(x)
            );
        }
    }
    text
}

/// For a person.
pub(super) fn table(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<10} {:>5} {:>7} {:>5} {:>8} {:>7} {:>9} {:>15} {:>15}\n",
        "pixel",
        "F",
        "spot px",
        "blur",
        "plane um",
        "point %",
        "texture %",
        "Nyquist, model",
        "disparity, model"
    );
    for r in rows {
        let _ = writeln!(
            text,
            "{:<10} {:>5} {:>7.3} {:>5} {:>8.2} {:>7.1} {:>9.1} {:>7.3} {:>7.3} {:>7.3} {:>7.3}",
            r.pixel,
            r.f_number,
            r.spot_px,
            r.blur_px,
            r.plane_um,
            r.point_percent,
            r.texture_percent,
            r.nyquist_coherent,
            r.nyquist_model,
            r.disparity_coherent_px,
            r.disparity_model_px
        );
    }
    text
}
