//! Ways to interpolate between lens shifts.

use quadpixel::em::ShiftGrid;
use quadpixel::response::{AngularResponse, Interpolator, ShiftedInterpolator};
use quadpixel::sensor::Subpixels;

use super::places::Place;

/// A way to interpolate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// The paper's: linear in both shifts and both direction cosines.
    Linear,
    /// Linear in the shifts, each node read where the first-order moving frame says.
    Moving,
    /// Ours: the Fourier series in the shift.
    Fourier,
}

impl Way {
    pub const ALL: [Self; 3] = [Self::Linear, Self::Moving, Self::Fourier];

    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Moving => "moving frame",
            Self::Fourier => "fourier",
        }
    }
}

/// The nodes of a table, ready for all ways.
pub(super) struct Nodes {
    grid: ShiftGrid,
    stored: usize,
    /// Row-major.
    each: Vec<Interpolator>,
    series: ShiftedInterpolator,
}

impl Nodes {
    /// `None` for a table of the centred lens.
    pub fn new(table: &AngularResponse, wavelength_nm: f64) -> Option<Self> {
        let grid = table.meta().shift_grid?;
        let n = grid.per_pitch;
        let each = (0..n * n)
            .map(|k| table.interpolator_at_shift([k / n, k % n], wavelength_nm))
            .collect::<Option<_>>()?;
        Some(Self {
            grid,
            stored: table.axes().shifts_um.len(),
            each,
            series: table.shifted_interpolator(wavelength_nm)?,
        })
    }

    pub fn subpixels(&self) -> Subpixels {
        self.series.subpixels()
    }
    pub fn per_pitch(&self) -> usize {
        self.grid.per_pitch
    }
    pub fn stored(&self) -> usize {
        self.stored
    }

    /// The weights `[ray][sub-pixel]` of a place.
    pub fn weights(&self, way: Way, place: &Place) -> Vec<f32> {
        let count = self.subpixels().count();
        let mut out = vec![0f32; place.u.len() * count];
        if way == Way::Fourier {
            self.series
                .weights_batch(place.shift_um, &place.u, &place.v, &mut out);
            return out;
        }
        let n = self.grid.per_pitch;
        let step = self.grid.pitch_um / n as f64;
        let at = place.shift_um.map(|s| s / step);
        let mut read = out.clone();
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let node = [at[0].floor() as i64 + i, at[1].floor() as i64 + j];
            let part = |x: f64, i: i64| {
                let t = x - x.floor();
                if i == 1 { t } else { 1.0 - t }
            };
            let weight = (part(at[0], i) * part(at[1], j)) as f32;
            let [a, b] = node.map(|i| i.rem_euclid(n as i64) as usize);
            let lookup = &self.each[a * n + b];
            let (mut u, mut v) = (place.u.clone(), place.v.clone());
            if way == Way::Moving {
                let from_node = [0, 1].map(|k: usize| place.shift_um[k] - node[k] as f64 * step);
                lookup.frame().centred_batch(from_node, &mut u, &mut v);
            }
            lookup.weights_batch(&u, &v, &mut read);
            for (o, r) in out.iter_mut().zip(&read) {
                *o += weight * r;
            }
        }
        out
    }
}

/// How far one way with some of the nodes is off.
pub(super) struct Deviation {
    pub way: Way,
    pub per_pitch: usize,
    pub stored: usize,
    /// Of a view's brightness at the held-out places, in parts of the mean view: RMS and largest.
    pub flat_rms: f64,
    pub flat_max: f64,
    /// Of P over all rays, in parts of the largest P.
    pub ray_rms: f64,
}

impl Deviation {
    /// Against the weights `[ray][sub-pixel]` of each held-out place.
    pub fn new(nodes: &Nodes, way: Way, held_out: &[Place], truths: &[Vec<f32>]) -> Self {
        let count = nodes.subpixels().count();
        let (mut flat_squares, mut flat_max, mut flats) = (0.0, 0f64, 0.0);
        let (mut ray_squares, mut rays, mut peak) = (0.0, 0.0, 0f64);
        for (place, truth) in held_out.iter().zip(truths) {
            let weights = &nodes.weights(way, place);
            let (a, b) = (place.flat(weights, count), place.flat(truth, count));
            let mean = b.iter().sum::<f64>() / count as f64;
            for (a, b) in a.iter().zip(&b) {
                let off = (a - b) / mean;
                flat_squares += off * off;
                flat_max = flat_max.max(off.abs());
                flats += 1.0;
            }
            for (a, b) in weights.iter().zip(truth) {
                ray_squares += f64::from(a - b).powi(2);
                rays += 1.0;
                peak = peak.max(f64::from(*b));
            }
        }
        Self {
            way,
            per_pitch: nodes.per_pitch(),
            stored: nodes.stored(),
            flat_rms: (flat_squares / flats).sqrt(),
            flat_max,
            ray_rms: (ray_squares / rays).sqrt() / peak,
        }
    }
}
