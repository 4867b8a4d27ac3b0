//! The diffraction pattern of an aperture: intensity of the light that a cone of even radiance focuses on a point.
//!
//! The cone fills a region Ω of direction cosines. Its field at a displacement d from the focus is the Fourier
//! transform of Ω (M. Born, E. Wolf, *Principles of Optics*, section 8.3; exact in d for a spherical wave, also
//! off the axis, since direction cosines are the spatial frequencies of the field):
//!
//! ```text
//! A(k) = ∫_Ω exp(i k·w) d²w,   k = 2π d/λ,        intensity K = |A|²
//! ```
//!
//! For a polygon the integral over the area is one over its edges Δ_n with middles m_n (S.-W. Lee, R. Mittra, IEEE
//! Trans. Antennas Propag. 31, 99 (1983)):
//!
//! ```text
//! A(k) = (i/k²) Σ_n (k × Δ_n) sinc(k·Δ_n/2) exp(i k·m_n)
//! ```
//!
//! Along a ray of k each edge's factor at the next radius is the one before turned by a fixed phase.

use glam::DVec2;
use rayon::prelude::*;

/// Distance of samples along the radius; rings are π apart.
pub(super) const STEP: f64 = std::f64::consts::PI / 9.0;
/// Samples along the radius.
pub(super) const RADII: usize = 180;
/// Directions of half a turn; the other half mirrors it.
pub(super) const ANGLES: usize = 48;

/// Intensities of a polygon's pattern on a polar grid, and its asymptote.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// `[radius][direction]`: K at the radius j · [`STEP`], relative to K(0), over half a turn.
    pub intensity: Vec<[f64; ANGLES]>,
    /// K k³ far out, per direction: the mean over the last four rings.
    pub far: [f64; ANGLES],
}

impl Pattern {
    /// Of the region inside `outline`, vertices in order, of a size of about 1.
    pub fn new(outline: &[DVec2]) -> Self {
        let area = area(outline).abs();
        let mut intensity = vec![[1.0; ANGLES]; RADII];
        let mut far = [0.0; ANGLES];
        let last_rings = RADII - 36;
        let direction =
            |angle: usize| DVec2::from_angle(std::f64::consts::PI * angle as f64 / ANGLES as f64);
        let angles = (0..ANGLES).into_par_iter();
        let amplitudes: Vec<Vec<f64>> = angles.map(|k| along(outline, direction(k))).collect();
        for (angle, amplitudes) in amplitudes.into_iter().enumerate() {
            for (j, amplitude) in amplitudes.into_iter().enumerate() {
                let value = amplitude / (area * area);
                intensity[j + 1][angle] = value;
                if j + 1 >= last_rings {
                    let k = (j + 1) as f64 * STEP;
                    far[angle] += value * k.powi(3) / (RADII - last_rings) as f64;
                }
            }
        }
        Self { intensity, far }
    }
}

/// Signed area of a polygon.
pub(super) fn area(outline: &[DVec2]) -> f64 {
    edges(outline).map(|(a, b)| 0.5 * a.perp_dot(b)).sum()
}

fn edges(outline: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(&a, &b)| (a, b))
}

/// |A|² at the radii `STEP`, 2 `STEP`, … of a direction.
fn along(outline: &[DVec2], direction: DVec2) -> Vec<f64> {
    // The phase of each edge's ends, its value and its turn per step.
    let turn = |p: DVec2| {
        let (sin, cos) = (STEP * direction.dot(p)).sin_cos();
        DVec2::new(cos, sin)
    };
    let turns: Vec<DVec2> = outline.iter().map(|&p| turn(p)).collect();
    let mut phases = turns.clone();
    let slopes: Vec<(f64, f64)> = edges(outline)
        .map(|(a, b)| (direction.perp_dot(b - a), direction.dot(b - a)))
        .collect();
    (1..RADII)
        .map(|j| {
            let k = j as f64 * STEP;
            let mut sum = DVec2::ZERO;
            for (n, &(cross, dot)) in slopes.iter().enumerate() {
                let (a, b) = (phases[n], phases[(n + 1) % phases.len()]);
                sum += cross * edge_mean(a, b, k * dot);
            }
            for (phase, turn) in phases.iter_mut().zip(&turns) {
                *phase = phase.rotate(*turn);
            }
            sum.length_squared() / (k * k)
        })
        .collect()
}

/// Mean of exp(iφ) along an edge between its values `a` and `b` at the ends, whose phases differ by `phase`:
/// (b − a)/(i phase), and by its series where that loses digits.
fn edge_mean(a: DVec2, b: DVec2, phase: f64) -> DVec2 {
    if phase.abs() > 1e-2 {
        let difference = b - a;
        return DVec2::new(difference.y, -difference.x) / phase;
    }
    // The value in the middle is along a + b; sinc(phase/2)/cos(phase/2) = 1 + phase²/12 + …
    0.5 * (a + b) * (1.0 + phase * phase / 12.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bessel functions J₀ and J₁ by their integrals (Born & Wolf, appendix), with n points: exact for k < n.
    fn bessel(k: f64) -> [f64; 2] {
        let n = 400;
        let at = |i: usize| std::f64::consts::PI * (i as f64 + 0.5) / n as f64;
        let mean = |f: &dyn Fn(f64) -> f64| (0..n).map(|i| f(at(i))).sum::<f64>() / n as f64;
        [
            mean(&|t| (k * t.sin()).cos()),
            mean(&|t| (t - k * t.sin()).cos()),
        ]
    }

    #[test]
    fn a_disk_gives_airys_pattern_and_its_asymptote() {
        let disk: Vec<DVec2> = (0..2000)
            .map(|i| DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / 2000.0))
            .collect();
        let pattern = Pattern::new(&disk);
        for j in 1..RADII {
            let k = j as f64 * STEP;
            let airy = (2.0 * bessel(k)[1] / k).powi(2);
            for value in pattern.intensity[j] {
                assert!(
                    (value - airy).abs() < 3e-4 / k.powi(3),
                    "{k}: {value} {airy}"
                );
            }
        }
        // ⟨(2 J₁/k)²⟩ k³ → 4/π.
        for far in pattern.far {
            assert!((far - 4.0 / std::f64::consts::PI).abs() < 0.02, "{far}");
        }
    }

    #[test]
    fn a_rectangle_gives_the_product_of_two_sincs() {
        let (a, b) = (1.0, 0.4);
        let corners = [(a, b), (-a, b), (-a, -b), (a, -b)].map(DVec2::from);
        let pattern = Pattern::new(&corners);
        let sinc = |x: f64| if x == 0.0 { 1.0 } else { x.sin() / x };
        for (j, ring) in pattern.intensity.iter().enumerate() {
            for (angle, value) in ring.iter().enumerate() {
                let k = j as f64
                    * STEP
                    * DVec2::from_angle(std::f64::consts::PI * angle as f64 / ANGLES as f64);
                let exact = (sinc(a * k.x) * sinc(b * k.y)).powi(2);
                assert!((value - exact).abs() < 1e-9, "{k}: {value} {exact}");
            }
        }
    }
}
