//! Lorentz terms that follow a medium's ε over the wavelengths of a pulse.
//!
//! ε(ω) ≈ ε∞ + iσ/ω + Σ s/(ω0² − ω² − iγω) with ε∞, σ, s ≥ 0, so the medium is passive at every frequency. For given
//! (ω0, γ) the rest is a non-negative linear least-squares problem (solved by coordinate descent); (ω0, γ) are found by
//! the simplex method of Nelder & Mead, Comput. J. 7, 308 (1965). The fewest terms are taken that reach [`GOOD`].

use rustfft::num_complex::Complex64;

use super::error::refused;
use super::{Medium, Pole, SolverError};

type C = Complex64;

/// Relative error of ε at which no further term is tried.
const GOOD: f64 = 2e-3;
/// Most terms.
const MOST: usize = 3;

/// The medium for ε at the frequencies `omegas` (in 1/µm, at least one).
pub(super) fn medium(omegas: &[f64], epsilon: &[C]) -> Result<Medium, SolverError> {
    Ok(fit(omegas, epsilon)?.0)
}

/// A fit and its largest error |Δε|/|ε|.
///
/// # Errors
/// ε that no medium has.
pub fn fit(omegas: &[f64], epsilon: &[C]) -> Result<(Medium, f64), SolverError> {
    let mut best: Option<(Medium, f64)> = None;
    for terms in 0..=MOST {
        let problem = Problem { omegas, epsilon };
        // From the near ultraviolet, where dielectrics and silicon resonate, and from 0, where metals do.
        for start in [1.3, 0.3, 2.5] {
            let top = omegas.iter().copied().fold(0.0, f64::max);
            let from: Vec<f64> = (0..terms)
                .flat_map(|t| [(start + 0.4 * t as f64) * top, 0.1 * top * (t + 1) as f64])
                .collect();
            let at = nelder_mead(&|x| problem.cost(x), from);
            let medium = problem.medium(&at)?;
            let worst = omegas
                .iter()
                .zip(epsilon)
                .map(|(w, e)| (medium.epsilon(*w) - e).norm() / e.norm())
                .fold(0.0, f64::max);
            if best.as_ref().is_none_or(|(_, b)| worst < 0.9 * b) {
                best = Some((medium, worst));
            }
            if terms == 0 {
                break;
            }
        }
        if best.as_ref().is_some_and(|(_, worst)| *worst < GOOD) {
            break;
        }
    }
    best.ok_or_else(|| refused("wavelengths", 0, "at least one"))
}

struct Problem<'a> {
    omegas: &'a [f64],
    epsilon: &'a [C],
}

impl Problem<'_> {
    /// Least ε∞: the time step falls with its root, so dense dielectrics may not have it all in their poles. Corrected
    /// air lies below 1.
    fn least(&self) -> f64 {
        let lowest = self
            .epsilon
            .iter()
            .map(|e| e.re)
            .fold(f64::INFINITY, f64::min);
        if lowest > 2.0 { 0.4 * lowest } else { 0.8 }
    }

    /// Resonances and dampings from free numbers.
    fn shapes(x: &[f64]) -> Vec<[f64; 2]> {
        x.chunks_exact(2)
            .map(|p| [p[0].abs(), p[1].abs().max(1e-3)])
            .collect()
    }

    /// ε∞ − least, σ and strengths by non-negative least squares, and the sum of squared relative errors.
    fn linear(&self, x: &[f64]) -> (Vec<f64>, f64) {
        let shapes = Self::shapes(x);
        let mut columns: Vec<Vec<C>> = vec![
            self.weighted(|_| C::ONE),
            self.weighted(|w| C::new(0.0, 1.0 / w)),
        ];
        for [w0, g] in &shapes {
            // The strength in units of ω0² + γ² makes the columns alike in size.
            let unit = w0 * w0 + g * g;
            columns.push(self.weighted(|w| unit / C::new(w0 * w0 - w * w, -g * w)));
        }
        let mut rest: Vec<C> = self.weighted(|_| C::ZERO);
        for (r, e) in rest.iter_mut().zip(self.epsilon) {
            *r = (e - self.least()) / e.norm();
        }
        let mut a = vec![0.0; columns.len()];
        for _ in 0..400 {
            let mut moved = 0.0f64;
            for (a, column) in a.iter_mut().zip(&columns) {
                let norm: f64 = column.iter().map(C::norm_sqr).sum();
                let slope: f64 = column
                    .iter()
                    .zip(&rest)
                    .map(|(c, r)| (c.conj() * r).re)
                    .sum();
                let to = (*a + slope / norm).max(0.0);
                let by = to - *a;
                *a = to;
                for (r, c) in rest.iter_mut().zip(column) {
                    *r -= c * by;
                }
                moved = moved.max(by.abs() * norm.sqrt());
            }
            if moved < 1e-10 {
                break;
            }
        }
        let cost = rest.iter().map(C::norm_sqr).sum();
        (a, cost)
    }

    fn weighted(&self, f: impl Fn(f64) -> C) -> Vec<C> {
        self.omegas
            .iter()
            .zip(self.epsilon)
            .map(|(w, e)| f(*w) / e.norm())
            .collect()
    }

    fn cost(&self, x: &[f64]) -> f64 {
        self.linear(x).1
    }

    fn medium(&self, x: &[f64]) -> Result<Medium, SolverError> {
        let (a, _) = self.linear(x);
        let poles = Self::shapes(x)
            .iter()
            .zip(&a[2..])
            .filter(|(_, s)| **s > 0.0)
            .map(|([w0, g], s)| Pole {
                strength: s * (w0 * w0 + g * g),
                resonance: *w0,
                damping: *g,
            })
            .collect();
        Medium::new(self.least() + a[0], a[1], poles)
    }
}

/// The simplex method, from `start`; its point of least cost.
fn nelder_mead(cost: &dyn Fn(&[f64]) -> f64, start: Vec<f64>) -> Vec<f64> {
    let n = start.len();
    if n == 0 {
        return start;
    }
    let mut simplex: Vec<(f64, Vec<f64>)> = (0..=n)
        .map(|i| {
            let mut x = start.clone();
            if i > 0 {
                x[i - 1] *= 1.3;
            }
            (cost(&x), x)
        })
        .collect();
    for _ in 0..200 * n {
        simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
        if simplex[n].0 - simplex[0].0 <= 1e-12 * simplex[0].0.max(1e-14) {
            break;
        }
        let centre: Vec<f64> = (0..n)
            .map(|i| simplex[..n].iter().map(|s| s.1[i]).sum::<f64>() / n as f64)
            .collect();
        let towards = |t: f64, simplex: &[(f64, Vec<f64>)]| {
            let x: Vec<f64> = centre
                .iter()
                .zip(&simplex[n].1)
                .map(|(c, w)| c + t * (w - c))
                .collect();
            (cost(&x), x)
        };
        let reflected = towards(-1.0, &simplex);
        if reflected.0 < simplex[0].0 {
            let further = towards(-2.0, &simplex);
            simplex[n] = if further.0 < reflected.0 {
                further
            } else {
                reflected
            };
        } else if reflected.0 < simplex[n - 1].0 {
            simplex[n] = reflected;
        } else {
            let inside = towards(0.5, &simplex);
            if inside.0 < simplex[n].0 {
                simplex[n] = inside;
            } else {
                let best = simplex[0].1.clone();
                for s in &mut simplex[1..] {
                    for (x, b) in s.1.iter_mut().zip(&best) {
                        *x = b + 0.5 * (*x - b);
                    }
                    s.0 = cost(&s.1);
                }
            }
        }
    }
    simplex.sort_by(|a, b| a.0.total_cmp(&b.0));
    simplex.swap_remove(0).1
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::em::Material;

    fn table(name: &str, step: usize) -> (Vec<f64>, Vec<C>) {
        (0..=300 / step)
            .map(|i| 400.0 + (i * step) as f64)
            .map(|nm| {
                let n = Material::Table(name.into()).index(nm).unwrap();
                (
                    2.0 * std::f64::consts::PI / crate::units::um_from_nm(nm),
                    n * n,
                )
            })
            .unzip()
    }

    #[test]
    fn a_lorentz_medium_is_found_again() {
        let truth = Medium::new(
            2.0,
            0.0,
            vec![Pole {
                strength: 900.0,
                resonance: 18.0,
                damping: 1.5,
            }],
        )
        .unwrap();
        let omegas: Vec<f64> = (0..13).map(|i| 9.0 + 0.55 * f64::from(i)).collect();
        let epsilon: Vec<C> = omegas.iter().map(|w| truth.epsilon(*w)).collect();
        let (medium, worst) = fit(&omegas, &epsilon).unwrap();
        assert!(worst < 2e-3, "{worst}");
        for w in [9.3, 12.0, 15.4] {
            assert!((medium.epsilon(w) / truth.epsilon(w) - 1.0).norm() < 5e-3);
        }
    }

    /// Bounds: the tables' own steps of 25 nm, read linearly, differ from the measured curve by about 1 % of ε for
    /// silicon near 400 nm.
    #[test]
    fn silicon_oxide_and_tungsten_are_followed_over_the_visible() {
        for (name, bound) in [
            ("Si_Green2008", 0.03),
            ("SiO2_Malitson1965", 0.003),
            ("W_Rakic1998_LD", 0.02),
        ] {
            let (omegas, epsilon) = table(name, 25);
            let (medium, worst) = fit(&omegas, &epsilon).unwrap();
            println!("{name}: {} poles, worst {worst:.4}", medium.poles().len());
            assert!(worst < bound, "{name}: {worst}");
            for w in (1..300).map(f64::from) {
                assert!(medium.epsilon(w).im >= 0.0);
            }
        }
    }
}
