//! For CPUs with AVX2 and POPCNT.

use super::{Lanes, push_one_by_one};
use std::arch::x86_64 as arch;

/// Of each mask, the numbers of its lanes, from the lowest.
static LANES_OF: [[u8; 8]; 256] = {
    let mut lists = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut count) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                lists[mask][count] = lane as u8;
                count += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    lists
};

/// Eight lanes; values exist only inside functions compiled for AVX2 and POPCNT.
#[derive(Clone, Copy, Debug)]
pub(in crate::scene::world) struct Avx(pub(super) arch::__m256);

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
            arch::_mm256_movemask_ps(arch::_mm256_cmp_ps::<{ arch::_CMP_LE_OQ }>(self.0, other.0))
                .cast_unsigned()
        }
    }
    /// Up to four are sorted without branches.
    #[inline(always)]
    fn push(self, hits: u32, below: &[u32; 8], stack: &mut [u64; 8]) -> usize {
        let count = hits.count_ones() as usize;
        if count > 4 {
            return push_one_by_one(self.store(), hits, below, stack);
        }
        // SAFETY: as `splat`; the list, `below` and `stack` are as long as what is read and written.
        unsafe {
            let lanes = LANES_OF[hits as usize % 256].as_ptr();
            let lanes = arch::_mm256_cvtepu8_epi32(arch::_mm_loadl_epi64(lanes.cast()));
            let below = arch::_mm256_loadu_si256(below.as_ptr().cast());
            let below = arch::_mm256_permutevar8x32_epi32(below, lanes);
            let above = arch::_mm256_castps_si256(self.0);
            let above = arch::_mm256_permutevar8x32_epi32(above, lanes);
            let (below, above) = (
                arch::_mm256_castsi256_si128(below),
                arch::_mm256_castsi256_si128(above),
            );
            let four = arch::_mm256_set_m128i(
                arch::_mm_unpackhi_epi32(below, above),
                arch::_mm_unpacklo_epi32(below, above),
            );
            let is_there = arch::_mm256_cmpgt_epi64(
                arch::_mm256_set1_epi64x(count as i64),
                arch::_mm256_set_epi64x(3, 2, 1, 0),
            );
            let four = sorted(arch::_mm256_and_si256(four, is_there));
            arch::_mm256_storeu_si256(stack.as_mut_ptr().cast(), four);
        }
        count
    }
}

/// Four u64 below 2⁶³, the greatest first, by a network of exchanges. They are compared as whole numbers: as f64 many
/// would be subnormal, which a host program may have told the processor to take for 0.
///
/// # Safety
/// The CPU must have AVX2.
#[inline(always)]
unsafe fn sorted(four: arch::__m256i) -> arch::__m256i {
    // SAFETY: as the caller says.
    unsafe {
        let four = exchanged(
            four,
            arch::_mm256_shuffle_epi32::<0b0100_1110>(four),
            [0, -1, 0, -1],
        );
        let far = arch::_mm256_permute4x64_epi64::<0b00_01_10_11>(four);
        let four = exchanged(four, far, [0, 0, -1, -1]);
        exchanged(
            four,
            arch::_mm256_shuffle_epi32::<0b0100_1110>(four),
            [0, -1, 0, -1],
        )
    }
}

/// Of each lane and its partner the greater, or the lesser where `lesser` is -1.
///
/// # Safety
/// The CPU must have AVX2.
#[inline(always)]
unsafe fn exchanged(
    four: arch::__m256i,
    partners: arch::__m256i,
    [a, b, c, d]: [i64; 4],
) -> arch::__m256i {
    // SAFETY: as the caller says.
    unsafe {
        let lesser = arch::_mm256_set_epi64x(d, c, b, a);
        let is_greater = arch::_mm256_cmpgt_epi64(partners, four);
        arch::_mm256_blendv_epi8(four, partners, arch::_mm256_xor_si256(is_greater, lesser))
    }
}
