//! Least squares by normal equations: the basis is orthogonal, so they are well-conditioned wherever the points fill
//! the disk, and a small ridge holds what a part of the disk leaves open. Written out, as a library's sums would differ
//! with the processor's instructions, and with them the bytes of a sample.

use crate::simd::SimdLevel;

/// Of the mean of a basis function's square.
const RIDGE: f64 = 1e-11;

/// BᵀB of rows.
#[derive(Clone, Debug)]
pub(in crate::lens) struct Squares {
    count: usize,
    /// Lower triangle, row by row of `count` each.
    lower: Vec<f64>,
}

impl Squares {
    /// Of all rows, of `count` values each.
    pub fn new(rows: &[f64], count: usize) -> Self {
        let all: Vec<u32> = (0..(rows.len() / count) as u32).collect();
        Self::of(rows, count, &all)
    }

    fn of(rows: &[f64], count: usize, taken: &[u32]) -> Self {
        let mut lower = vec![0.0; count * count];
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
            SimdLevel::Avx512 => unsafe { squares_avx512(rows, count, taken, &mut lower) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 => unsafe { squares_avx2(rows, count, taken, &mut lower) },
            _ => squares(rows, count, taken, &mut lower),
        }
        Self { count, lower }
    }

    /// Of those whose number is in `taken`, in order: these squares less those of the others.
    fn without(&self, rows: &[f64], taken: &[u32]) -> Vec<f64> {
        let mut next = taken.iter().copied().peekable();
        let left_out: Vec<u32> = (0..(rows.len() / self.count) as u32)
            .filter(|k| next.next_if_eq(k).is_none())
            .collect();
        let mut lower = Self::of(rows, self.count, &left_out).lower;
        for (sum, all) in lower.iter_mut().zip(&self.lower) {
            *sum = all - *sum;
        }
        lower
    }
}

/// BᵀB of the rows that were taken, factored.
#[derive(Clone, Debug)]
pub(in crate::lens) struct Factor {
    count: usize,
    /// Lower triangle L of L Lᵀ, row by row of `count` each.
    lower: Vec<f64>,
}

impl Factor {
    /// Of all the `rows`, of `count` values each; `None` where they leave a direction open.
    pub fn new(rows: &[f64], count: usize) -> Option<Self> {
        let all: Vec<u32> = (0..(rows.len() / count) as u32).collect();
        Self::of_taken(&Squares::new(rows, count), rows, &all)
    }

    /// Of those of the rows whose number is in `taken`, in order; `all`: the squares of all rows.
    pub fn of_taken(all: &Squares, rows: &[f64], taken: &[u32]) -> Option<Self> {
        let count = all.count;
        let mut lower = match 2 * taken.len() < rows.len() / count {
            true => Squares::of(rows, count, taken).lower,
            // What is left out is less work.
            false => all.without(rows, taken),
        };
        for i in 0..count {
            lower[i * count + i] += RIDGE * taken.len() as f64;
        }
        let is_closed = match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { factored_avx2(&mut lower, count) },
            _ => factored(&mut lower, count),
        };
        is_closed.then_some(Self { count, lower })
    }

    /// (BᵀB)⁻¹ x, in the place of x. With fewer values than `count`, of that many first basis functions alone: the
    /// factor of a leading part is the leading part of the factor.
    pub fn solve(&self, x: &mut [f64]) {
        let n = x.len().min(self.count);
        for i in 0..n {
            let row = &self.lower[i * self.count..][..i + 1];
            x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
        }
        for i in (0..n).rev() {
            let row = &self.lower[i * self.count..][..i + 1];
            x[i] /= row[i];
            let value = x[i];
            for (x, l) in x[..i].iter_mut().zip(row) {
                *x -= value * l;
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn squares_avx2(rows: &[f64], count: usize, taken: &[u32], lower: &mut [f64]) {
    squares(rows, count, taken, lower);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn squares_avx512(rows: &[f64], count: usize, taken: &[u32], lower: &mut [f64]) {
    squares(rows, count, taken, lower);
}

/// Lower triangle of BᵀB, four rows of B at a time; every sum in one order, whatever the instructions.
#[inline(always)]
fn squares(rows: &[f64], count: usize, taken: &[u32], lower: &mut [f64]) {
    let row = |k: u32| &rows[k as usize * count..][..count];
    let fours = taken.chunks_exact(4);
    for &k in fours.remainder() {
        for (i, &factor) in row(k).iter().enumerate() {
            let sums = lower[i * count..][..i + 1].iter_mut();
            sums.zip(row(k))
                .for_each(|(sum, value)| *sum += factor * value);
        }
    }
    for four in fours {
        let four = [0, 1, 2, 3].map(|k| row(four[k]));
        // Two rows of sums at a time: what they are multiplied with is read once.
        let (pairs, last) = lower.split_at_mut(count / 2 * 2 * count);
        for (k, pair) in pairs.chunks_exact_mut(2 * count).enumerate() {
            let i = 2 * k;
            let (first, second) = pair.split_at_mut(count);
            let factors = [i, i + 1].map(|i| four.map(|row| row[i]));
            let rows = four.map(|row| &row[..i + 1]);
            let both = first[..i + 1].iter_mut().zip(&mut second[..i + 1]);
            for (j, (first, second)) in both.enumerate() {
                let values = rows.map(|row| row[j]);
                *first += product(&factors[0], &values);
                *second += product(&factors[1], &values);
            }
            second[i + 1] += product(&factors[1], &factors[1]);
        }
        if count % 2 == 1 {
            let factors = four.map(|row| row[count - 1]);
            let rows = four.map(|row| &row[..count]);
            for (j, sum) in last[..count].iter_mut().enumerate() {
                *sum += product(&factors, &rows.map(|row| row[j]));
            }
        }
    }
}

#[inline(always)]
fn product(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn factored_avx2(lower: &mut [f64], count: usize) -> bool {
    factored(lower, count)
}

/// L in the place of L Lᵀ; false where that leaves a direction open. The same bits at every level.
#[inline(always)]
fn factored(lower: &mut [f64], count: usize) -> bool {
    for i in 0..count {
        let (above, below) = lower.split_at_mut(i * count);
        let row = &mut below[..count];
        for j in 0..i {
            let other = &above[j * count..][..j + 1];
            row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
        }
        let left = row[i] - dot(&row[..i], &row[..i]);
        if left.is_nan() || left <= 0.0 {
            return false;
        }
        row[i] = left.sqrt();
    }
    true
}

/// Eight sums side by side, which the compiler may keep in vectors.
#[inline(always)]
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = (a8.remainder().iter().zip(b8.remainder()))
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a8.zip(b8) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn fewer_basis_functions_are_solved_as_alone() {
        let (rows, count, few) = (40, 10, 6);
        let at = |k: usize, i: usize| ((7 * k + 3 * i * i) % 17) as f64 - 8.0;
        let all: Vec<f64> = (0..rows * count)
            .map(|v| at(v / count, v % count))
            .collect();
        let part: Vec<f64> = (0..rows * few).map(|v| at(v / few, v % few)).collect();
        let (all, part) = (
            Factor::new(&all, count).unwrap(),
            Factor::new(&part, few).unwrap(),
        );
        let mut x: Vec<f64> = (0..few).map(|i| 1.0 + i as f64).collect();
        let mut y = x.clone();
        all.solve(&mut x);
        part.solve(&mut y);
        for (x, y) in x.iter().zip(&y) {
            assert!((x - y).abs() < 1e-12 * y.abs().max(1e-3), "{x} {y}");
        }
    }

    #[test]
    fn squares_of_every_level_are_those_of_the_definition() {
        let (rows, count) = (11, 9);
        let at = |k: usize, i: usize| ((7 * k + 3 * i) % 13) as f64 - 6.0;
        let values: Vec<f64> = (0..rows * count)
            .map(|v| at(v / count, v % count))
            .collect();
        let taken: Vec<u32> = vec![0, 2, 3, 4, 7, 9, 10];
        let of = |fill: &dyn Fn(&mut [f64])| {
            let mut lower = vec![0.0; count * count];
            fill(&mut lower);
            lower
        };
        let plain = of(&|lower| squares(&values, count, &taken, lower));
        for i in 0..count {
            for j in 0..=i {
                // Whole numbers: sums are exact in any order.
                let sum = |k: &u32| at(*k as usize, i) * at(*k as usize, j);
                assert_eq!(plain[i * count + j], taken.iter().map(sum).sum::<f64>());
            }
        }
        assert_eq!(Squares::new(&values, count).without(&values, &taken), plain);
        #[cfg(target_arch = "x86_64")]
        {
            let best = SimdLevel::detect();
            if best >= SimdLevel::Avx2 {
                // SAFETY: `detect` found AVX2 (or more) on this CPU.
                let found = of(&|lower| unsafe { squares_avx2(&values, count, &taken, lower) });
                assert_eq!(found, plain);
            }
            if best >= SimdLevel::Avx512 {
                // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
                let found = of(&|lower| unsafe { squares_avx512(&values, count, &taken, lower) });
                assert_eq!(found, plain);
            }
        }
    }
}
