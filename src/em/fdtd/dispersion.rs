//! The lateral differences and the permittivity that make the wavenumber along z right on the grid.
//!
//! On the grid a plane wave obeys K_x² + K_y² + K_z² = ε′ Ω², K_z = (2/dz) sin(k_z dz/2), Ω = (2/dt) sin(ω dt/2)
//! (Taflove & Hagness, Computational Electrodynamics, ch. 4), K_x the symbol of the lateral difference. For the wanted
//! k_x, k_y and k_z = √(n²ω² − k_x² − k_y²) this gives ε′.
//!
//! Directions: with Yee's own differences the grid bends k_z(k_x) too much, and oblique light drifts sideways. Two
//! weights, of near and far nodes ([`stencil`]), mend it: K_z² loses k_z⁴dz²/12, so a wave along z needs another ε′,
//! and of what is then missing for oblique waves, K_x² = k_x² (1 − k²dz²/6) + k_x⁴ dz²/12, the near nodes alone give
//! the first term. In a lens, where the resin and the air beside it share the layers, the weights are the best for
//! both. Through trenches and walls no far nodes are used: fields have kinks there.
//!
//! Interfaces: with tangential E on the interface the grid sees, for s, the admittances sin(k_z d_z)/d_z on both sides.
//! Their ratio is right if k_z d_z is equal on both: layers of equal optical thickness. The node on the interface is
//! then exact with (ε′₁ d₁ + ε′₂ d₂)/(d₁ + d₂), and the same mean of the weights.

use rustfft::num_complex::Complex64;

use super::Stencil;

type C = Complex64;

/// What the grid makes of one frequency and transverse wavevector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Numerics {
    /// Angular frequency ω in 1/µm.
    pub omega: f64,
    pub dt_um: f64,
    /// dx, dy in µm.
    pub lateral_um: [f64; 2],
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

    /// K_x, K_y where these are the lateral differences.
    pub fn transverse(&self, stencils: [Stencil; 2]) -> [f64; 2] {
        [0, 1].map(|a| stencils[a].symbol(self.bloch[a], self.lateral_um[a]))
    }

    fn across(&self, stencils: [Stencil; 2]) -> f64 {
        self.transverse(stencils).iter().map(|k| k * k).sum()
    }

    /// ε′ of a medium of index `n` in such layers.
    pub fn permittivity(&self, n: C, layers: &Layers) -> C {
        let k2: f64 = self.bloch.iter().map(|k| k * k).sum();
        let kz = (n * n * (self.omega * self.omega) - k2).sqrt();
        let along = 2.0 / layers.dz_um * (0.5 * kz * layers.dz_um).sin();
        (along * along + self.across(layers.stencils)) / self.leapfrog_omega().powi(2)
    }

    /// K_z and the phase k_z d_z / 2 of half a layer, for ε′.
    pub fn along_z(&self, epsilon: C, layers: &Layers) -> (C, C) {
        let along = (epsilon * self.leapfrog_omega().powi(2) - self.across(layers.stencils)).sqrt();
        (along, (0.5 * layers.dz_um * along).asin())
    }
}

/// Layers of one thickness and one pair of lateral differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layers {
    pub dz_um: f64,
    /// Along x, along y.
    pub stencils: [Stencil; 2],
}

/// k_x/k0 of the steepest light that is followed: 0.83 n, which is what a lens of half the diagonal's radius makes of
/// light at 40°, and in silicon no more than the layers above let through.
fn steepest(n: f64) -> f64 {
    (0.83 * n).min(1.3)
}

/// Most of the far nodes' part in the slope, |3 far d|: more would let only smaller time steps be stable. It binds
/// where cells are much narrower than layers are thick, and then little is to be mended.
const MOST_FAR: f64 = 0.4;

/// The weights of a difference between nodes `step_um` apart, in layers of `dz_um`, at wavenumber `k0`: of those with
/// the least error of k_z, in these media, at two inclinations. `wide`: with far nodes.
pub(super) fn stencil(media: &[f64], k0: f64, dz_um: f64, step_um: f64, wide: bool) -> Stencil {
    let sine = |kx: f64| (0.5 * kx * step_um).sin();
    let unit = sine(k0 * media.iter().copied().map(steepest).fold(0.0, f64::max));
    // K = 2 (near + 3 far) s − 8 far s³ with s = sin(kd/2), as a t + b t³ with t = s / unit: normal equations of weight
    // × (K − a t − b t³).
    let (mut m, mut r) = ([0.0; 3], [0.0; 2]);
    for n in media {
        let half = |kz: f64| 2.0 / dz_um * (0.5 * kz * dz_um).sin();
        for tilt in [0.46, 1.0] {
            let kx = k0 * steepest(*n) * tilt;
            let along = half(((n * k0).powi(2) - kx * kx).sqrt());
            let wanted = (half(n * k0).powi(2) - along * along).max(0.0).sqrt();
            // dk_z = K dK / k_z.
            let weight = wanted / along;
            let t = sine(kx) / unit;
            let (one, three) = (weight * t, weight * t.powi(3));
            for (sum, term) in m.iter_mut().zip([one * one, one * three, three * three]) {
                *sum += term;
            }
            r[0] += one * weight * wanted;
            r[1] += three * weight * wanted;
        }
    }
    let far = if wide {
        let b = (m[0] * r[1] - m[1] * r[0]) / (m[0] * m[2] - m[1] * m[1]);
        let most = MOST_FAR / (3.0 * step_um);
        (-b / (8.0 * unit.powi(3))).clamp(-most, most)
    } else {
        0.0
    };
    let b = -8.0 * far * unit.powi(3);
    let a = (r[0] - m[1] * b) / m[0];
    Stencil {
        near: a / (2.0 * unit) - 3.0 * far,
        far,
    }
}

/// The differences on a plane between two kinds of layers: the mean by thickness, without far nodes if one side has
/// none.
pub(super) fn between(a: &Layers, b: &Layers) -> [Stencil; 2] {
    [0, 1].map(|axis| {
        let (p, q) = (a.stencils[axis], b.stencils[axis]);
        let mean = |x: f64, y: f64| (x * a.dz_um + y * b.dz_um) / (a.dz_um + b.dz_um);
        let mean = Stencil {
            near: mean(p.near, q.near),
            far: mean(p.far, q.far),
        };
        if p.far != 0.0 && q.far != 0.0 {
            return mean;
        }
        // Long waves see near + 3 far.
        Stencil {
            near: mean.near + 3.0 * mean.far,
            far: 0.0,
        }
    })
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
            bloch: [5.0, -3.0],
        };
        for n in [C::new(1.0, 0.0), C::new(1.6, 0.005), C::new(4.077, 0.028)] {
            let dz_um = 0.55 / n.re / 11.0;
            let stencils = grid
                .lateral_um
                .map(|d| stencil(&[n.re], 11.424, dz_um, d, true));
            let layers = Layers { dz_um, stencils };
            let (_, half) = grid.along_z(grid.permittivity(n, &layers), &layers);
            let kz = (n * n * 11.424f64.powi(2) - 34.0).sqrt();
            assert!((2.0 * half / dz_um - kz).norm() < 1e-10, "{n}");
        }
    }

    /// The largest error of k_z in rad/µm up to the steepest light, the axis being exact.
    fn worst(n: f64, cells: f64, d: f64, stencil: Stencil) -> f64 {
        let omega = 11.424;
        let dz_um = 2.0 * std::f64::consts::PI / (n * omega) / cells;
        let layers = Layers {
            dz_um,
            stencils: [stencil; 2],
        };
        let at = |kx| Numerics {
            omega,
            dt_um: 0.01,
            lateral_um: [d; 2],
            bloch: [kx, 0.0],
        };
        let epsilon = at(0.0).permittivity(C::new(n, 0.0), &layers);
        let tilts = (1..=20).map(|i| omega * steepest(n) * f64::from(i) / 20.0);
        tilts
            .map(|kx| {
                let kz = 2.0 / dz_um * at(kx).along_z(epsilon, &layers).1.re;
                (kz - ((n * omega).powi(2) - kx * kx).sqrt()).abs()
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn oblique_light_keeps_its_phase_in_the_resin_on_a_draft_mesh() {
        // 2 µm of it: bound 0.01 rad/µm. Yee's differences and one scaled difference are both off by more than ten
        // times that.
        let (n, cells, d) = (1.56, 8.0, 0.04);
        let dz_um = 0.55 / n / cells;
        let by = |wide| worst(n, cells, d, stencil(&[n], 11.424, dz_um, d, wide));
        assert!(by(true) < 0.01, "{}", by(true));
        assert!(by(false) > 0.1, "{}", by(false));
        assert!(worst(n, cells, d, Stencil::yee(d)) > 0.1);
    }

    #[test]
    fn weights_tend_to_those_of_fourth_order_as_cells_shrink() {
        // Layers much thinner than the cells are wide: near 27/24, far −1/24 (Fang 1989).
        let s = stencil(&[1.5], 0.1, 1e-4, 0.01, true);
        assert!((s.near * 0.01 - 27.0 / 24.0).abs() < 1e-3, "{s:?}");
        assert!((s.far * 0.01 + 1.0 / 24.0).abs() < 1e-3, "{s:?}");
    }
}
