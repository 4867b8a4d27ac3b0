//! The random numbers of a path: for each decision a pair of coordinates that is well spread over the paths of its
//! pixel.
//!
//! Each pair is the first two dimensions of the Sobol sequence, a (0, 2)-sequence, with its points in a shuffled order
//! and scrambled values, both by hashed Owen scrambling with keys of their own (B. Burley, *Practical hash-based Owen
//! scrambling*, JCGT 10(4) (2020)). A number depends on (key, sample, pair) and on nothing else.

use crate::sampling::{concentric_disk, mix, owen_scramble};
use crate::simd::SimdLevel;

/// The numbers of one path, drawn pair by pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct PathSamples {
    key: u64,
    sample: u32,
    pair: u64,
}

impl PathSamples {
    /// Path number `sample` of those that share `key` (a pixel and channel of a render).
    pub fn new(key: u64, sample: u32) -> Self {
        Self {
            key,
            sample,
            pair: 0,
        }
    }

    /// The next pair, each in [0, 1).
    #[inline]
    pub fn pair(&mut self) -> [f32; 2] {
        self.pair += 1;
        pair(self.key, self.sample, self.pair)
    }
}

#[inline(always)]
fn pair(key: u64, sample: u32, pair: u64) -> [f32; 2] {
    let [a, b] = hashes(key, pair);
    scrambled(sample, [a as u32, (a >> 32) as u32, b as u32])
}

#[inline(always)]
fn hashes(key: u64, pair: u64) -> [u64; 2] {
    let a = mix(key ^ pair.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    [a, mix(a)]
}

/// The pair of a sample, by the seeds of its order and of its two dimensions.
#[inline(always)]
fn scrambled(sample: u32, [order, first, second]: [u32; 3]) -> [f32; 2] {
    // Scrambling the reversed index permutes within aligned blocks of every power of two.
    let index = owen_scramble(sample.reverse_bits(), order);
    // The first dimension is the reversed index, the second the reversed image of the index; scrambling takes
    // reversed values.
    [
        unit(owen_scramble(index, first)),
        unit(owen_scramble(pascal(index), second)),
    ]
}

/// Paths whose numbers are drawn together.
pub(super) const TOGETHER: usize = 64;
/// Pairs that a path asks for at a surface.
const PAIRS: usize = 3;

/// What a path asks for at a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceNumbers {
    /// Of a part of the material, and of a light.
    pub choice: f32,
    pub light_choice: f32,
    /// Of a direction; the same as a point of the unit disk; of a place on the light.
    pub scatter: [f32; 2],
    pub disk: [f32; 2],
    pub light: [f32; 2],
}

/// The numbers of many paths at their surfaces, as columns.
#[derive(Clone, Debug)]
pub(super) struct NumberColumns {
    key: [u64; TOGETHER],
    sample: [u32; TOGETHER],
    pair: [u64; TOGETHER],
    drawn: [[f32; TOGETHER]; 2 * PAIRS],
    disk: [[f32; TOGETHER]; 2],
}

impl Default for NumberColumns {
    fn default() -> Self {
        Self {
            key: [0; TOGETHER],
            sample: [0; TOGETHER],
            pair: [0; TOGETHER],
            drawn: [[0.0; TOGETHER]; 2 * PAIRS],
            disk: [[0.0; TOGETHER]; 2],
        }
    }
}

impl NumberColumns {
    /// Draws the next pairs of up to [`TOGETHER`] paths.
    pub fn draw<'a>(&mut self, paths: impl Iterator<Item = &'a mut PathSamples>) {
        for (i, path) in paths.take(TOGETHER).enumerate() {
            (self.key[i], self.sample[i], self.pair[i]) = (path.key, path.sample, path.pair);
            path.pair += PAIRS as u64;
        }
        #[cfg(target_arch = "x86_64")]
        match SimdLevel::detect() {
            // SAFETY: `detect` found AVX-512 on this CPU.
            SimdLevel::Avx512 => return unsafe { self.fill_avx512() },
            // SAFETY: `detect` found AVX2 on this CPU.
            SimdLevel::Avx2 => return unsafe { self.fill_avx2() },
            SimdLevel::Scalar => {}
        }
        self.fill();
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq,avx512vl")]
    fn fill_avx512(&mut self) {
        self.fill();
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn fill_avx2(&mut self) {
        self.fill();
    }

    #[allow(clippy::needless_range_loop)] // because columns of four lists side by side are plainer by their index
    #[inline(always)]
    fn fill(&mut self) {
        // Loops of one kind of operation each, over columns of their own, become vectors.
        let mut seeds = [[0u32; TOGETHER]; 3];
        for (k, [out_x, out_y]) in self.drawn.as_chunks_mut().0.iter_mut().enumerate() {
            for i in 0..TOGETHER {
                let [a, b] = hashes(self.key[i], self.pair[i] + 1 + k as u64);
                seeds[0][i] = a as u32;
                seeds[1][i] = (a >> 32) as u32;
                seeds[2][i] = b as u32;
            }
            for i in 0..TOGETHER {
                let seeds = [seeds[0][i], seeds[1][i], seeds[2][i]];
                [out_x[i], out_y[i]] = scrambled(self.sample[i], seeds);
            }
        }
        for i in 0..TOGETHER {
            let [s, t] = [2, 3].map(|k| f64::from(self.drawn[k][i]));
            let (x, y) = concentric_disk(s, t);
            self.disk[0][i] = x as f32;
            self.disk[1][i] = y as f32;
        }
    }

    /// Those of a path, by its place.
    #[inline]
    pub fn of(&self, path: usize) -> SurfaceNumbers {
        let [choice, light_choice, s, t, u, v] = std::array::from_fn(|k| self.drawn[k][path]);
        SurfaceNumbers {
            choice,
            light_choice,
            scatter: [s, t],
            disk: [self.disk[0][path], self.disk[1][path]],
            light: [u, v],
        }
    }
}

#[inline]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// The index times Pascal's triangle modulo 2: bit k is the sum of the bits i of which k is a subset.
#[inline]
fn pascal(mut x: u32) -> u32 {
    x ^= (x & 0xAAAA_AAAA) >> 1;
    x ^= (x & 0xCCCC_CCCC) >> 2;
    x ^= (x & 0xF0F0_F0F0) >> 4;
    x ^= (x & 0xFF00_FF00) >> 8;
    x ^ ((x & 0xFFFF_0000) >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_paths_draw_what_each_would_alone_at_every_simd_level() {
        let mut paths: Vec<_> = (0..50)
            .map(|i| {
                let mut samples = PathSamples::new(mix(i), 3 * i as u32);
                for _ in 0..i % 5 {
                    samples.pair();
                }
                samples
            })
            .collect();
        let mut columns = NumberColumns::default();
        let drawn =
            |columns: &NumberColumns| -> Vec<_> { (0..50).map(|i| columns.of(i)).collect() };
        let before = paths.clone();
        columns.draw(paths.iter_mut());
        let best = drawn(&columns);
        columns.fill();
        assert_eq!(drawn(&columns), best);
        #[cfg(target_arch = "x86_64")]
        if SimdLevel::detect() >= SimdLevel::Avx2 {
            // SAFETY: `detect` found AVX2 on this CPU.
            unsafe { columns.fill_avx2() };
            assert_eq!(drawn(&columns), best);
        }
        for ((mut alone, after), together) in before.into_iter().zip(&mut paths).zip(best) {
            let [choice, light_choice] = alone.pair();
            let (scatter, light) = (alone.pair(), alone.pair());
            let (x, y) = concentric_disk(f64::from(scatter[0]), f64::from(scatter[1]));
            let expected = SurfaceNumbers {
                choice,
                light_choice,
                scatter,
                disk: [x as f32, y as f32],
                light,
            };
            assert_eq!(together, expected);
            assert_eq!(alone.pair(), after.pair());
        }
    }

    #[test]
    fn every_pair_is_stratified_in_all_elementary_intervals_and_differs() {
        let pairs = |skip: usize| -> Vec<[f32; 2]> {
            (0..256)
                .map(|i| {
                    let mut samples = PathSamples::new(77, i);
                    for _ in 0..skip {
                        samples.pair();
                    }
                    samples.pair()
                })
                .collect()
        };
        for skip in [0, 1, 7] {
            for (nx, ny) in [(256, 1), (1, 256), (16, 16), (4, 64), (128, 2)] {
                let mut seen = vec![0; 256];
                for [x, y] in pairs(skip) {
                    seen[(x * nx as f32) as usize * ny + (y * ny as f32) as usize] += 1;
                }
                assert!(seen.iter().all(|&n| n == 1), "pair {skip}, {nx} by {ny}");
            }
        }
        // Shuffled orders are not correlated: r of 256 points is below 4/16.
        let (a, b) = (pairs(0), pairs(1));
        let r: f32 = a
            .iter()
            .zip(&b)
            .map(|(p, q)| 12.0 * (p[0] - 0.5) * (q[0] - 0.5))
            .sum();
        assert!((r / 256.0).abs() < 0.25, "{r}");
    }
}
