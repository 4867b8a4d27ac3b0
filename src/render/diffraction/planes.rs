//! The light of a point in planes beside its focus, |∫ exp(i (W(q) + c |q|² − κ·q)) d²q|², summed directly:
//! along rows, then along columns, κ and −κ at a time.

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

/// Sums side by side.
const LANES: usize = 8;

/// cos and sin of κ q by q and κ = 0, [`STEP`], …
pub(super) struct Turns {
    /// Steps of κ to either side.
    count: usize,
    /// Numbers per q: κ up to the reach, and as many more as fill the lanes.
    width: usize,
    cos: Vec<f32>,
    sin: Vec<f32>,
}

impl Turns {
    pub fn new(axis: &[f64; POINTS], reach: f64) -> Self {
        let count = (reach / STEP).ceil() as usize;
        let width = (count + 1).next_multiple_of(LANES);
        let angles = || {
            let of = |q: f64| (0..width).map(move |j| j as f64 * STEP * q);
            axis.iter().flat_map(move |&q| of(q))
        };
        Self {
            count,
            width,
            cos: angles().map(|a| a.cos() as f32).collect(),
            sin: angles().map(|a| a.sin() as f32).collect(),
        }
    }

    fn side(&self) -> usize {
        2 * self.count + 1
    }

    /// Where −κ and κ lie that are `j` steps from 0, counted from the least κ to the largest.
    fn places(&self, j: usize) -> [usize; 2] {
        [self.count - j, self.count + j]
    }
}

/// Σ (a + i b)(cos ± i sin): the four sums of products that κ and −κ share.
#[derive(Clone, Copy, Default)]
struct Products {
    a_cos: [f32; LANES],
    b_sin: [f32; LANES],
    a_sin: [f32; LANES],
    b_cos: [f32; LANES],
}

impl Products {
    #[inline(always)]
    fn add(&mut self, [a, b]: [&[f32; LANES]; 2], [cos, sin]: [&[f32; LANES]; 2]) {
        for i in 0..LANES {
            self.a_cos[i] += a[i] * cos[i];
            self.b_sin[i] += b[i] * sin[i];
            self.a_sin[i] += a[i] * sin[i];
            self.b_cos[i] += b[i] * cos[i];
        }
    }

    /// Real and imaginary parts with + i sin, and with − i sin.
    #[inline(always)]
    fn sums(&self) -> [[[f32; LANES]; 2]; 2] {
        let of = |f: &dyn Fn(usize) -> f32| std::array::from_fn(f);
        let (a, b) = (&self.a_cos, &self.b_sin);
        let (c, d) = (&self.b_cos, &self.a_sin);
        [
            [of(&|i| a[i] - b[i]), of(&|i| c[i] + d[i])],
            [of(&|i| a[i] + b[i]), of(&|i| c[i] - d[i])],
        ]
    }
}

/// The wave of a plane, or its transform along rows: real and imaginary parts apart, row by row.
struct Columns {
    width: usize,
    real: Vec<f32>,
    imaginary: Vec<f32>,
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
        let turned =
            |(wave, squared): (&DVec2, &f64)| DVec2::from_angle(defocus * squared).rotate(*wave);
        let wave = pupil.wave.iter().zip(&pupil.squared).map(turned);
        let (real, imaginary) = wave.map(|w| (w.x as f32, w.y as f32)).unzip();
        let wave = Columns {
            width: POINTS,
            real,
            imaginary,
        };
        let intensities = match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { intensities_avx2(turns, &wave, reach) },
            _ => intensities(turns, &wave, reach),
        };
        let mut all = 0.0;
        let sums = intensities.iter().map(|intensity| {
            all += f64::from(*intensity);
            all
        });
        Self {
            side: turns.side(),
            reach,
            sums: sums.collect(),
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

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn intensities_avx2(turns: &Turns, wave: &Columns, reach: f64) -> Vec<f32> {
    intensities(turns, wave, reach)
}

/// Of a wave, row by row; 0 beyond the reach. The same bits at every level.
#[inline(always)]
fn intensities(turns: &Turns, wave: &Columns, reach: f64) -> Vec<f32> {
    along_columns(turns, &along_rows(turns, wave), reach)
}

/// Σ wave · exp(±i κ q) along each row: those of −κ, then those of κ.
#[inline(always)]
fn along_rows(turns: &Turns, wave: &Columns) -> Columns {
    let width = 2 * turns.width;
    let [mut real, mut imaginary] = [(); 2].map(|()| vec![0.0; width * POINTS]);
    let rows = (wave.real.chunks_exact(POINTS)).zip(wave.imaginary.chunks_exact(POINTS));
    let to_rows = (real.chunks_exact_mut(width)).zip(imaginary.chunks_exact_mut(width));
    for ((a, b), (to_real, to_imaginary)) in rows.zip(to_rows) {
        for first in (0..turns.width).step_by(LANES) {
            let mut products = Products::default();
            for (p, (a, b)) in a.iter().zip(b).enumerate() {
                let at = p * turns.width + first;
                let turn = [lanes(&turns.cos, at), lanes(&turns.sin, at)];
                products.add([&[*a; LANES], &[*b; LANES]], turn);
            }
            for (sums, first) in products.sums().iter().zip([first, turns.width + first]) {
                to_real[first..first + LANES].copy_from_slice(&sums[0]);
                to_imaginary[first..first + LANES].copy_from_slice(&sums[1]);
            }
        }
    }
    Columns {
        width,
        real,
        imaginary,
    }
}

/// The squares of the sums along the columns of [`along_rows`].
#[inline(always)]
fn along_columns(turns: &Turns, columns: &Columns, reach: f64) -> Vec<f32> {
    let side = turns.side();
    let mut intensities = vec![0.0; side * side];
    let squared = |j: usize| (j as f64 * STEP).powi(2);
    for j in 0..=turns.count {
        let turn: [[[f32; LANES]; 2]; POINTS] = std::array::from_fn(|p| {
            let at = p * turns.width + j;
            [[turns.cos[at]; LANES], [turns.sin[at]; LANES]]
        });
        let within = |i: usize| i <= turns.count && squared(i) + squared(j) <= reach * reach;
        for (half, first) in [0, 1].map(|half| (half, half * turns.width)) {
            for begin in (0..turns.width).step_by(LANES) {
                if !within(begin) {
                    break;
                }
                let mut products = Products::default();
                for (p, [cos, sin]) in turn.iter().enumerate() {
                    let at = p * columns.width + first + begin;
                    let ab = [lanes(&columns.real, at), lanes(&columns.imaginary, at)];
                    products.add(ab, [cos, sin]);
                }
                for ([re, im], y) in products.sums().iter().zip(turns.places(j)) {
                    for i in (0..LANES).filter(|i| within(begin + i)) {
                        let x = turns.places(begin + i)[half];
                        intensities[y * side + x] = re[i] * re[i] + im[i] * im[i];
                    }
                }
            }
        }
    }
    intensities
}

#[inline(always)]
fn lanes(values: &[f32], at: usize) -> &[f32; LANES] {
    values[at..].first_chunk().unwrap_or(&[0.0; LANES])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intensities_are_the_squares_of_sums_of_the_wave() {
        let axis: [f64; POINTS] = std::array::from_fn(|i| (i as f64 + 0.5) / 32.0 - 1.0);
        let turns = Turns::new(&axis, 40.0);
        let q = |k: usize| DVec2::new(axis[k % POINTS], axis[k / POINTS]);
        // Neither even nor odd along x or y.
        let wave = |q: DVec2| match q.length() < 1.0 {
            true => DVec2::from_angle(5.0 * q.x - 3.0 * q.y + 2.0 * q.x * q.x * q.y + q.x),
            false => DVec2::ZERO,
        };
        let waves: Vec<DVec2> = (0..POINTS * POINTS).map(|k| wave(q(k))).collect();
        let columns = Columns {
            width: POINTS,
            real: waves.iter().map(|w| w.x as f32).collect(),
            imaginary: waves.iter().map(|w| w.y as f32).collect(),
        };
        let found = intensities(&turns, &columns, 40.0);
        let (side, largest) = (turns.side(), found.iter().copied().fold(0.0, f32::max));
        for [x, y] in [[80, 80], [85, 78], [70, 92], [30, 100], [95, 20], [80, 140]] {
            let kappa = STEP * (DVec2::new(x as f64, y as f64) - 80.0);
            let turned = |k: usize| DVec2::from_angle(-kappa.dot(q(k))).rotate(waves[k]);
            let sum: DVec2 = (0..POINTS * POINTS).map(turned).sum();
            let off = (f64::from(found[y * side + x]) - sum.length_squared()).abs();
            assert!(off < 1e-5 * f64::from(largest), "{x} {y}: {off}");
        }
        assert_eq!(found[0], 0.0, "beyond the reach");
    }
}
