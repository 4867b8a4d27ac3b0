//! Modes of silicon parted by trenches, along one axis.
//!
//! Trenches along x and y lower ε by Δ = ε_si − ε_trench. Where they cross they would lower it twice; the crossings are
//! small and dark, so `ε(x, y) ≈ ε_si − Δ χ(x) − Δ χ(y)` and the modes are products of modes of one axis:
//!
//! `(d²/dx² − k0² Δ χ(x)) φ = λ φ`,  `β² = k0² ε_si + λ_x + λ_y`  (χ = 1 in a trench; Marcatili's approximation).
//!
//! In the Fourier orders of the cell this is a real symmetric matrix (the trenches lie symmetrically about the centre),
//! solved by Jacobi rotations.

use rustfft::num_complex::Complex64;

type C = Complex64;

/// Modes of one axis at one Bloch wavenumber, best guided (largest λ) first.
pub(super) struct AxisModes {
    /// Index a of the first Fourier order.
    pub first: i64,
    /// Fourier orders, also the number of modes.
    pub count: usize,
    /// λ in 1/µm².
    pub lambda: Vec<f64>,
    /// Amplitude of Fourier order (row) in mode (column).
    pub amplitude: Vec<f64>,
    /// Modes kept for the absorption.
    pub absorbing: usize,
    /// Per sub-pixel, `∫ φ_i* φ_j dx / pitch` over the silicon whose charge it collects: kept × kept.
    pub overlap: Vec<Vec<C>>,
    /// Part of each kept mode that lies in silicon.
    pub in_silicon: Vec<f64>,
}

/// The trenches along one axis.
#[derive(Clone, Copy)]
pub(super) struct Trenches {
    /// Period, µm.
    pub pitch_um: f64,
    pub width_um: f64,
    /// Widths in µm that collect no charge, at the splits and at the borders; no narrower than trenches.
    pub uncollected_um: [f64; 2],
    /// Photodiodes along the axis; a trench at each border.
    pub parts: usize,
    /// Photodiodes of one pixel: its border lies beside each so many.
    pub parts_of_pixel: usize,
    /// k0² (Re ε_si − Re ε_trench) in 1/µm².
    pub barrier: f64,
}

impl AxisModes {
    /// Orders up to |k| ≤ `cutoff`, absorption from modes of transverse wavenumber up to `kept` (1/µm).
    pub fn new(t: &Trenches, bloch: f64, cutoff: f64, absorbing: f64) -> Self {
        let g = 2.0 * std::f64::consts::PI / t.pitch_um;
        let reach = (cutoff / g).ceil() as i64;
        let first = -reach - (bloch / g).round() as i64;
        let count = (2 * reach + 1) as usize;
        let mut matrix = vec![0.0; count * count];
        let chi: Vec<f64> = (0..count).map(|n| t.series(n)).collect();
        for i in 0..count {
            for j in 0..count {
                matrix[i * count + j] = -t.barrier * chi[i.abs_diff(j)];
            }
            let k = bloch + g * (first + i as i64) as f64;
            matrix[i * count + i] -= k * k;
        }
        let (lambda, amplitude) = symmetric_eigen(matrix, count);
        let absorbing = lambda
            .iter()
            .take_while(|&&l| l > -absorbing * absorbing)
            .count()
            .max(1);
        let overlap_beside = |widths_um: [f64; 2]| -> Vec<Vec<C>> {
            let one = |part| {
                let series = (0..count).map(|n| t.series_beside(widths_um, part, n));
                overlap(&amplitude, &series.collect::<Vec<C>>(), count, absorbing)
            };
            (0..t.parts).map(one).collect()
        };
        let trenches_um = [t.width_um; 2];
        let silicon = overlap_beside(trenches_um);
        let share = |i: usize| silicon.iter().map(|o| o[i * absorbing + i].re).sum();
        let in_silicon = (0..absorbing).map(share).collect();
        let overlap = match t.uncollected_um == trenches_um {
            true => silicon,
            false => overlap_beside(t.uncollected_um),
        };
        Self {
            first,
            count,
            lambda,
            amplitude,
            absorbing,
            overlap,
            in_silicon,
        }
    }
}

impl Trenches {
    /// nth Fourier coefficient of χ: trenches of half width at both ends, whole ones between the photodiodes.
    fn series(&self, n: usize) -> f64 {
        let one = self.width_um / self.pitch_um * sinc(n as f64 * self.width_um / self.pitch_um);
        (0..self.parts)
            .map(|i| {
                let place = i as f64 / self.parts as f64 - 0.5;
                one * (2.0 * std::f64::consts::PI * n as f64 * place).cos()
            })
            .sum()
    }

    /// `∫ e^(2πi n x / p) dx / p` over one photodiode, beside strips of these widths at splits and borders.
    fn series_beside(&self, [split_um, border_um]: [f64; 2], part: usize, n: usize) -> C {
        let strip = |edge: usize| match edge.is_multiple_of(self.parts_of_pixel) {
            true => border_um / self.pitch_um,
            false => split_um / self.pitch_um,
        };
        let [before, behind] = [strip(part), strip(part + 1)];
        let width = 1.0 / self.parts as f64 - 0.5 * (before + behind);
        let centre = (part as f64 + 0.5) / self.parts as f64 - 0.5 + 0.25 * (before - behind);
        let n = n as f64;
        C::from_polar(
            width * sinc(n * width),
            2.0 * std::f64::consts::PI * n * centre,
        )
    }
}

fn overlap(amplitude: &[f64], series: &[C], count: usize, absorbing: usize) -> Vec<C> {
    // half[i][b] = Σ_a B_ai w_(b−a);  X_ij = Σ_b half[i][b] B_bj
    let weight = |a: usize, b: usize| {
        if b >= a {
            series[b - a]
        } else {
            series[a - b].conj()
        }
    };
    let mut half = vec![C::ZERO; absorbing * count];
    for a in 0..count {
        for i in 0..absorbing {
            let amp = amplitude[a * count + i];
            for b in 0..count {
                half[i * count + b] += weight(a, b) * amp;
            }
        }
    }
    let mut x = vec![C::ZERO; absorbing * absorbing];
    for i in 0..absorbing {
        for b in 0..count {
            let h = half[i * count + b];
            for j in 0..absorbing {
                x[i * absorbing + j] += h * amplitude[b * count + j];
            }
        }
    }
    x
}

fn sinc(x: f64) -> f64 {
    let y = std::f64::consts::PI * x;
    if y.abs() < 1e-9 { 1.0 } else { y.sin() / y }
}

/// Eigenvalues (descending) and eigenvectors (columns) of a real symmetric matrix: cyclic Jacobi rotations (Golub & Van
/// Loan, Matrix Computations, 8.5).
fn symmetric_eigen(mut m: Vec<f64>, n: usize) -> (Vec<f64>, Vec<f64>) {
    // Rows of `v` are the eigenvectors while rotating: both updates run along rows.
    let mut v = vec![0.0; n * n];
    for i in 0..n {
        v[i * n + i] = 1.0;
    }
    let scale: f64 = m.iter().map(|x| x * x).sum();
    for _sweep in 0..30 {
        let mut off = 0.0;
        for p in 0..n {
            for q in p + 1..n {
                let apq = m[p * n + q];
                off += apq * apq;
                if apq * apq <= 1e-34 * scale {
                    continue;
                }
                let theta = (m[q * n + q] - m[p * n + p]) / (2.0 * apq);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..n {
                    let (a, b) = (m[k * n + p], m[k * n + q]);
                    m[k * n + p] = c * a - s * b;
                    m[k * n + q] = s * a + c * b;
                }
                rotate_rows(&mut m, n, [p, q], [c, s]);
                rotate_rows(&mut v, n, [p, q], [c, s]);
            }
        }
        if off <= 1e-26 * scale {
            break;
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| m[b * n + b].total_cmp(&m[a * n + a]));
    let values = order.iter().map(|&i| m[i * n + i]).collect();
    let mut vectors = vec![0.0; n * n];
    for (column, &i) in order.iter().enumerate() {
        for row in 0..n {
            vectors[row * n + column] = v[i * n + row];
        }
    }
    (values, vectors)
}

/// Rows p < q turned by the angle of cosine c and sine s.
fn rotate_rows(m: &mut [f64], n: usize, [p, q]: [usize; 2], [c, s]: [f64; 2]) {
    let (head, tail) = m.split_at_mut(q * n);
    let (row_p, row_q) = (&mut head[p * n..(p + 1) * n], &mut tail[..n]);
    for (a, b) in row_p.iter_mut().zip(row_q) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WALLS: Trenches = Trenches {
        pitch_um: 1.6,
        width_um: 0.1,
        uncollected_um: [0.1; 2],
        parts: 2,
        parts_of_pixel: 2,
        barrier: 130.5 * 14.5,
    };

    #[test]
    fn modes_without_trenches_are_the_orders_themselves() {
        let t = Trenches {
            width_um: 0.0,
            uncollected_um: [0.0; 2],
            ..WALLS
        };
        let modes = AxisModes::new(&t, 2.0, 50.0, 30.0);
        let g = 2.0 * std::f64::consts::PI / 1.6;
        let mut expected: Vec<f64> = (0..modes.count)
            .map(|i| -(2.0 + g * (modes.first + i as i64) as f64).powi(2))
            .collect();
        expected.sort_by(|a, b| b.total_cmp(a));
        for (got, want) in modes.lambda.iter().zip(&expected) {
            assert!((got - want).abs() < 1e-6);
        }
    }

    #[test]
    fn lowest_mode_between_walls_follows_the_slab_guide_equation() {
        // One isolated well of width 0.7 µm between thick barriers: even mode, κ tan(κ w/2) = √(barrier − κ²). The
        // 0.1 µm trenches are thick for the decay length of 1/43 µm.
        let modes = AxisModes::new(&WALLS, 0.0, 130.0, 30.0);
        let (mut low, mut high) = (0.0, std::f64::consts::PI / 0.7);
        for _ in 0..60 {
            let k: f64 = 0.5 * (low + high);
            if k * (k * 0.35).tan() < (WALLS.barrier - k * k).sqrt() {
                low = k;
            } else {
                high = k;
            }
        }
        assert!(
            (modes.lambda[0] / -(low * low) - 1.0).abs() < 0.01,
            "{} {}",
            modes.lambda[0],
            low * low
        );
    }

    #[test]
    fn isolation_takes_charge_and_no_light() {
        let plain = Trenches {
            width_um: 0.0,
            uncollected_um: [0.0; 2],
            ..WALLS
        };
        let isolated = Trenches {
            uncollected_um: [0.2, 0.6],
            ..plain
        };
        let [plain, isolated] = [plain, isolated].map(|t| AxisModes::new(&t, 0.0, 60.0, 20.0));
        assert_eq!(plain.lambda, isolated.lambda);
        assert_eq!(plain.in_silicon, isolated.in_silicon);
        // The lowest mode is the same everywhere: 0.4 of 0.8 µm of each photodiode are left.
        let share = |modes: &AxisModes| modes.overlap[0][0].re;
        assert!((share(&plain) - 0.5).abs() < 1e-12 && (share(&isolated) - 0.25).abs() < 1e-12);
    }

    #[test]
    fn photodiodes_and_trenches_share_a_mode_between_them() {
        let modes = AxisModes::new(&WALLS, 1.0, 60.0, 20.0);
        for i in 0..modes.absorbing {
            let share: f64 = modes
                .overlap
                .iter()
                .map(|x| x[i * modes.absorbing + i].re)
                .sum();
            assert!(share > 0.5 && share < 1.0 + 1e-12, "{share}");
        }
        assert!((modes.overlap[0][0].re - modes.overlap[1][0].re).abs() < 0.51);
    }
}
