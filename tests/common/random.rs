//! The tests' random numbers: the same on every machine, and the same as in the scripts that made reference vectors.

/// A linear congruential generator from its state: s ← 6364136223846793005 s + 1442695040888963407 mod 2⁶⁴ (D. E.
/// Knuth, MMIX).
pub struct Lcg(pub u64);

#[allow(dead_code)] // because not every test takes all of it
impl Lcg {
    /// In 0 to 1, without 1: the upper 31 bits, (s ≫ 33)/2³¹.
    pub fn uniform(&mut self) -> f64 {
        self.0 = (self.0.wrapping_mul(6_364_136_223_846_793_005))
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / 2f64.powi(31)
    }

    /// In `low` to `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Mean 0, deviation 1 (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}
