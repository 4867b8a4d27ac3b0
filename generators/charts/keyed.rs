//! Random numbers as hashes of a key: the same key gives the same number on any thread, in any order.
//!
//! A key is a 64-bit state that absorbs words by the finaliser of SplitMix64 (Steele, Lea & Flood, OOPSLA 2014).

/// A hash state: absorb words with [`Key::with`], then read numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Key(u64);

impl Key {
    /// The key of `seed` and a name, so that two uses of one seed are independent.
    pub(crate) fn new(seed: u64, name: &str) -> Self {
        name.bytes()
            .fold(Self(seed).with(0), |key, byte| key.with(u64::from(byte)))
    }

    /// The key with `word` absorbed.
    #[inline]
    pub(crate) fn with(self, word: u64) -> Self {
        let mut z =
            (self.0 ^ word.wrapping_mul(0xD6E8_FEB8_6659_FD93)).wrapping_add(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        Self(z ^ (z >> 31))
    }

    /// Number `index` of this key, uniform in [0, 1).
    #[inline]
    pub(crate) fn uniform(self, index: u64) -> f64 {
        (self.with(index).0 >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Number `index` of this key, uniform in [low, high).
    #[inline]
    pub(crate) fn range(self, index: u64, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform(index)
    }

    /// Whole number `index` of this key, uniform in low..=high.
    pub(crate) fn whole(self, index: u64, low: u32, high: u32) -> u32 {
        low + (self.uniform(index) * f64::from(high - low + 1)) as u32
    }

    /// Two independent standard normal numbers (Box and Muller, 1958).
    #[inline]
    pub(crate) fn normal_pair(self) -> [f32; 2] {
        let bits = self.with(0).0;
        // 32 bits each; the half keeps the logarithm finite. Tails reach 6.6 standard deviations.
        let u = ((bits >> 32) as f32 + 0.5) * (1.0 / 4_294_967_296.0);
        let v = (bits as u32) as f32 * (1.0 / 4_294_967_296.0);
        let radius = (-2.0 * u.min(1.0).ln()).sqrt();
        let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
        [radius * cos, radius * sin]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_numbers_have_the_moments_of_the_uniform_law() {
        let key = Key::new(7, "test");
        let n = 200_000;
        let (mut sum, mut square, mut neighbours) = (0.0, 0.0, 0.0);
        for i in 0..n {
            let v = key.uniform(i) - 0.5;
            sum += v;
            square += v * v;
            neighbours += v * (key.uniform(i + 1) - 0.5);
        }
        let n = n as f64;
        // Five standard errors: of the mean √(1/12n), of the square √(1/180n), of the product 1/(12√n).
        assert!((sum / n).abs() < 5.0 * (1.0 / (12.0 * n)).sqrt());
        assert!((square / n - 1.0 / 12.0).abs() < 5.0 * (1.0 / (180.0 * n)).sqrt());
        assert!((neighbours / n).abs() < 5.0 / (12.0 * n.sqrt()));
    }

    #[test]
    fn names_and_seeds_part_the_streams() {
        let a = Key::new(1, "a").uniform(0);
        assert_ne!(a, Key::new(1, "b").uniform(0));
        assert_ne!(a, Key::new(2, "a").uniform(0));
    }
}
