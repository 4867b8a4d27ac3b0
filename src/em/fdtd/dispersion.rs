//! The permittivity that makes a plane wave's wavenumber along z exact on the grid.
//!
//! On the grid a plane wave obeys K_x² + K_y² + K_z² = ε′ Ω², K_a = (2/d_a) sin(k_a d_a/2), Ω = (2/dt) sin(ω dt/2) (Taflove & Hagness,
//! Computational Electrodynamics, ch. 4). For the wanted k_x, k_y and k_z = √(n²ω² − k_x² − k_y²) this gives ε′.
//!
//! Directions: for k_x ≪ k the grid bends k_z(k_x) too little or too much, −k_x²/(2k) becomes −k_x²/(2k sinc(k d_z)), and oblique light drifts
//! sideways by several per cent too far. Layers of equal optical thickness have the same k d_z in every medium, so one factor mends it
//! everywhere: lateral differences are taken over d/a, a² = sinc(k d_z) ([`stretch`]). What is left is of order (k d)² (k_x/k)⁴.
//!
//! Interfaces: with tangential E on the interface the grid sees, for s, the admittances sin(k_z d_z)/d_z on both sides. Their ratio
//! is right if k_z d_z is equal on both: layers of equal optical thickness. The node on the interface is then exact with
//! (ε′₁ d₁ + ε′₂ d₂)/(d₁ + d₂).

use rustfft::num_complex::Complex64;

type C = Complex64;

/// What the grid makes of one frequency and transverse wavevector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numerics {
    /// Angular frequency ω in 1/µm.
    pub omega: f64,
    pub dt_um: f64,
    /// dx, dy in µm.
    pub lateral_um: [f64; 2],
    /// The same as the stepper has them: divided by [`stretch`].
    pub stepped_um: [f64; 2],
    /// k_x, k_y in 1/µm.
    pub bloch: [f64; 2],
}

impl Numerics {
    /// Ω = (2/dt) sin(ω dt/2): what the leapfrog makes of ω.
    pub fn leapfrog_omega(&self) -> f64 {
        2.0 / self.dt_um * (0.5 * self.omega * self.dt_um).sin()
    }

    /// (2/dt) tan(ω dt/2): where the stepper takes conductivities and poles ([`super::Medium::stepped_epsilon`]).
    pub fn trapezoid_omega(&self) -> f64 {
        2.0 / self.dt_um * (0.5 * self.omega * self.dt_um).tan()
    }

    /// K_x, K_y.
    pub fn transverse(&self) -> [f64; 2] {
        [0, 1].map(|a| 2.0 / self.stepped_um[a] * (0.5 * self.bloch[a] * self.lateral_um[a]).sin())
    }

    /// ε′ of a medium of index `n` in layers of `dz_um`.
    pub fn permittivity(&self, n: C, dz_um: f64) -> C {
        let k2: f64 = self.bloch.iter().map(|k| k * k).sum();
        let kz = (n * n * (self.omega * self.omega) - k2).sqrt();
        let along = 2.0 / dz_um * (0.5 * kz * dz_um).sin();
        let across: f64 = self.transverse().iter().map(|k| k * k).sum();
        (along * along + across) / self.leapfrog_omega().powi(2)
    }

    /// K_z and the phase k_z d_z / 2 of half a layer, for ε′.
    pub fn along_z(&self, epsilon: C, dz_um: f64) -> (C, C) {
        let across: f64 = self.transverse().iter().map(|k| k * k).sum();
        let along = (epsilon * self.leapfrog_omega().powi(2) - across).sqrt();
        (along, (0.5 * dz_um * along).asin())
    }
}

/// a = √sinc(k d_z) for layers of which `cells` make one wavelength in the medium.
pub(super) fn stretch(cells: f64) -> f64 {
    let kd = 2.0 * std::f64::consts::PI / cells;
    (kd.sin() / kd).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wavenumber_along_z_is_the_wanted_one() {
        let grid = Numerics {
            omega: 11.424,
            dt_um: 0.015,
            lateral_um: [0.032, 0.025],
            stepped_um: [0.033, 0.026],
            bloch: [5.0, -3.0],
        };
        for n in [C::new(1.0, 0.0), C::new(1.6, 0.005), C::new(4.077, 0.028)] {
            let dz = 0.55 / n.re / 11.0;
            let (_, half) = grid.along_z(grid.permittivity(n, dz), dz);
            let kz = (n * n * 11.424f64.powi(2) - 34.0).sqrt();
            assert!((2.0 * half / dz - kz).norm() < 1e-10, "{n}");
        }
    }

    /// Tilted by up to 20° a wave in any medium has its k_z to 2e-3 of k − k_z, where a plain grid of 11 cells has it to 6 %.
    #[test]
    fn oblique_light_drifts_as_far_as_it_should() {
        let (omega, cells) = (11.424, 11.0);
        for n in [1.0, 1.56, 4.077] {
            let k = n * omega;
            let dz = 2.0 * std::f64::consts::PI / k / cells;
            let straight = Numerics {
                omega,
                dt_um: 0.01,
                lateral_um: [0.4 * dz; 2],
                stepped_um: [0.4 * dz / stretch(cells); 2],
                bloch: [0.0; 2],
            };
            let epsilon = straight.permittivity(C::new(n, 0.0), dz);
            let tilted = Numerics {
                bloch: [k * 0.05, 0.0],
                ..straight
            };
            let kz = (2.0 / dz * tilted.along_z(epsilon, dz).1).re;
            let exact = k - (k * k - (0.05 * k).powi(2)).sqrt();
            assert!(((k - kz) / exact - 1.0).abs() < 2e-3, "{n}");
        }
    }
}
