//! What was found, and its files: the page, a plot, depth maps, and the numbers once more as JSON.

use std::error::Error;
use std::path::Path;

use quadpixel::file;
use quadpixel::image::colour::viridis;
use quadpixel::image::{Image, raster};
use quadpixel_algorithms::depth::FieldCurve;
use serde_json::{Value, json};

use crate::aperture::{self, Point};
use crate::compare::Likeness;
use crate::depths::{CLAIM_M, Found, Score};
use crate::measure::Shift;
use crate::noise;
use crate::page;

/// Depth pictures are this much smaller than the views: plots, not photographs.
const SMALLER: usize = 3;

/// The lens at one mark.
pub struct LensResult {
    pub mark: f64,
    pub stop_semi_mm: f64,
    pub efl_mm: f64,
    pub f_number: f64,
    pub sensor_from_vertex_mm: f64,
    pub focus_from_vertex_mm: f64,
}

/// One capture simulated.
pub struct CaptureResult {
    pub distance_mm: f64,
    pub mark: f64,
    pub coc_px: f64,
    pub measured: Vec<Shift>,
    pub models: Vec<ModelResult>,
}

/// By one model.
pub struct ModelResult {
    pub name: String,
    pub likeness: Likeness,
    pub shifts: Vec<Shift>,
}

/// Shift over circle of confusion.
#[derive(Default)]
pub struct ApertureResult {
    /// Name and points of each model.
    pub curves: Vec<(String, Vec<Point>)>,
    /// Name, circle of confusion (px), shift (px) and point of each capture.
    pub measured: Vec<(String, f64, f64, Point)>,
}

/// Depth of one capture.
pub struct DepthResult {
    pub name: String,
    pub mark: f64,
    /// plane, box, casual.
    pub kind: String,
    /// Whether the pixel was fitted on it.
    pub fitted: bool,
    pub claimed: Score,
    pub all: Score,
    pub found: Found,
    pub known_m: Image,
}

/// Everything.
#[derive(Default)]
pub struct Results {
    pub lens: Vec<LensResult>,
    pub captures: Vec<CaptureResult>,
    pub aperture: ApertureResult,
    pub depths: Vec<DepthResult>,
    /// Name, and variance of the noise of the left over that of the right view by parts of the width.
    pub noise: Vec<(String, [f64; noise::PARTS])>,
    /// What was found and not used, and why.
    pub left_out: Vec<String>,
}

/// Writes a curve file for `qpalgo depth`.
pub fn write_curve(out: &Path, mark: f64, curve: &FieldCurve) -> Result<(), Box<dyn Error>> {
    let text = serde_json::to_string(curve)?;
    let file = (format!("curve-f{mark}.json"), (text + "\n").into_bytes());
    file::write_folder(out, &[file]).map_err(Into::into)
}

impl Results {
    /// Writes README.md, results.json, aperture.svg and a picture of each scene's depth.
    pub fn write(&self, out: &Path) -> Result<(), Box<dyn Error>> {
        let colours = ["#1f6fb2", "#2e9e5b", "#b07cc6", "#888888"];
        // The sharp split is the last one, whether there is an exact one or not.
        let colour = |i: usize| match i + 1 == self.aperture.curves.len() {
            true => colours[3],
            false => colours[i.min(2)],
        };
        let colours = (0..self.aperture.curves.len()).map(colour);
        let curves: Vec<(&str, &'static str, &[Point])> =
            (self.aperture.curves.iter().zip(colours))
                .map(|((name, points), colour)| (name.as_str(), colour, points.as_slice()))
                .collect();
        let measured: Vec<(String, Point)> = (self.aperture.measured.iter())
            .map(|(name, _, _, point)| (name.clone(), *point))
            .collect();
        let json = serde_json::to_string_pretty(&self.json())?;
        let page = page::page(self)?;
        let mut files = vec![
            ("README.md".to_owned(), page.into_bytes()),
            ("results.json".to_owned(), (json + "\n").into_bytes()),
            (
                "aperture.svg".to_owned(),
                aperture::plot(&curves, &measured).into_bytes(),
            ),
        ];
        for depth in &self.depths {
            let (codes, width, height) = depth.picture();
            let name = depth.picture_name();
            let bytes = raster::encode_png8(Path::new(&name), &codes, width, height, 3)?;
            files.push((name, bytes));
        }
        file::write_folder(out, &files).map_err(Into::into)
    }

    fn json(&self) -> Value {
        let shifts = |s: &[Shift]| -> Value {
            s.iter()
                .map(|s| json!({ "whole_px": s.whole_px, "median_px": s.median_px }))
                .collect()
        };
        let score = |s: &Score| json!({ "mean_m": s.mean_m, "median_m": s.median_m, "relative": s.relative, "accuracy": s.accuracy, "share": s.share });
        let captures: Value = (self.captures.iter())
            .map(|c| {
                let models: Value = (c.models.iter())
                    .map(|m| json!({ "name": m.name, "psnr_db": m.likeness.psnr_db, "ssim": m.likeness.ssim, "shifts": shifts(&m.shifts) }))
                    .collect();
                json!({ "distance_mm": c.distance_mm, "mark": c.mark, "coc_px": c.coc_px, "measured": shifts(&c.measured), "models": models })
            })
            .collect();
        let depths: Value = (self.depths.iter())
            .map(|d| json!({ "name": d.name, "mark": d.mark, "kind": d.kind, "fitted": d.fitted, "claimed": score(&d.claimed), "all": score(&d.all) }))
            .collect();
        json!({ "captures": captures, "aperture": { "curves": self.aperture.curves, "measured": self.aperture.measured }, "depths": depths, "noise_left_over_right": self.noise, "left_out": self.left_out })
    }
}

impl DepthResult {
    /// File of [`Self::picture`].
    pub fn picture_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        format!(
            "depth-{}-f{}.png",
            self.name.chars().map(plain).collect::<String>(),
            self.mark
        )
    }

    /// Claimed depth beside the known one: codes, width, height.
    fn picture(&self) -> (Vec<u8>, usize, usize) {
        let (width, height) = (
            self.known_m.width() / SMALLER,
            self.known_m.height() / SMALLER,
        );
        let inverse = |z: f32| if z > 0.0 { 1.0 / z } else { f32::NAN };
        let mut known: Vec<f32> = (self.known_m.data().iter())
            .map(|z| inverse(*z))
            .filter(|v| v.is_finite())
            .collect();
        known.sort_by(f32::total_cmp);
        let at = |percent: usize| {
            known
                .get(known.len().saturating_sub(1) * percent / 100)
                .copied()
                .unwrap_or(1.0)
        };
        // A plane has no range of its own: 0.2 per m on either side.
        let (low, high) = (at(2).min(at(50) - 0.2), at(98).max(at(50) + 0.2));
        let mut codes = Vec::with_capacity(6 * width * height);
        for y in 0..height {
            for image in [&self.found.z_m, &self.known_m] {
                for x in 0..width {
                    let (x, y) = (x * SMALLER, y * SMALLER);
                    let claimed = f64::from(self.found.sigma_m.pixel(x, y)[0]) <= CLAIM_M;
                    let shown = claimed || std::ptr::eq(image, &self.known_m);
                    let v = inverse(image.pixel(x, y)[0]);
                    codes.extend(if shown && v.is_finite() {
                        viridis((v - low) / (high - low))
                    } else {
                        [0; 3]
                    });
                }
            }
        }
        (codes, 2 * width, height)
    }
}
