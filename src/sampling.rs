//! Low-discrepancy samples and hashed random numbers, keyed so that nothing depends on threads, tiles or order.
//!
//! - [`hash`] / [`uniform`]: a counter-based generator: the value is a function of the key words alone.
//! - [`SobolSet`]: the first N points of the 5-D Sobol sequence (direction numbers: Joe & Kuo, SIAM J. Sci. Comput. 30,
//!   2635 (2008)), Owen-scrambled afresh for each key by hashing (Laine & Karras 2011; the constants are those that
//!   N. Vegdahl published in 2021). A scrambled set is an unbiased estimator, and each pixel has its own.

/// Dimensions of a [`SobolSet`]: position in the pixel (2), position in the pupil (2), diffraction (1).
pub const DIMENSIONS: usize = 5;

/// Primitive-polynomial data (degree, coefficients, initial m) of Sobol dimensions 2 to 5; dimension 1 is van der
/// Corput.
const JOE_KUO: [(usize, u32, &[u32]); DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
];

/// Mixes 64 bits (the finaliser of SplitMix64, Steele et al. 2014).
#[inline]
pub fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// A 64-bit hash of a seed and any number of key words.
#[inline]
pub fn hash(seed: u64, words: &[u64]) -> u64 {
    words.iter().fold(mix(seed), |h, &w| mix(h ^ mix(w)))
}

/// A uniform number in [0, 1) from a seed and key words.
#[inline]
pub fn uniform(seed: u64, words: &[u64]) -> f64 {
    (hash(seed, words) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// The first `len` points of the Sobol sequence, to be scrambled for each key.
#[derive(Clone, Debug)]
pub struct SobolSet {
    /// Bit-reversed integers, one array a dimension: scrambling works from the lowest bit up.
    reversed: [Vec<u32>; DIMENSIONS],
}

impl SobolSet {
    /// `len` points (any number; powers of two are best).
    pub fn new(len: usize) -> Self {
        let reversed = std::array::from_fn(|dim| {
            let directions = direction_numbers(dim);
            let mut x = 0u32;
            (0..len as u32)
                .map(|i| {
                    if i > 0 {
                        // Gray-code order: point i differs from i − 1 by one direction number.
                        x ^= directions[i.trailing_zeros() as usize];
                    }
                    x.reverse_bits()
                })
                .collect()
        });
        Self { reversed }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.reversed[0].len()
    }

    /// Whether the set has no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes coordinate `dim` of points `first .. first + out.len()`, scrambled by `key`, in [0, 1).
    ///
    /// Only as many points as the set still has are written; the number is returned.
    #[inline(always)]
    pub fn fill(&self, dim: usize, key: u64, first: usize, out: &mut [f64]) -> usize {
        let seed = hash(key, &[dim as u64]) as u32;
        let source = self.reversed[dim].get(first..).unwrap_or(&[]);
        let n = source.len().min(out.len());
        for (o, &x) in out[..n].iter_mut().zip(&source[..n]) {
            *o = f64::from(owen_scramble(x, seed)) * (1.0 / 4_294_967_296.0);
        }
        n
    }
}

/// Owen scrambling of a bit-reversed integer by hashing: each bit is flipped by a hash of the bits above it.
#[inline(always)]
pub(crate) fn owen_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// The 32 direction numbers of dimension `dim` (0-based), by the recurrence of Bratley & Fox (1988).
fn direction_numbers(dim: usize) -> [u32; 32] {
    let mut v = [0u32; 32];
    if dim == 0 {
        for (i, d) in v.iter_mut().enumerate() {
            *d = 1 << (31 - i);
        }
        return v;
    }
    let (degree, a, m) = JOE_KUO[dim - 1];
    for i in 0..32 {
        v[i] = if i < degree {
            m[i] << (31 - i)
        } else {
            let mut x = v[i - degree] ^ (v[i - degree] >> degree);
            for k in 1..degree {
                if (a >> (degree - 1 - k)) & 1 == 1 {
                    x ^= v[i - k];
                }
            }
            x
        };
    }
    v
}

/// Maps the unit square to the unit disk, keeping areas and neighbourhoods (Shirley & Chiu, J. Graph. Tools 2, 45
/// (1997)).
///
/// The sine and cosine of at most π/4 are Taylor polynomials (error below 1e-10), so that blocks of samples vectorise
/// and results do not depend on the system's mathematical library.
#[inline(always)]
pub fn concentric_disk(s: f64, t: f64) -> (f64, f64) {
    let (a, b) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    let wide = a.abs() > b.abs();
    let (r, other) = if wide { (a, b) } else { (b, a) };
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let phi = ratio * std::f64::consts::FRAC_PI_4;
    let q = phi * phi;
    let sin = phi
        * (1.0
            + q * (-1.0 / 6.0
                + q * (1.0 / 120.0
                    + q * (-1.0 / 5040.0 + q * (1.0 / 362_880.0 - q / 39_916_800.0)))));
    let cos = 1.0
        + q * (-0.5
            + q * (1.0 / 24.0
                + q * (-1.0 / 720.0
                    + q * (1.0 / 40_320.0 + q * (-1.0 / 3_628_800.0 + q / 479_001_600.0)))));
    if wide {
        (r * cos, r * sin)
    } else {
        (r * sin, r * cos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: usize, key: u64) -> Vec<[f64; DIMENSIONS]> {
        let set = SobolSet::new(n);
        let mut columns = vec![vec![0.0; n]; DIMENSIONS];
        for (d, c) in columns.iter_mut().enumerate() {
            assert_eq!(set.fill(d, key, 0, c), n);
        }
        (0..n)
            .map(|i| std::array::from_fn(|d| columns[d][i]))
            .collect()
    }

    #[test]
    fn every_pair_of_dimensions_is_stratified() {
        // A scrambled digital (t, m, s)-net keeps one point in each 1-D stratum, and the first two dimensions are a (0,
        // m, 2)-net.
        let p = points(256, 7);
        for d in 0..DIMENSIONS {
            let mut seen = [0; 256];
            p.iter().for_each(|x| seen[(x[d] * 256.0) as usize] += 1);
            assert!(seen.iter().all(|&n| n == 1), "dimension {d}");
        }
        for (bx, by) in [(1, 256), (2, 128), (16, 16), (64, 4)] {
            let mut seen = vec![0; 256];
            p.iter().for_each(|x| {
                seen[(x[0] * bx as f64) as usize * by + (x[1] * by as f64) as usize] += 1
            });
            assert!(seen.iter().all(|&n| n == 1), "{bx} by {by}");
        }
    }

    #[test]
    fn error_of_a_smooth_integral_falls_faster_than_one_over_root_n() {
        let f = |x: &[f64; DIMENSIONS]| x.iter().map(|&t| 1.0 + (t - 0.5)).product::<f64>();
        let rms = |n: usize| {
            let e: f64 = (0..32)
                .map(|k| (points(n, k).iter().map(f).sum::<f64>() / n as f64 - 1.0).powi(2))
                .sum();
            (e / 32.0).sqrt()
        };
        let order = (rms(64) / rms(4096)).log2() / 6.0;
        assert!(order > 1.0, "order {order}");
    }

    #[test]
    fn keys_give_different_sets_and_equal_keys_equal_ones() {
        assert_eq!(points(16, 3), points(16, 3));
        assert_ne!(points(16, 3), points(16, 4));
    }

    #[test]
    fn disk_mapping_keeps_area_and_matches_sine_and_cosine() {
        let n = 1 << 14;
        let inside = points(n, 1).into_iter().filter(|p| {
            let (x, y) = concentric_disk(p[0], p[1]);
            assert!(x * x + y * y <= 1.0 + 1e-9);
            x * x + y * y < 0.25
        });
        let share = inside.count() as f64 / n as f64;
        assert!((share - 0.25).abs() < 2e-3, "{share}");
        let (x, y) = concentric_disk(1.0, 1.0);
        assert!((x - 0.5f64.sqrt()).abs() < 1e-10 && (y - 0.5f64.sqrt()).abs() < 1e-10);
    }

    #[test]
    fn hashed_uniforms_have_the_right_mean_and_variance() {
        let n = 100_000;
        let x: Vec<f64> = (0..n).map(|i| uniform(5, &[i, 2])).collect();
        let mean = x.iter().sum::<f64>() / n as f64;
        let var = x.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / n as f64;
        assert!(
            (mean - 0.5).abs() < 4.0 * (1.0f64 / 12.0 / n as f64).sqrt()
                && (var - 1.0 / 12.0).abs() < 2e-3
        );
    }
}
