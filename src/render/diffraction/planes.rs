//! The light of a point in planes beside its focus, |∫ exp(i (W(q) + c |q|² − κ·q)) d²q|², summed directly.

use glam::DVec2;

use super::kernel::Kernel;
use super::phase_draw::PLASTIC;
use super::wavefront::Wavefront;
use crate::simd::SimdLevel;

/// Points over the square around the pupil that the phase is summed at, along each side.
const POINTS: usize = 64;
/// Distance of places that the intensity is summed at.
const STEP: f64 = 0.5;

/// The wave on a square grid.
pub(super) struct Pupil {
    /// Real and imaginary part, times the part of the cell that is inside, row by row.
    wave: Vec<DVec2>,
    /// |q|².
    squared: Vec<f64>,
    /// q along each side.
    pub axis: [f64; POINTS],
}

impl Pupil {
    pub fn new(kernel: &Kernel, phases: &Wavefront, half: f64) -> Self {
        let step = 2.0 * half / POINTS as f64;
        let axis: [f64; POINTS] = std::array::from_fn(|i| (i as f64 + 0.5) * step - half);
        let inside = |q: DVec2| {
            let parts =
                (0..16).map(|k| DVec2::new(f64::from(k % 4), f64::from(k / 4)) / 4.0 - 0.375);
            parts
                .filter(|part| kernel.is_inside(q + step * *part))
                .count() as f64
                / 16.0
        };
        let points = || {
            axis.iter()
                .flat_map(|&y| axis.iter().map(move |&x| DVec2::new(x, y)))
        };
        let wave = |q: DVec2| match inside(q) {
            0.0 => DVec2::ZERO,
            part => part * DVec2::from_angle(phases.phase(q)),
        };
        Self {
            wave: points().map(wave).collect(),
            squared: points().map(|q| q.length_squared()).collect(),
            axis,
        }
    }
}

/// exp(−i κ q) by κ and q, real and imaginary parts apart.
pub(super) struct Turns {
    /// Steps of κ to either side.
    count: usize,
    real: Vec<[f32; POINTS]>,
    imaginary: Vec<[f32; POINTS]>,
}

impl Turns {
    pub fn new(axis: &[f64; POINTS], reach: f64) -> Self {
        let count = (reach / STEP).ceil() as usize;
        let angle = |k: usize, q: f64| (count as f64 - k as f64) * STEP * q;
        let all = 0..2 * count + 1;
        Self {
            count,
            real: all
                .clone()
                .map(|k| axis.map(|q| angle(k, q).cos() as f32))
                .collect(),
            imaginary: all
                .map(|k| axis.map(|q| angle(k, q).sin() as f32))
                .collect(),
        }
    }

    fn side(&self) -> usize {
        2 * self.count + 1
    }

    /// Σ wave · exp(−i κ q) at the k-th κ, in eight sums side by side.
    #[inline(always)]
    fn sum(&self, k: usize, real: &[f32], imaginary: &[f32]) -> (f32, f32) {
        let (turn_real, turn_imaginary) = (&self.real[k], &self.imaginary[k]);
        let (mut re, mut im) = ([0f32; 8], [0f32; 8]);
        for first in (0..POINTS).step_by(8) {
            let part = first..first + 8;
            let (a, b) = (&real[part.clone()], &imaginary[part.clone()]);
            let (c, d) = (&turn_real[part.clone()], &turn_imaginary[part]);
            for i in 0..8 {
                re[i] += a[i] * c[i] - b[i] * d[i];
                im[i] += a[i] * d[i] + b[i] * c[i];
            }
        }
        (re.iter().sum(), im.iter().sum())
    }
}

/// The intensity in a plane beside the focus, up to the reach.
pub(super) struct Plane {
    side: usize,
    reach: f64,
    /// Sums of the intensities, row by row, from the first on.
    sums: Vec<f64>,
}

impl Plane {
    /// `defocus`: phase at |q| = 1, rad.
    pub fn new(pupil: &Pupil, turns: &Turns, defocus: f64, reach: f64) -> Self {
        let side = turns.side();
        let turned =
            |(wave, squared): (&DVec2, &f64)| DVec2::from_angle(defocus * squared).rotate(*wave);
        let wave = pupil.wave.iter().zip(&pupil.squared).map(turned);
        let (real, imaginary): (Vec<f32>, Vec<f32>) =
            wave.map(|w| (w.x as f32, w.y as f32)).unzip();
        let mut plane = Self {
            side,
            reach,
            sums: Vec::with_capacity(side * side),
        };
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe {
                plane.add_avx2(turns, &real, &imaginary);
            },
            _ => plane.add(turns, &real, &imaginary),
        }
        plane
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn add_avx2(&mut self, turns: &Turns, real: &[f32], imaginary: &[f32]) {
        self.add(turns, real, imaginary);
    }

    /// Sums the intensities of a wave. The same bits at every level.
    #[inline(always)]
    fn add(&mut self, turns: &Turns, real: &[f32], imaginary: &[f32]) {
        // Along rows: [κ_x][row]; then along columns.
        let rows = || {
            real.chunks_exact(POINTS)
                .zip(imaginary.chunks_exact(POINTS))
        };
        let (mut column_real, mut column_imaginary) = (Vec::new(), Vec::new());
        for k in 0..self.side {
            for (re, im) in rows() {
                let (re, im) = turns.sum(k, re, im);
                column_real.push(re);
                column_imaginary.push(im);
            }
        }
        let mut all = 0.0;
        let beside = |k: usize| (k.abs_diff(turns.count) as f64 * STEP).powi(2);
        for y in 0..self.side {
            for x in 0..self.side {
                if beside(x) + beside(y) <= self.reach * self.reach {
                    let column = x * POINTS..(x + 1) * POINTS;
                    let (re, im) =
                        turns.sum(y, &column_real[column.clone()], &column_imaginary[column]);
                    all += f64::from(re * re + im * im);
                }
                self.sums.push(all);
            }
        }
    }

    /// Places spread as the intensity.
    pub fn samples(&self, count: usize) -> Vec<DVec2> {
        let all = self.sums.last().copied().unwrap_or(0.0);
        let middle = (self.side / 2) as f64;
        let mut at = 0;
        let sample = |i: usize| {
            let wanted = all * (i as f64 + 0.5) / count as f64;
            while at + 1 < self.sums.len() && self.sums[at] < wanted {
                at += 1;
            }
            let part = DVec2::from(PLASTIC.map(|step| (i as f64 * step).fract())) - 0.5;
            let cell = DVec2::new((at % self.side) as f64, (at / self.side) as f64) - middle;
            ((cell + part) * STEP).clamp_length_max(self.reach)
        };
        (0..count).map(sample).collect()
    }
}
