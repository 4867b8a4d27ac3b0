//! Eight f32 side by side: as two SSE vectors (or what the target has), or as one AVX vector. Both give the same bits.

use glam::Vec4;

/// The operations of a box test.
pub(super) trait Lanes: Copy {
    fn splat(x: f32) -> Self;
    fn load(x: &[f32; 8]) -> Self;
    fn store(self) -> [f32; 8];
    fn minus(self, other: Self) -> Self;
    fn times(self, other: Self) -> Self;
    fn least(self, other: Self) -> Self;
    fn greatest(self, other: Self) -> Self;
    /// Bit i: lane i is at most the other's.
    fn at_most(self, other: Self) -> u32;
}

/// For every CPU.
#[derive(Clone, Copy, Debug)]
pub(super) struct Portable([Vec4; 2]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(Vec4, Vec4) -> Vec4) -> Self {
        Self([f(self.0[0], other.0[0]), f(self.0[1], other.0[1])])
    }
}

impl Lanes for Portable {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([Vec4::splat(x); 2])
    }
    #[inline(always)]
    fn load(x: &[f32; 8]) -> Self {
        Self([Vec4::from_slice(&x[..4]), Vec4::from_slice(&x[4..])])
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0[0].to_array(), self.0[1].to_array());
        [a, b, c, d, e, f, g, h]
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn least(self, other: Self) -> Self {
        self.zip(other, Vec4::min)
    }
    #[inline(always)]
    fn greatest(self, other: Self) -> Self {
        self.zip(other, Vec4::max)
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.0[0].cmple(other.0[0]).bitmask() | self.0[1].cmple(other.0[1]).bitmask() << 4
    }
}

/// For CPUs with AVX2. Its values exist only inside functions compiled for it.
#[cfg(target_arch = "x86_64")]
pub(super) mod avx {
    use super::Lanes;
    use std::arch::x86_64 as arch;

    #[derive(Clone, Copy, Debug)]
    pub struct Avx(arch::__m256);

    impl Lanes for Avx {
        #[inline(always)]
        fn splat(x: f32) -> Self {
            // SAFETY: used within functions compiled for AVX2 only, as all below.
            Self(unsafe { arch::_mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn load(x: &[f32; 8]) -> Self {
            // SAFETY: eight floats are readable at the pointer.
            Self(unsafe { arch::_mm256_loadu_ps(x.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> [f32; 8] {
            let mut out = [0.0; 8];
            // SAFETY: eight floats are writable at the pointer.
            unsafe { arch::_mm256_storeu_ps(out.as_mut_ptr(), self.0) };
            out
        }
        #[inline(always)]
        fn minus(self, other: Self) -> Self {
            // SAFETY: as `splat`.
            Self(unsafe { arch::_mm256_sub_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: as `splat`.
            Self(unsafe { arch::_mm256_mul_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn least(self, other: Self) -> Self {
            // SAFETY: as `splat`.
            Self(unsafe { arch::_mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn greatest(self, other: Self) -> Self {
            // SAFETY: as `splat`.
            Self(unsafe { arch::_mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn at_most(self, other: Self) -> u32 {
            // SAFETY: as `splat`.
            unsafe {
                arch::_mm256_movemask_ps(arch::_mm256_cmp_ps::<{ arch::_CMP_LE_OQ }>(
                    self.0, other.0,
                ))
                .cast_unsigned()
            }
        }
    }
}
