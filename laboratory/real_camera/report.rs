//! The files of what was found: the page, a plot, depth maps, and the numbers once more as JSON.

use std::error::Error;
use std::path::Path;

use quadpixel::file;
use quadpixel::image::raster;
use quadpixel_algorithms::depth::FieldCurve;
use serde_json::{Value, json};

use crate::aperture::{self, Point};
use crate::depths::Score;
use crate::measure::Shift;
use crate::page;
use crate::results::{DepthResult, Results};

/// Writes a curve file for `qpalgo depth`.
pub fn write_curve(out: &Path, name: &str, curve: &FieldCurve) -> Result<(), Box<dyn Error>> {
    let text = serde_json::to_string(curve)?;
    let file = (name.to_owned(), (text + "\n").into_bytes());
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
        for depth in self.shown() {
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
        let depths = |depths: &[DepthResult]| -> Value {
            (depths.iter())
                .map(|d| json!({ "name": d.name, "mark": d.mark, "kind": d.kind, "fitted": d.fitted, "claimed": score(&d.claimed), "all": score(&d.all) }))
                .collect()
        };
        json!({ "captures": captures, "aperture": { "curves": self.aperture.curves, "measured": self.aperture.measured }, "depths": depths(&self.depths), "depths_by_planes": depths(&self.calibrated), "noise_left_over_right": self.noise, "left_out": self.left_out })
    }
}
