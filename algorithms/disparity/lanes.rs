//! Eight numbers at a time: arrays, or AVX2 registers, with the same bits in both.
//!
//! The sums over a window keep up to eight accumulators in registers; from loops over arrays the compiler makes moves
//! between registers and stack instead, measured 2.7 times as slow.

/// Lanes of a vector.
pub(super) const LANES: usize = 8;

/// Eight f32.
pub(super) trait Lanes: Copy {
    /// The same number in all lanes.
    fn splat(value: f32) -> Self;
    /// The first eight of `from`, which holds as many.
    fn load(from: &[f32]) -> Self;
    /// Into the first eight of `to`, which holds as many.
    fn store(self, to: &mut [f32]);
    fn plus(self, other: Self) -> Self;
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;

    /// Sum of the lanes, by halves.
    #[inline(always)]
    fn total(self) -> f64 {
        let mut lanes = [0.0; LANES];
        self.store(&mut lanes);
        let [a, b, c, d, e, f, g, h] = lanes;
        f64::from(((a + e) + (c + g)) + ((b + f) + (d + h)))
    }
}

impl Lanes for [f32; LANES] {
    #[inline(always)]
    fn splat(value: f32) -> Self {
        [value; LANES]
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let mut to = [0.0; LANES];
        to.copy_from_slice(&from[..LANES]);
        to
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..LANES].copy_from_slice(&self);
    }
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] + other[i])
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] - other[i])
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        std::array::from_fn(|i| self[i] * other[i])
    }
}

#[cfg(target_arch = "x86_64")]
pub(super) mod avx2 {
    use super::{LANES, Lanes};
    use std::arch::x86_64::{
        __m256, _mm256_add_ps, _mm256_loadu_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_storeu_ps,
        _mm256_sub_ps,
    };

    /// A register. Whoever makes one has seen to it that the CPU has AVX2.
    #[derive(Clone, Copy)]
    pub struct Register(__m256);

    impl Lanes for Register {
        #[inline(always)]
        fn splat(value: f32) -> Self {
            // SAFETY: the CPU has AVX2, see `Register`.
            Self(unsafe { _mm256_set1_ps(value) })
        }
        #[inline(always)]
        fn load(from: &[f32]) -> Self {
            let from = &from[..LANES];
            // SAFETY: as above; `from` holds eight numbers.
            Self(unsafe { _mm256_loadu_ps(from.as_ptr()) })
        }
        #[inline(always)]
        fn store(self, to: &mut [f32]) {
            let to = &mut to[..LANES];
            // SAFETY: as above; `to` holds eight numbers.
            unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_add_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: as in `splat`.
            Self(unsafe { _mm256_mul_ps(self.0, other.0) })
        }
    }
}
