//! The flat layers between lens and silicon, one plane-wave order at a time (transfer matrix, as scattering amplitudes).
//!
//! Amplitudes φ carry their power: |φ|² is the flux of a travelling order. At an interface with the s and p Fresnel
//! coefficients r_s, r_p (of the tangential E field) the order reflects the mean power of both,
//! `r = r_s / |r_s| √((|r_s|² + |r_p|²) / 2)`, `t = √(1 − r²)` (which is exact for s, and conserves power). An order that is
//! evanescent on either side has no such mean and takes r_s.

use rustfft::num_complex::Complex64;

use crate::em::stack::Indices;

type C = Complex64;

/// z component of the wavevector for transverse k⊥² in a medium n; Im ≥ 0.
pub(super) fn kz(n: C, k0: f64, k_perp_squared: f64) -> C {
    let k = (n * n * (k0 * k0) - k_perp_squared).sqrt();
    if k.im < 0.0 { -k } else { k }
}

/// Reflection amplitude from medium `a` onto medium `b`, mean of s and p power.
pub(super) fn reflection(na: C, nb: C, k0: f64, k_perp_squared: f64) -> C {
    let (ka, kb) = (kz(na, k0, k_perp_squared), kz(nb, k0, k_perp_squared));
    let rs = (ka - kb) / (ka + kb);
    let travelling = k_perp_squared < (na.re.min(nb.re) * k0).powi(2);
    if !travelling || rs.norm() < 1e-12 {
        return rs;
    }
    let (ea, eb) = (na * na, nb * nb);
    let rp = (ea * kb - eb * ka) / (ea * kb + eb * ka);
    rs / rs.norm() * (0.5 * (rs.norm_sqr() + rp.norm_sqr())).sqrt()
}

/// The layers from the resin under the lens to the oxide on the silicon, for one order: reflection seen from the top and from
/// the bottom, and transmission (the same both ways).
#[derive(Clone, Copy, Debug)]
pub(super) struct Layers {
    pub top: C,
    pub through: C,
    pub bottom: C,
}

impl Layers {
    /// Resin of `resin_um`, filter, oxide.
    pub fn new(
        n: &Indices,
        resin_um: f64,
        filter_um: f64,
        oxide_um: f64,
        k0: f64,
        k_perp_squared: f64,
    ) -> Self {
        let phase = |n: C, d: f64| (C::I * kz(n, k0, k_perp_squared) * d).exp();
        let mut s = Self {
            top: C::ZERO,
            through: phase(n.resin, resin_um),
            bottom: C::ZERO,
        };
        for (a, b, d) in [
            (n.resin, n.filter, filter_um),
            (n.filter, n.oxide, oxide_um),
        ] {
            s = s.then(reflection(a, b, k0, k_perp_squared), phase(b, d));
        }
        s
    }

    /// Adds an interface of reflection `r` and the layer below it, of one-way phase `e`.
    fn then(self, r: C, e: C) -> Self {
        let t2 = C::ONE - r * r;
        let loops = C::ONE / (C::ONE - self.bottom * r);
        Self {
            top: self.top + self.through * self.through * r * loops,
            through: self.through * t2.sqrt() * loops * e,
            bottom: e * e * (-r + t2 * self.bottom * loops),
        }
    }
}
