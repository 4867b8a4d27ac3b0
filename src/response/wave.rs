//! The `wave` level as a table: [`crate::em::wave`] on a grid of directions.
//!
//! Only directions that no symmetry of pixel and lens shift maps onto another are simulated. The simulated grid is fine enough
//! for a cubic (Catmull-Rom) to follow the response; the table stores that cubic `refine` times finer, so that the renderer's bilinear
//! lookup follows it too. Negative overshoots are cut to 0 and sums above 1 scaled to 1.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{AngularResponse, MovingFrame, ResponseAxes, ResponseError, ResponseMeta};
use crate::em::wave::{MODEL, WaveModel, WaveSettings};
use crate::em::{PixelStack, StackError};
use crate::sensor::Subpixels;

/// Directions are simulated up to this sin θ; table nodes further out repeat it along their meridian.
const LARGEST_SINE: f64 = 0.94;

/// What to tabulate. Presets: [`Self::draft`], [`Self::standard`], [`Self::reference`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveTable {
    /// How finely each direction is computed.
    pub wave: WaveSettings,
    /// Wavelengths in nm, increasing.
    pub wavelengths_nm: Vec<f64>,
    /// Largest |u| and |v| of the table.
    pub cosine_max: f64,
    /// Simulated steps from u = 0 to `cosine_max`.
    pub steps: usize,
    /// Table steps in a simulated step.
    pub refine: usize,
}

impl WaveTable {
    /// Quick looks, at 550 nm.
    pub fn draft() -> Self {
        Self {
            wave: WaveSettings::draft(),
            wavelengths_nm: vec![550.0],
            cosine_max: 0.8,
            steps: 12,
            refine: 3,
        }
    }
    /// The default for a 3.5 µm pixel, at 550 nm. Between simulated directions the table is off by 0.5 % of its peak (rms).
    pub fn standard() -> Self {
        Self {
            wave: WaveSettings::standard(),
            steps: 16,
            refine: 4,
            ..Self::draft()
        }
    }
    /// The default for a pixel: [`Self::standard`] with more directions the smaller the pixel is. Resonances in the lossless
    /// layers of small pixels are narrow in angle (a real band of wavelengths evens them out), and its directions cost less.
    pub fn standard_for(stack: &PixelStack) -> Self {
        let steps = (16.0 * 3.5 / stack.pitch_um).round().clamp(12.0, 36.0);
        Self {
            steps: steps as usize,
            ..Self::standard()
        }
    }
    /// Converged, at 550 nm; minutes.
    pub fn reference() -> Self {
        Self {
            wave: WaveSettings::reference(),
            steps: 40,
            refine: 3,
            ..Self::draft()
        }
    }

    /// Ranges in which tables are made.
    pub fn check(&self) -> Result<(), ResponseError> {
        self.wave.check()?;
        if !(self.cosine_max > 0.0 && self.cosine_max <= 0.99) {
            return Err(ResponseError::value(
                "cosine_max",
                self.cosine_max,
                "above 0, at most 0.99",
            ));
        }
        if !(2..=200).contains(&self.steps) {
            return Err(ResponseError::value("steps", self.steps, "2 to 200"));
        }
        if !(1..=16).contains(&self.refine) {
            return Err(ResponseError::value("refine", self.refine, "1 to 16"));
        }
        if self.wavelengths_nm.is_empty() || self.wavelengths_nm.windows(2).any(|w| w[1] <= w[0]) {
            return Err(ResponseError::value(
                "wavelengths_nm",
                format!("{:?}", self.wavelengths_nm),
                "at least one, increasing",
            ));
        }
        Ok(())
    }

    /// Hash of model, pixel and settings: the same key means the same table.
    pub fn key(&self, stack: &PixelStack) -> String {
        let mut hash = blake3::Hasher::new();
        hash.update(MODEL.as_bytes());
        // Debug prints every field, and f64 shortest and unambiguously.
        hash.update(format!("{stack:?}{self:?}").as_bytes());
        hash.finalize().to_hex().to_string()
    }
}

/// Simulates the table of a pixel, on all threads. `progress(done, total)` counts directions; it may be called from any thread.
pub fn wave_response(
    stack: &PixelStack,
    table: &WaveTable,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<AngularResponse, ResponseError> {
    table.check()?;
    stack.check()?;
    let symmetries = symmetries(stack);
    let canonical = canonical_nodes(table.steps as i64, &symmetries);
    let total = canonical.len() * table.wavelengths_nm.len();
    let done = AtomicUsize::new(0);
    let step = table.cosine_max / table.steps as f64;
    let mut values = Vec::new();
    for &wavelength_nm in &table.wavelengths_nm {
        let model = WaveModel::new(stack, wavelength_nm, &table.wave)?;
        let simulated: Result<BTreeMap<Node, Vec<f64>>, StackError> = canonical
            .par_iter()
            .map(|&node| {
                let (mut u, mut v) = (node.0 as f64 * step, node.1 as f64 * step);
                let sine = u.hypot(v);
                if sine > LARGEST_SINE {
                    (u, v) = (u * LARGEST_SINE / sine, v * LARGEST_SINE / sine);
                }
                let powers = model.solve(u, v)?;
                progress(done.fetch_add(1, Ordering::Relaxed) + 1, total);
                Ok((node, powers.absorbed))
            })
            .collect();
        let grid = unfold(
            &simulated?,
            table.steps as i64,
            &symmetries,
            stack.subpixels,
        );
        values.extend(refined(
            &grid,
            2 * table.steps + 1,
            table.refine,
            stack.subpixels.count(),
        ));
    }
    let half = (table.steps * table.refine) as i64;
    let axis: Vec<f64> = (-half..=half)
        .map(|i| table.cosine_max * i as f64 / half as f64)
        .collect();
    let axes = ResponseAxes {
        wavelengths_nm: table.wavelengths_nm.clone(),
        shifts_um: vec![[0.0, 0.0]],
        u: axis.clone(),
        v: axis,
    };
    let json =
        |e: serde_json::Error| ResponseError::value("pixel", e.to_string(), "finite numbers");
    let meta = ResponseMeta {
        model: MODEL.to_owned(),
        settings: serde_json::to_value(table).map_err(json)?,
        pixel: serde_json::to_value(stack).map_err(json)?,
        pitch_um: stack.pitch_um,
        subpixels: stack.subpixels,
        frame: moving_frame(stack, table.wavelengths_nm[0])?,
        key: table.key(stack),
    };
    AngularResponse::new(axes, meta, values)
}

/// n of the lens, and the depth of the silicon below the mean lens surface in lengths of it: `H = Σ d_i n / n_i`.
fn moving_frame(stack: &PixelStack, wavelength_nm: f64) -> Result<MovingFrame, ResponseError> {
    let index = |m: &crate::em::Material| m.index(wavelength_nm).map(|n| n.re);
    let n = index(&stack.lens.material)?;
    let mut height = stack.mean_lens_height_um();
    for layer in &stack.layers {
        height += layer.thickness_um * n / index(&layer.material)?;
    }
    MovingFrame::new(n, height)
}

/// Place on the simulated grid, (0, 0) in the middle.
type Node = (i64, i64);

/// A symmetry of the square: first swap the axes, then change signs.
#[derive(Clone, Copy)]
struct Symmetry {
    swap: bool,
    sign_x: i64,
    sign_y: i64,
}

impl Symmetry {
    fn node(self, (a, b): Node) -> Node {
        let (a, b) = if self.swap { (b, a) } else { (a, b) };
        (a * self.sign_x, b * self.sign_y)
    }
    /// The sub-pixel that sub-pixel `i` becomes.
    fn sub_pixel(self, s: Subpixels, i: usize) -> usize {
        let (c, r) = s.column_row(i);
        let (c, r) = if self.swap { (r, c) } else { (c, r) };
        let c = if self.sign_x < 0 { s.m() - 1 - c } else { c };
        let r = if self.sign_y < 0 { s.n() - 1 - r } else { r };
        s.index(c, r)
    }
}

/// The symmetries that leave the pixel and its lens shift as they are.
fn symmetries(stack: &PixelStack) -> Vec<Symmetry> {
    let [sx, sy] = stack.lens.shift_um;
    let mut found = Vec::new();
    for swap in [false, true] {
        for sign_x in [1, -1] {
            for sign_y in [1, -1] {
                let (a, b) = if swap { (sy, sx) } else { (sx, sy) };
                let keeps_shift = a * sign_x as f64 == sx && b * sign_y as f64 == sy;
                let keeps_pixel = !swap || stack.subpixels.m() == stack.subpixels.n();
                if keeps_shift && keeps_pixel {
                    found.push(Symmetry {
                        swap,
                        sign_x,
                        sign_y,
                    });
                }
            }
        }
    }
    found
}

fn canonical_nodes(steps: i64, symmetries: &[Symmetry]) -> Vec<Node> {
    let mut nodes = Vec::new();
    for a in -steps..=steps {
        for b in -steps..=steps {
            if symmetries.iter().all(|s| s.node((a, b)) >= (a, b)) {
                nodes.push((a, b));
            }
        }
    }
    nodes
}

/// All nodes [v][u][sub-pixel] from the simulated ones.
fn unfold(
    simulated: &BTreeMap<Node, Vec<f64>>,
    steps: i64,
    symmetries: &[Symmetry],
    subpixels: Subpixels,
) -> Vec<f64> {
    let mut grid = Vec::new();
    for b in -steps..=steps {
        for a in -steps..=steps {
            // Light from this node, seen through the symmetry, is light from the simulated one.
            let source = symmetries
                .iter()
                .find_map(|s| simulated.get(&s.node((a, b))).map(|p| (s, p)));
            match source {
                Some((s, p)) => {
                    grid.extend((0..subpixels.count()).map(|i| p[s.sub_pixel(subpixels, i)]));
                }
                // Not reached: every orbit holds its own smallest node.
                None => grid.extend((0..subpixels.count()).map(|_| 0.0)),
            }
        }
    }
    grid
}

/// A grid of `n × n` nodes, Catmull-Rom refined along both axes and held to 0 ≤ P, Σ P ≤ 1.
fn refined(grid: &[f64], n: usize, refine: usize, count: usize) -> Vec<f32> {
    let along_u = refine_rows(grid, n, n, refine, count);
    let fine = (n - 1) * refine + 1;
    let turned = transpose(&along_u, n, fine, count);
    let both = refine_rows(&turned, fine, n, refine, count);
    let mut p = transpose(&both, fine, fine, count);
    for node in p.chunks_exact_mut(count) {
        for p in node.iter_mut() {
            *p = p.max(0.0);
        }
        let sum: f64 = node.iter().sum();
        if sum > 1.0 {
            node.iter_mut().for_each(|p| *p /= sum);
        }
    }
    p.iter().map(|&p| p as f32).collect()
}

fn refine_rows(grid: &[f64], rows: usize, n: usize, refine: usize, count: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(rows * ((n - 1) * refine + 1) * count);
    for row in grid.chunks_exact(n * count) {
        // Beyond the ends the row goes on straight.
        let at = |i: isize, k: usize| -> f64 {
            let node = |i: usize| row[i * count + k];
            if i < 0 {
                2.0 * node(0) - node(1)
            } else if i as usize >= n {
                2.0 * node(n - 1) - node(n - 2)
            } else {
                node(i as usize)
            }
        };
        for fine in 0..=(n - 1) * refine {
            let i = (fine / refine) as isize;
            let t = (fine % refine) as f64 / refine as f64;
            for k in 0..count {
                let (a, b) = (at(i - 1, k), at(i, k));
                let (c, d) = (at(i + 1, k), at(i + 2, k));
                out.push(
                    b + 0.5
                        * t
                        * (c - a
                            + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a))),
                );
            }
        }
    }
    out
}

fn transpose(grid: &[f64], rows: usize, columns: usize, count: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(grid.len());
    for c in 0..columns {
        for r in 0..rows {
            let at = (r * columns + c) * count;
            out.extend_from_slice(&grid[at..at + count]);
        }
    }
    out
}
