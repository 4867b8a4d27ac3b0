//! Maxwell's equations on the 6 µm pixel: the Fourier modal level (`rcwa`) on the meridian along the split, v = 0,
//! where a mirror halves the work; between its directions and beside the meridian the wave model carries it.
//!
//! ```text
//! P_i(u, v) = wave_i(u, v) + [rcwa_i(u, 0) − wave_i(u, 0)]
//! ```
//! The pixel is parted along x only, so that what is split is decided by u; along v the difference hardly turns.

use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::{RcwaModel, RcwaSettings};
use quadpixel::file;
use quadpixel::response::AngularResponse;
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::path::Path;

/// The runs that come with the example.
const KEPT: &str = include_str!("exact_6um_dual.json");
const WAVELENGTH_NM: f64 = 550.0;
/// Orders of a lens whose steepest side bends light by 18°: what follows from more stands on the page.
const SETTINGS: RcwaSettings = RcwaSettings {
    slice_nm: 90.0,
    lens_cutoff: 1.2,
    wall_cutoff: 1.2,
    silicon_margin: 0.0,
};

/// One direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Direction cosine along x; v = 0.
    pub u: f64,
    /// P of the left and the right photodiode, mean of s and p.
    pub p: [f64; 2],
    /// Wall clock, s.
    pub seconds: f64,
}

/// Runs on one pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// The pixel.
    pub pixel: PixelStack,
    /// How finely.
    pub settings: RcwaSettings,
    /// u from 0, increasing; −u is the mirror image.
    pub runs: Vec<Run>,
}

impl Runs {
    /// Those that come with the example, if they are of this pixel.
    pub fn kept(stack: &PixelStack) -> Result<Option<Self>, Box<dyn Error>> {
        let kept: Option<Self> = serde_json::from_str(KEPT)?;
        Ok(kept.filter(|k| k.pixel == *stack && k.runs.len() > 1))
    }

    /// Makes them at `u`, and writes `file` after each.
    pub fn make(stack: &PixelStack, u: &[f64], file: &Path) -> Result<(), Box<dyn Error>> {
        let model = RcwaModel::new(stack, WAVELENGTH_NM, &SETTINGS)?;
        let mut made = Self {
            pixel: stack.clone(),
            settings: SETTINGS,
            runs: Vec::new(),
        };
        for &u in u {
            let began = std::time::Instant::now();
            let answer = model.solve(u, 0.0)?;
            let seconds = began.elapsed().as_secs_f64();
            made.runs.push(Run {
                u,
                p: [0, 1].map(|i| 0.5 * (answer.s().absorbed[i] + answer.p().absorbed[i])),
                seconds,
            });
            let text = serde_json::to_string_pretty(&made)?;
            file::write_aside(file, (text + "\n").as_bytes())?;
            eprintln!("real_camera: exact run at u = {u}: {seconds:.0} s");
        }
        Ok(())
    }

    /// The table of the wave model, moved to agree with the runs on their meridian; |u| beyond the last run keeps its
    /// difference.
    pub fn correct(&self, wave: &AngularResponse) -> Result<AngularResponse, Box<dyn Error>> {
        let lookup = wave.interpolator(WAVELENGTH_NM);
        let differences: Vec<[f64; 2]> = (self.runs.iter())
            .map(|run| {
                let mut p = [0.0f32; 2];
                lookup.weights(run.u as f32, 0.0, &mut p);
                [0, 1].map(|i| run.p[i] - f64::from(p[i]))
            })
            .collect();
        let difference = |u: f64| -> [f64; 2] {
            let (at, last) = (u.abs(), self.runs.len() - 1);
            let k = self.runs.partition_point(|r| r.u < at).clamp(1, last);
            let (a, b) = (self.runs[k - 1].u, self.runs[k].u);
            let t = ((at - a) / (b - a)).clamp(0.0, 1.0);
            let own = [0, 1].map(|i| differences[k - 1][i] * (1.0 - t) + differences[k][i] * t);
            if u < 0.0 { [own[1], own[0]] } else { own }
        };
        let axes = wave.axes();
        let mut values = Vec::with_capacity(wave.table().len());
        for (k, p) in wave.table().chunks_exact(2).enumerate() {
            let d = difference(axes.u[k % axes.u.len()]);
            values.extend([0, 1].map(|i| (f64::from(p[i]) + d[i]).clamp(0.0, 1.0) as f32));
        }
        let mut meta = wave.meta().clone();
        meta.key = format!("{} / rcwa on the meridian", meta.key);
        AngularResponse::new(axes.clone(), meta, values).map_err(Into::into)
    }
}
