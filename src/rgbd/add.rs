//! The inner loop: points spread by one kernel into the sums of a tile.

use std::ops::Range;

use crate::render::kernels::Support;
use crate::simd::SimdLevel;

/// Most lanes of which two pixels' sums stay in registers.
const ABREAST: usize = 12;

/// A point to be spread: its pixel from the tile's first one, its light and its coverage per lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point<const L: usize> {
    pub x: i32,
    pub y: i32,
    pub light: [f32; L],
    pub cover: [f32; L],
}

/// Light and coverage of a pixel, per lane.
pub(super) type Sum<const L: usize> = [[f32; L]; 2];

/// A kernel of all lanes at one place of the field and depth: `[row][column]` of its support.
pub(super) struct Taps<const L: usize> {
    pub support: Support,
    pub values: Vec<[f32; L]>,
}

impl<const L: usize> Taps<L> {
    /// Zeros.
    pub fn empty(support: Support) -> Self {
        Self {
            support,
            values: vec![[0.0; L]; support.width * support.height],
        }
    }
}

/// Adds the points to sums of `width` columns.
pub(super) fn add<const L: usize>(
    taps: &Taps<L>,
    points: &[Point<L>],
    width: usize,
    sums: &mut [Sum<L>],
) {
    match SimdLevel::detect() {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX2 (or more) on this CPU.
        SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { add_avx2(taps, points, width, sums) },
        _ => add_all(taps, points, width, sums),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn add_avx2<const L: usize>(
    taps: &Taps<L>,
    points: &[Point<L>],
    width: usize,
    sums: &mut [Sum<L>],
) {
    add_all(taps, points, width, sums);
}

#[inline(always)]
fn add_all<const L: usize>(taps: &Taps<L>, points: &[Point<L>], width: usize, sums: &mut [Sum<L>]) {
    let Support {
        left,
        top,
        width: columns,
        height: rows,
    } = taps.support;
    let height = (sums.len() / width) as i32;
    // Points of a row reach the same pixels: of each of these the sums stay in registers while its points are gone
    // through, in their order.
    for points in points.chunk_by(|a, b| a.y == b.y && a.x < b.x) {
        let top = points[0].y + top;
        let begin = (points[0].x + left).max(0);
        let end = (points[points.len() - 1].x + left + columns as i32).min(width as i32);
        for row in (-top).max(0)..(height - top).min(rows as i32) {
            let values = &taps.values[row as usize * columns..][..columns];
            let sums = &mut sums[(top + row) as usize * width..][..width];
            // Kernel column of a point at x.
            let tap = |point: &Point<L>, x: i32| (x - left - point.x) as usize;
            // The points that reach x, of those that reach the pixel before it.
            let reach = |x: i32, before: Range<usize>| {
                let Range { mut start, mut end } = before;
                while end < points.len() && points[end].x + left <= x {
                    end += 1;
                }
                while start < end && tap(&points[start], x) >= columns {
                    start += 1;
                }
                start..end
            };
            let mut x = begin;
            let mut here = reach(x, 0..0);
            // Two pixels abreast, so that no sum waits for itself, as far as both stay in registers. Each has its
            // points in their order.
            while L <= ABREAST && x + 1 < end {
                let next = reach(x + 1, here.clone());
                let [mut first, mut second] = [sums[x as usize], sums[x as usize + 1]];
                let both = next.start..here.end.max(next.start);
                for point in &points[here.start..here.end.min(next.start)] {
                    add_tap(&mut first, &values[tap(point, x)], point);
                }
                for point in &points[both.clone()] {
                    let [a, b] = &values[tap(point, x)..][..2] else {
                        continue;
                    };
                    add_tap(&mut first, a, point);
                    add_tap(&mut second, b, point);
                }
                for point in &points[both.end..next.end] {
                    add_tap(&mut second, &values[tap(point, x + 1)], point);
                }
                [sums[x as usize], sums[x as usize + 1]] = [first, second];
                here = reach(x + 2, next);
                x += 2;
            }
            while x < end {
                let mut sum = sums[x as usize];
                for point in &points[here.clone()] {
                    add_tap(&mut sum, &values[tap(point, x)], point);
                }
                sums[x as usize] = sum;
                x += 1;
                here = reach(x, here);
            }
        }
    }
}

#[inline(always)]
fn add_tap<const L: usize>([light, cover]: &mut Sum<L>, value: &[f32; L], point: &Point<L>) {
    for l in 0..L {
        light[l] += value[l] * point.light[l];
        cover[l] += value[l] * point.cover[l];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_way_gives_the_same_bits_and_what_falls_beside_is_left() {
        let support = Support {
            left: -2,
            top: -1,
            width: 5,
            height: 3,
        };
        let tap = |i: usize| std::array::from_fn(|l| (i * 12 + l) as f32 * 0.37);
        let taps = Taps {
            support,
            values: (0..15).map(tap).collect(),
        };
        let point = |k: i32| Point {
            x: k % 9 - 2,
            y: k / 9 - 2,
            light: std::array::from_fn(|l| k as f32 * 0.11 + l as f32),
            cover: std::array::from_fn(|l| 0.1 + l as f32 * 0.01),
        };
        let points: Vec<Point<12>> = (0..63).map(point).collect();
        let mut plain = vec![[[0.0; 12]; 2]; 20];
        add_all(&taps, &points, 5, &mut plain);
        let mut best = vec![[[0.0; 12]; 2]; 20];
        add(&taps, &points, 5, &mut best);
        assert_eq!(plain, best);
        // The plain oracle: tap by tap.
        let mut oracle = vec![0f32; 20];
        for p in &points {
            for (i, tap) in taps.values.iter().enumerate() {
                let (x, y) = (p.x - 2 + (i % 5) as i32, p.y - 1 + (i / 5) as i32);
                if (0..5).contains(&x) && (0..4).contains(&y) {
                    oracle[(y * 5 + x) as usize] += tap[3] * p.light[3];
                }
            }
        }
        let lanes: Vec<f32> = plain.iter().map(|s| s[0][3]).collect();
        assert_eq!(lanes, oracle);
    }
}
