//! Lanczos weights without a sine per tap, a table, or a quotient of small numbers.
//!
//! Let f be the fraction of the position and g = 1 − f. The taps lie at the distances f + j on the left and g + j on
//! the right, j = 0..a−1. As sin(π(f+j)) = ±sin(πf) and sin(πg) = sin(πf), all weights share a sin(πf)/π², which the
//! normalisation takes out again:
//!
//! ```text
//! w(f + j) ∝ (−1)^j sin(π(f+j)/a) / (f+j)²        and the same with g
//! ```
//!
//! Times f·g that has no pole: j = 0 gives g · sin(πf/a)/f, a power series, and on the grid all other weights are
//! exactly 0. The sines of the other taps are those of the first, or sums of two of one sign, which lose no digits:
//!
//! ```text
//! a = 4:  sin(π(f+j)/4) = s(f), c(g), c(f), s(g)        s(f) = sin(πf/a), c(f) = cos(πf/a)
//! a = 3:  sin(π(f+j)/3) = s(f), s(f) + s(g), s(g)
//! ```
//!
//! The squares are brought to a common denominator, so one division remains.

use std::f64::consts::PI;

/// Taps a row: at ⌊x⌋ − 3 to ⌊x⌋ + 4. Three lobes leave the outer two at 0.
pub(crate) const TAPS: usize = 8;

/// (sin(πt/a)/t, cos(πt/a)) for 0 ≤ t ≤ 1: Taylor to 3e-10.
#[inline(always)]
fn sine_over_t_and_cosine<const A: usize>(t: f32) -> (f32, f32) {
    let rate = PI / A as f64;
    let q = t * t * (rate * rate) as f32;
    let sine = q * (-1.0 / 39_916_800.0) + 1.0 / 362_880.0;
    let sine = (((sine * q - 1.0 / 5040.0) * q + 1.0 / 120.0) * q - 1.0 / 6.0) * q + 1.0;
    let cosine = q * (-1.0 / 3_628_800.0) + 1.0 / 40_320.0;
    let cosine = (((cosine * q - 1.0 / 720.0) * q + 1.0 / 24.0) * q - 0.5) * q + 1.0;
    (sine * rate as f32, cosine)
}

/// Normalised weights for the fraction `f` in 0..=1.
#[inline(always)]
pub(crate) fn weights<const A: usize>(f: f32) -> [f32; TAPS] {
    let g = 1.0 - f;
    let fg = f * g;
    let (sf, cf) = sine_over_t_and_cosine::<A>(f);
    let (sg, cg) = sine_over_t_and_cosine::<A>(g);
    let square = |t: f32, j: f32| (t + j) * (t + j);
    let (f1, f2, g1, g2) = (
        square(f, 1.0),
        square(f, 2.0),
        square(g, 1.0),
        square(g, 2.0),
    );
    let taps = if A == 4 {
        let (f3, g3) = (square(f, 3.0), square(g, 3.0));
        let (f12, g12) = (f1 * f2, g1 * g2);
        let (left, right) = (f12 * f3, g12 * g3);
        let all = left * right;
        let (other_of_left, other_of_right) = (fg * right, fg * left);
        [
            -(other_of_left * f12) * (g * sg),
            other_of_left * (f1 * f3) * cf,
            -(other_of_left * (f2 * f3)) * cg,
            all * (g * sf),
            all * (f * sg),
            -(other_of_right * (g2 * g3)) * cf,
            other_of_right * (g1 * g3) * cg,
            -(other_of_right * g12) * (f * sf),
        ]
    } else {
        let (left, right) = (f1 * f2, g1 * g2);
        let all = left * right;
        let (other_of_left, other_of_right) = (fg * right, fg * left);
        let (first, second) = (f * sf, g * sg);
        let both = first + second;
        [
            0.0,
            other_of_left * f1 * second,
            -(other_of_left * f2) * both,
            all * (g * sf),
            all * (f * sg),
            -(other_of_right * g2) * both,
            other_of_right * g1 * first,
            0.0,
        ]
    };
    let pairs = [
        taps[0] + taps[7],
        taps[1] + taps[6],
        taps[2] + taps[5],
        taps[3] + taps[4],
    ];
    let scale = 1.0 / ((pairs[0] + pairs[1]) + (pairs[2] + pairs[3]));
    let mut weights = taps;
    // Not by `map`: its closure is a function of its own, without the caller's instructions.
    for weight in &mut weights {
        *weight *= scale;
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::super::{Lobes, plain};
    use super::*;

    #[test]
    fn weights_are_those_of_the_definition_to_single_precision() {
        for step in 0..=4096 {
            let f = step as f32 / 4096.0;
            for (lobes, found) in [
                (Lobes::Three, weights::<3>(f)),
                (Lobes::Four, weights::<4>(f)),
            ] {
                // At f = 1 the fast form stands on the right tap; the definition has moved on to the next pixel.
                let mut wanted = plain::weights(f64::from(f), lobes);
                if step == 4096 {
                    wanted.rotate_right(1);
                }
                for (found, wanted) in found.iter().zip(wanted) {
                    let error = (f64::from(*found) - wanted).abs();
                    assert!(error < 2.5e-7, "{lobes:?} f {f}: {found} is not {wanted}");
                }
            }
        }
    }
}
