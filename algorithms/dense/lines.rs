//! The inner loop of [`super::cost`]: lines of two pictures convolved with a line each of two kernels, and added.

use quadpixel::simd::SimdLevel;

/// Pixels whose sums stay in registers while all taps are gone through.
const BLOCK: usize = 32;

/// Adds Σ_i a_i e(x + n − 1 − i) + b_i o(x + n − 1 − i) to pixel x, tap by tap, for n taps a and b. `of`: e and o, both
/// n − 1 longer than `to`. The same bits by any instructions.
pub(super) fn add(of: [&[f32]; 2], taps: [&[f32]; 2], to: &mut [f32]) {
    match SimdLevel::detect() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX2 (or more) on this CPU.
        SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { add_avx2(of, taps, to) },
        _ => add_all(of, taps, to),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_avx2(of: [&[f32]; 2], taps: [&[f32]; 2], to: &mut [f32]) {
    add_all(of, taps, to);
}

#[inline(always)]
fn add_all([even, odd]: [&[f32]; 2], [a, b]: [&[f32]; 2], to: &mut [f32]) {
    // Kernels are round: their lines end in zeros.
    let is_zero = |i: &usize| a[*i] == 0.0 && b[*i] == 0.0;
    let count = a.len().min(b.len());
    let first = (0..count).take_while(is_zero).count();
    let end = count - (first..count).rev().take_while(is_zero).count();
    debug_assert!(even.len().min(odd.len()) + 1 >= to.len() + count);
    let whole = to.len() / BLOCK * BLOCK;
    let (blocks, rest) = to.as_chunks_mut::<BLOCK>();
    for (k, block) in blocks.iter_mut().enumerate() {
        let mut sums = *block;
        for i in first..end {
            let at = k * BLOCK + count - 1 - i;
            let (Some(e), Some(o)) = (
                even[at..].first_chunk::<BLOCK>(),
                odd[at..].first_chunk::<BLOCK>(),
            ) else {
                return;
            };
            for (sum, (e, o)) in sums.iter_mut().zip(e.iter().zip(o)) {
                *sum += a[i] * e + b[i] * o;
            }
        }
        *block = sums;
    }
    for i in first..end {
        let at = whole + count - 1 - i;
        let pair = even[at..].iter().zip(&odd[at..]);
        for (to, (e, o)) in rest.iter_mut().zip(pair) {
            *to += a[i] * e + b[i] * o;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_gives_the_same_bits_and_the_sum_of_the_taps() {
        let value = |i: usize, seed: usize| ((i * 37 + seed * 11) % 101) as f32 * 0.17 - 8.0;
        for (pixels, taps) in [(1, 1), (31, 5), (32, 7), (75, 9), (200, 1)] {
            let line = |seed: usize, n: usize| (0..n).map(|i| value(i, seed)).collect::<Vec<_>>();
            let (even, odd) = (line(1, pixels + taps - 1), line(2, pixels + taps - 1));
            let (mut a, mut b) = (line(3, taps), line(4, taps));
            if taps > 2 {
                [a[0], b[0], a[taps - 1], b[taps - 1]] = [0.0; 4];
            }
            let (mut plain, mut best) = (line(5, pixels), line(5, pixels));
            let mut oracle = plain.clone();
            add_all([&even, &odd], [&a, &b], &mut plain);
            add([&even, &odd], [&a, &b], &mut best);
            assert_eq!(plain, best);
            for (x, to) in oracle.iter_mut().enumerate() {
                for i in 0..taps {
                    let at = x + taps - 1 - i;
                    *to += a[i] * even[at] + b[i] * odd[at];
                }
            }
            assert_eq!(plain, oracle);
        }
    }
}
