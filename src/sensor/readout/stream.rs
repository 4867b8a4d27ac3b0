//! Random numbers of one place: a counter-based stream whose start is a hash of its key words.

use crate::sampling::{hash, mix};

/// A sequence of random numbers that depends on its seed and key words alone.
#[derive(Clone, Debug)]
pub struct Stream {
    start: u64,
    count: u64,
}

impl Stream {
    /// The stream of a key.
    pub fn new(seed: u64, words: &[u64]) -> Self {
        Self {
            start: hash(seed, words),
            count: 0,
        }
    }

    /// Even in (0, 1): neither end occurs.
    pub fn uniform(&mut self) -> f64 {
        let bits = mix(self.start ^ mix(self.count));
        self.count += 1;
        // 52 bits and a half: exact in f64, so that the largest does not round to 1.
        ((bits >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64)
    }

    /// Normal, of mean 0 and variance 1: √(−2 ln U₁) cos 2πU₂ (Box & Muller, Ann. Math. Stat. 29, 610 (1958)).
    pub fn normal(&mut self) -> f64 {
        let (u, v) = (self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}
