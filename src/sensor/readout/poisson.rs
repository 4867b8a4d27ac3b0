//! Poisson numbers: exact for every mean.
//!
//! Below [`SMALL_MEAN`] by inversion: the smallest k whose distribution function exceeds one uniform number. Above it
//! by transformed rejection with squeeze, algorithm PTRS of W. Hörmann, Insurance: Mathematics and Economics 12, 39
//! (1993), whose time does not grow with the mean.

use super::Stream;

/// Smallest mean for which Hörmann's constants hold.
const SMALL_MEAN: f64 = 10.0;

/// A Poisson number of mean `mean`; 0 for a mean that is not above 0.
pub fn poisson(mean: f64, random: &mut Stream) -> f64 {
    if mean >= SMALL_MEAN {
        by_rejection(mean, random)
    } else if mean > 0.0 {
        by_inversion(mean, random.uniform())
    } else {
        0.0
    }
}

fn by_inversion(mean: f64, uniform: f64) -> f64 {
    let mut k = 0.0;
    let mut probability = (-mean).exp();
    let mut sum = probability;
    while uniform > sum {
        k += 1.0;
        probability *= mean / k;
        let next = sum + probability;
        if next == sum {
            break; // what is left of the law is below the rounding of the sum
        }
        sum = next;
    }
    k
}

fn by_rejection(mean: f64, random: &mut Stream) -> f64 {
    let b = 0.931 + 2.53 * mean.sqrt();
    let a = -0.059 + 0.02483 * b;
    let inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
    let sure = 0.9277 - 3.6224 / (b - 2.0);
    loop {
        let u = random.uniform() - 0.5;
        let v = random.uniform();
        let us = 0.5 - u.abs();
        let k = ((2.0 * a / us + b) * u + mean + 0.43).floor();
        if us >= 0.07 && v <= sure {
            return k;
        }
        if k < 0.0 || (us < 0.013 && v > us) {
            continue;
        }
        let hat = (v * inverse_alpha / (a / (us * us) + b)).ln();
        if hat <= k * mean.ln() - mean - ln_factorial(k) {
            return k;
        }
    }
}

/// ln k! of an integer: Stirling's series for k + 1 ≥ 10 (its next term is below 1e-10), else the product.
fn ln_factorial(k: f64) -> f64 {
    if k < 9.0 {
        return (2..=k as u32).map(f64::from).product::<f64>().ln();
    }
    let x = k + 1.0;
    let inverse = 1.0 / x;
    let square = inverse * inverse;
    let series = inverse * (1.0 / 12.0 - square * (1.0 / 360.0 - square * (1.0 / 1260.0)));
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln of the probability of k by its definition, an independent sum.
    fn ln_pmf(k: usize, mean: f64) -> f64 {
        k as f64 * mean.ln() - mean - (1..=k).map(|i| (i as f64).ln()).sum::<f64>()
    }

    #[test]
    fn stirlings_series_is_the_sum_of_logarithms() {
        for k in [0usize, 1, 2, 8, 9, 10, 30, 1000] {
            let sum: f64 = (1..=k).map(|i| (i as f64).ln()).sum();
            assert!(
                (ln_factorial(k as f64) - sum).abs() < 1e-9 * sum.max(1.0),
                "{k}"
            );
        }
    }

    #[test]
    fn numbers_pass_the_chi_square_test_against_the_poisson_law() {
        // Means on both sides of the change of method. The statistic has mean ν and variance 2ν; 4.5 deviations leave
        // it alone once in 1e5 (the seed is fixed, so the test cannot fail by chance later).
        const DRAWS: usize = 200_000;
        for (key, mean) in [0.02, 0.5, 3.0, 9.9, 10.0, 10.5, 25.0, 130.0, 2500.0]
            .into_iter()
            .enumerate()
        {
            let mut counts = std::collections::BTreeMap::new();
            for i in 0..DRAWS {
                let k = poisson(mean, &mut Stream::new(7, &[key as u64, i as u64])) as usize;
                *counts.entry(k).or_insert(0usize) += 1;
            }
            // Cells of at least 20 expected draws, from the left; the last takes the rest.
            let half = 6.0 * mean.sqrt() + 12.0;
            let (first, last) = ((mean - half).max(0.0) as usize, (mean + half) as usize);
            let (mut chi2, mut cells) = (0.0, 0);
            let (mut expected, mut seen, mut told, mut told_seen) = (0.0, 0, 0.0, 0);
            for k in first..=last {
                expected += DRAWS as f64 * ln_pmf(k, mean).exp();
                seen += counts.get(&k).copied().unwrap_or(0);
                if expected >= 20.0 && DRAWS as f64 - told - expected >= 20.0 {
                    chi2 += (seen as f64 - expected).powi(2) / expected;
                    (told, told_seen, cells) = (told + expected, told_seen + seen, cells + 1);
                    (expected, seen) = (0.0, 0);
                }
            }
            let rest = DRAWS as f64 - told;
            chi2 += ((DRAWS - told_seen) as f64 - rest).powi(2) / rest;
            let freedom = f64::from(cells);
            assert!(
                (chi2 - freedom).abs() < 4.5 * (2.0 * freedom).sqrt(),
                "mean {mean}: χ² {chi2} with {freedom} degrees of freedom"
            );
        }
    }

    #[test]
    fn mean_and_variance_are_equal_at_a_large_mean_and_nothing_comes_of_nothing() {
        let (n, mean) = (50_000, 3e5);
        let draws: Vec<f64> = (0..n)
            .map(|i| poisson(mean, &mut Stream::new(3, &[i])))
            .collect();
        let average = draws.iter().sum::<f64>() / n as f64;
        let variance = draws.iter().map(|k| (k - average).powi(2)).sum::<f64>() / n as f64;
        // Four standard errors: of the mean √(μ/n), of the variance μ√(2/n).
        assert!((average - mean).abs() < 4.0 * (mean / n as f64).sqrt());
        assert!((variance / mean - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt());
        for nothing in [0.0, -1.0, f64::NAN] {
            assert_eq!(poisson(nothing, &mut Stream::new(1, &[])), 0.0);
        }
    }
}
