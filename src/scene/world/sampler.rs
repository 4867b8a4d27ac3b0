//! The random numbers of a path: for each decision a pair of coordinates that is well spread over the paths of its
//! pixel.
//!
//! Each pair is the first two dimensions of the Sobol sequence, a (0, 2)-sequence, with its points in a shuffled order
//! and scrambled values, both by hashed Owen scrambling with keys of their own (B. Burley, *Practical hash-based Owen
//! scrambling*, JCGT 10(4) (2020)). A number depends on (key, sample, pair) and on nothing else.

use crate::sampling::{mix, owen_scramble};

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
        let a = mix(self.key ^ self.pair.wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let b = mix(a);
        // Scrambling the reversed index permutes within aligned blocks of every power of two.
        let index = owen_scramble(self.sample.reverse_bits(), a as u32);
        // The first dimension is the reversed index, the second the reversed image of the index; scrambling takes
        // reversed values.
        [
            unit(owen_scramble(index, (a >> 32) as u32)),
            unit(owen_scramble(pascal(index), b as u32)),
        ]
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
