//! Eight f32 side by side: as two SSE vectors (or what the target has), or as one AVX vector. All give the same bits.

#[cfg(target_arch = "x86_64")]
pub(super) mod avx;
#[cfg(target_arch = "x86_64")]
pub(super) mod avx512;

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
    /// Writes the lanes of `hits` to the stack, the greatest first, and returns how many there are: the bits of each
    /// above those of `below`. None is below 0, so that such pairs are in the order of the numbers.
    fn push(self, hits: u32, below: &[u32; 8], stack: &mut [u64; 8]) -> usize;
}

/// [`Lanes::push`] of lanes in memory.
#[inline(always)]
fn push_one_by_one(above: [f32; 8], hits: u32, below: &[u32; 8], stack: &mut [u64; 8]) -> usize {
    let pair = |hits: u32| {
        let lane = hits.trailing_zeros() as usize % 8;
        u64::from(above[lane].to_bits()) << 32 | u64::from(below[lane])
    };
    if hits == 0 {
        return 0;
    }
    let mut least = pair(hits);
    let mut left = hits & (hits - 1);
    let mut count = 0;
    while left != 0 {
        let next = pair(left);
        left &= left - 1;
        stack[count] = least.max(next);
        least = least.min(next);
        // Without a branch that depends on which is greater.
        for i in (0..count).rev() {
            let [a, b] = [stack[i], stack[i + 1]];
            (stack[i], stack[i + 1]) = (a.max(b), a.min(b));
        }
        count += 1;
    }
    stack[count] = least;
    count + 1
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
    #[inline(always)]
    fn push(self, hits: u32, below: &[u32; 8], stack: &mut [u64; 8]) -> usize {
        push_one_by_one(self.store(), hits, below, stack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform;
    use crate::simd::SimdLevel;

    /// [`Lanes::push`] of eight floats.
    #[inline(always)]
    fn push<L: Lanes>(above: &[f32; 8], hits: u32, below: &[u32; 8]) -> Vec<u64> {
        let mut stack = [0; 8];
        let count = L::load(above).push(hits, below, &mut stack);
        stack[..count].to_vec()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    fn push_avx2(above: &[f32; 8], hits: u32, below: &[u32; 8]) -> Vec<u64> {
        push::<avx::Avx>(above, hits, below)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq,avx512vl,popcnt")]
    fn push_avx512(above: &[f32; 8], hits: u32, below: &[u32; 8]) -> Vec<u64> {
        push::<avx512::Avx512>(above, hits, below)
    }

    #[test]
    fn lanes_that_are_hit_are_pushed_from_far_to_near_at_every_simd_level() {
        for hits in 0..256u32 {
            for draw in 0..8 {
                // Many equal ones, many zeros, infinities.
                let above: [f32; 8] = std::array::from_fn(|lane| {
                    match (9.0 * uniform(u64::from(hits), &[draw, lane as u64])) as u32 {
                        0..4 => 0.0,
                        8 => f32::INFINITY,
                        x => x as f32 * 0.3,
                    }
                });
                let below = std::array::from_fn(|lane| ((lane as u32 * 5 + 3) % 8) | (1 << 31));
                let mut expected: Vec<u64> = (0..8)
                    .filter(|lane| hits >> lane & 1 == 1)
                    .map(|lane| u64::from(above[lane].to_bits()) << 32 | u64::from(below[lane]))
                    .collect();
                expected.sort_unstable_by(|a, b| b.cmp(a));
                assert_eq!(push::<Portable>(&above, hits, &below), expected);
                #[cfg(target_arch = "x86_64")]
                if SimdLevel::detect() >= SimdLevel::Avx2 {
                    // SAFETY: the level says that the CPU has AVX2 and POPCNT.
                    assert_eq!(unsafe { push_avx2(&above, hits, &below) }, expected);
                }
                #[cfg(target_arch = "x86_64")]
                if SimdLevel::detect() == SimdLevel::Avx512 {
                    // SAFETY: the level says that the CPU has AVX-512 and POPCNT.
                    assert_eq!(unsafe { push_avx512(&above, hits, &below) }, expected);
                }
            }
        }
    }
}
