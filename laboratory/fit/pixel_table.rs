//! What the halves of a pixel get from every direction under every lens shift, by the wave model; by Fourier modes, to
//! confirm it.
//!
//! P of a half is periodic in the lens shift s along the split, with the pitch p. From N shifts of one period
//!
//! ```text
//! P(u, v; s) = Σ_j w_j(s) P(u, v; j p / N),   w_j(s) = 1/N Σ_k g_k cos(2π k (s − j p / N)/p),   |k| < N/2
//! ```
//! is exact for what the pixel resolves. Charge that wanders by a Gaussian of deviation σ before it is collected (see
//! E. G. Stevens, IEEE Trans. Electron Devices 39, 2621 (1992)) is collected as if the light lay elsewhere, so that it
//! is the mean over shifts: `g_k = exp(−(2π k σ / p)²/2)`, or its mean over the depths that the charge comes from.
//! Mirrored pixels give the other sign of u: P_L(−u, v; s) = P_R(u, v; −s).

use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{PixelModel, PixelStack};
use quadpixel::sensor::{MovingFrame, Wandering};
use rayon::prelude::*;
use serde::Serialize;

use super::error::FitError;
use super::keeping::Keeping;

/// How finely directions and shifts are taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TableFineness {
    /// Steps of direction cosines over the radius of the pupil.
    pub steps: usize,
    /// Lens shifts per pitch.
    pub shifts: usize,
    /// The wave model's own.
    pub wave: WaveSettings,
    /// Fourier modes in the place of waves, to confirm what was found by these.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub modes: Option<RcwaSettings>,
}

/// P of both halves, for u ≥ 0 and v ≥ 0, under all shifts.
#[derive(Debug)]
pub struct PixelTable {
    pitch_um: f64,
    frame: MovingFrame,
    step: f64,
    /// Of u and of v.
    nodes: [usize; 2],
    shifts: usize,
    /// `[half][shift][v][u]`
    values: Vec<f64>,
}

/// P of both halves over u (both signs) and v ≥ 0, under one shift and diffusion.
#[derive(Clone, Debug)]
pub struct ShiftedHalves {
    step: f64,
    nodes: [usize; 2],
    /// `[v][u]`, u from −(nodes − 1) to nodes − 1: left, right.
    values: Vec<[f64; 2]>,
}

impl PixelTable {
    /// Of a pixel of two columns, to direction cosines of `reach`: those of the pupil's rim along v, and along u with
    /// the chief ray's. What was kept of an earlier run is taken from there.
    ///
    /// # Errors
    /// A pixel that cannot be; a stop that was asked for.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        reach: [f64; 2],
        fineness: &TableFineness,
        keeping: Option<&Keeping<'_>>,
    ) -> Result<Self, FitError> {
        let model = match fineness.modes {
            Some(settings) => PixelModel::Rcwa(settings),
            None => PixelModel::Wave(fineness.wave),
        };
        let solver = model.solver_of_shifts(stack, wavelength_nm)?;
        let (step, nodes) = directions(reach, fineness);
        let shifts = fineness.shifts;
        let pitch_um = stack.pitch_um;
        let places: Vec<[f64; 2]> = (0..shifts)
            .map(|j| [pitch_um * j as f64 / shifts as f64, 0.0])
            .collect();
        let columns = stack.subpixels.m();
        let made_of = (model.version(), stack, wavelength_nm, reach, fineness);
        let kept = keeping.map(|keeping| keeping.answers(&made_of, nodes[0] * nodes[1]));
        let kept = kept.transpose()?;
        let answers: Vec<Vec<[f64; 2]>> = (0..nodes[0] * nodes[1])
            .into_par_iter()
            .map(|i| {
                if let Some(answer) = kept.as_ref().and_then(|kept| kept.answer(i)) {
                    return Ok(answer);
                }
                let (u, v) = ((i % nodes[0]) as f64 * step, (i / nodes[0]) as f64 * step);
                let light = solver.under_shifts(u, v, &places)?;
                let halves = light.iter().map(|l| {
                    let mut sums = [0.0; 2];
                    for (k, a) in l.mean.absorbed.iter().enumerate() {
                        sums[usize::from(2 * (k % columns) >= columns)] += a;
                    }
                    sums
                });
                let answer: Vec<[f64; 2]> = halves.collect();
                match &kept {
                    Some(kept) => kept.keep(i, answer),
                    None => Ok(answer),
                }
            })
            .collect::<Result<_, FitError>>()?;
        let mut values = vec![0.0; 2 * shifts * nodes[0] * nodes[1]];
        for (i, answer) in answers.iter().enumerate() {
            for (j, halves) in answer.iter().enumerate() {
                for (half, p) in halves.iter().enumerate() {
                    values[(half * shifts + j) * nodes[0] * nodes[1] + i] = *p;
                }
            }
        }
        Ok(Self {
            pitch_um,
            frame: stack.moving_frame(wavelength_nm)?,
            step,
            nodes,
            shifts,
            values,
        })
    }

    /// Directions and lens shifts that such a table holds.
    pub fn size(reach: [f64; 2], fineness: &TableFineness) -> [usize; 2] {
        let (_, [along, across]) = directions(reach, fineness);
        [along * across, fineness.shifts]
    }

    /// The shift of a microlens that brings light of this direction cosine along the split to the middle, to first
    /// order, µm.
    pub fn shift_for_um(&self, u: f64) -> f64 {
        self.frame.shift_for_chief_ray(u, 0.0)[0]
    }

    /// Weights of the shifts at `shift_um`, after diffusion.
    fn weights(&self, shift_um: f64, kept: &[f64]) -> Vec<f64> {
        let n = self.shifts as f64;
        let wave = 2.0 * std::f64::consts::PI / self.pitch_um;
        (0..self.shifts)
            .map(|j| {
                let from = shift_um - self.pitch_um * j as f64 / n;
                let terms = (kept.iter().enumerate())
                    .map(|(k, kept)| 2.0 * kept * (wave * (k + 1) as f64 * from).cos());
                (1.0 + terms.sum::<f64>()) / n
            })
            .collect()
    }

    /// Both halves under a shift of the lens along x, with diffusion, and `crosstalk` of each half's light in the
    /// other.
    pub fn shifted(
        &self,
        shift_um: f64,
        diffusion_um: f64,
        crosstalk: f64,
        wandering: &Wandering,
    ) -> ShiftedHalves {
        let turns = 2.0 * std::f64::consts::PI * diffusion_um / self.pitch_um;
        let harmonics = 1..self.shifts.div_ceil(2);
        let kept: Vec<f64> = harmonics
            .map(|k| wandering.kept(turns * k as f64))
            .collect();
        let [nodes, rows] = self.nodes;
        let plane = |half: usize, weights: &[f64]| {
            let mut sum = vec![0.0; nodes * rows];
            for (j, w) in weights.iter().enumerate() {
                let from = &self.values[(half * self.shifts + j) * nodes * rows..][..nodes * rows];
                for (s, p) in sum.iter_mut().zip(from) {
                    *s += w * p;
                }
            }
            sum
        };
        let ahead = self.weights(shift_um, &kept);
        let mirrored = self.weights(-shift_um, &kept);
        let positive = [plane(0, &ahead), plane(1, &ahead)];
        let negative = [plane(1, &mirrored), plane(0, &mirrored)];
        let mut values = Vec::with_capacity(rows * (2 * nodes - 1));
        for v in 0..rows {
            for i in 0..2 * nodes - 1 {
                let (side, u) = match i < nodes - 1 {
                    true => (&negative, nodes - 1 - i),
                    false => (&positive, i + 1 - nodes),
                };
                let [l, r] = [0, 1].map(|half| side[half][v * nodes + u]);
                let mixed = |a: f64, b: f64| (1.0 - crosstalk) * a + crosstalk * b;
                values.push([mixed(l, r), mixed(r, l)]);
            }
        }
        ShiftedHalves {
            step: self.step,
            nodes: self.nodes,
            values,
        }
    }
}

impl ShiftedHalves {
    /// P of left and right from (u, v): cubic, with the slopes of the neighbours' differences (Catmull and Rom), so
    /// that no slope jumps; beyond the table's end its edge.
    pub fn at(&self, u: f64, v: f64) -> [f64; 2] {
        let (columns, rows) = (2 * self.nodes[0] - 1, self.nodes[1]);
        let (i, a) = place(u / self.step + (self.nodes[0] - 1) as f64, columns);
        let (j, b) = place(v.abs() / self.step, rows);
        let (across, down) = (cubic(a), cubic(b));
        let mut sum = [0.0; 2];
        for (dj, down) in (-1..).zip(down) {
            // Even in v.
            let row = (j + dj).abs().min(rows as isize - 1) as usize;
            for (di, across) in (-1..).zip(across) {
                let column = (i + di).clamp(0, columns as isize - 1) as usize;
                let value = self.values[row * columns + column];
                let weight = across * down;
                (sum[0], sum[1]) = (sum[0] + weight * value[0], sum[1] + weight * value[1]);
            }
        }
        sum
    }
}

/// Distance of the direction cosines of a table, and their number along u and v.
fn directions(reach: [f64; 2], fineness: &TableFineness) -> (f64, [usize; 2]) {
    let step = reach[1] / fineness.steps as f64;
    let along = (reach[0] / step).ceil() as usize + 1;
    (step, [along, fineness.steps + 1])
}

/// The node below a place, and how far beyond it.
fn place(x: f64, count: usize) -> (isize, f64) {
    let x = x.clamp(0.0, (count - 1) as f64);
    let low = (x as usize).min(count - 2);
    (low as isize, x - low as f64)
}

/// Weights of the nodes −1 to 2 at 0 to 1 between the two in the middle (Catmull and Rom).
pub(super) fn cubic(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (2.0 * t2 - t - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use quadpixel::em::Material;
    use quadpixel::em::mosaic::{FilterColour, Mosaic};
    use quadpixel::sensor::CollectedAt;

    use super::super::camera_model::Fineness;
    use super::*;

    /// Left and right from two directions.
    fn halves(stack: &PixelStack) -> [[f64; 2]; 2] {
        let fineness = TableFineness {
            steps: 2,
            shifts: 8,
            ..Fineness::draft().table
        };
        let table = PixelTable::new(stack, 550.0, [0.2, 0.2], &fineness, None).unwrap();
        let silicon = stack.silicon_at(550.0).unwrap();
        let wandering = Wandering::new(CollectedAt::Anywhere, &silicon);
        let halves = table.shifted(0.0, 0.0, 0.0, &wandering);
        [0.0, 0.2].map(|u| halves.at(u, 0.0))
    }

    #[test]
    fn neighbours_of_other_colours_send_less_light_over() {
        let mut stack = PixelStack::builtin("1.4um-dual").unwrap();
        let alike = halves(&stack);
        let filter = |name: &str| Material::Table(name.into());
        stack.mosaic = Some(Mosaic {
            red: filter("CFA_red_SYNTH"),
            blue: filter("CFA_blue_SYNTH"),
            colour: FilterColour::Green,
        });
        let unlike = halves(&stack);
        let straight = unlike[0];
        assert!(
            (straight[0] / straight[1] - 1.0).abs() < 1e-3,
            "{straight:?}"
        );
        let less_lit = |of: [f64; 2]| of[0].min(of[1]) / (of[0] + of[1]);
        let [alike, unlike] = [alike[1], unlike[1]].map(less_lit);
        assert!(unlike < 0.8 * alike, "{unlike} {alike}");
    }
}
