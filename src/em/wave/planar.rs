//! The flat layers between lens and silicon, one plane-wave order at a time (transfer matrix, as scattering
//! amplitudes).
//!
//! Amplitudes φ carry their power: |φ|² is the flux of a travelling order. At an interface with the s and p Fresnel
//! coefficients r_s, r_p (of the tangential E field) the order reflects the mean power of both,
//! `r = r_s / |r_s| √((|r_s|² + |r_p|²) / 2)`, `t = √(1 − r²)` (which is exact for s, and conserves power). An order
//! that is evanescent on either side has no such mean and takes r_s.

use rustfft::num_complex::Complex64;

use super::spectral::Order;
use crate::em::Indices;
use crate::em::PixelStack;

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

/// What lies flat between lens and silicon, from the top. Layers of no thickness are left out.
#[derive(Clone, Debug)]
pub(super) struct FlatLayers {
    /// Index of the lens.
    pub lens: C,
    /// The lens's pedestal and the layers of its index right below, µm.
    pub lens_um: f64,
    /// Index and thickness in µm of the others.
    pub below: Vec<(C, f64)>,
}

impl FlatLayers {
    pub fn new(stack: &PixelStack, n: &Indices) -> Self {
        let mut flat = Self {
            lens: n.lens,
            lens_um: 0.0,
            below: Vec::new(),
        };
        for (layer, &n) in stack.layers.iter().zip(&n.layers) {
            if flat.below.is_empty() && n == flat.lens {
                flat.lens_um += layer.thickness_um;
            } else if layer.thickness_um > 0.0 {
                flat.below.push((n, layer.thickness_um));
            }
        }
        flat.lens_um = flat.lens_um + stack.lens.height_um - stack.sag_um();
        flat
    }

    /// What lies below a plane in layer `filter`, `rest_um` above its lower end.
    pub fn below_plane(stack: &PixelStack, n: &Indices, filter: usize, rest_um: f64) -> Self {
        let layers = stack.layers.iter().zip(&n.layers).skip(filter + 1);
        Self {
            lens: n.layers[filter],
            lens_um: rest_um,
            below: layers
                .filter(|(layer, _)| layer.thickness_um > 0.0)
                .map(|(layer, &n)| (n, layer.thickness_um))
                .collect(),
        }
    }

    /// Index of what lies on the silicon.
    pub fn last(&self) -> C {
        self.below.last().map_or(self.lens, |l| l.0)
    }

    /// The largest index, real part.
    pub fn densest(&self) -> f64 {
        let below = self.below.iter().map(|l| l.0.re);
        below.fold(self.lens.re, f64::max)
    }
}

/// The flat layers for one order: reflection seen from the top and from the bottom, and transmission (the same both
/// ways).
#[derive(Clone, Copy, Debug)]
pub(super) struct Layers {
    pub top: C,
    pub through: C,
    pub bottom: C,
}

impl Layers {
    /// Those layers.
    pub fn new(layers: &FlatLayers, k0: f64, k_perp_squared: f64) -> Self {
        let phase = |n: C, d: f64| (C::I * kz(n, k0, k_perp_squared) * d).exp();
        let mut above = layers.lens;
        let mut s = Self {
            top: C::ZERO,
            through: phase(above, layers.lens_um),
            bottom: C::ZERO,
        };
        for &(n, d) in &layers.below {
            s = s.then(reflection(above, n, k0, k_perp_squared), phase(n, d));
            above = n;
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

/// ψ in a plane of a layer above silicon without trenches, of the power amplitude in the last layer that it brings down
/// there; its inverse brings ψ down.
pub(super) fn plane_per_last(flat: &FlatLayers, silicon: C, k0: f64, k_perp_squared: f64) -> C {
    let layers = Layers::new(flat, k0, k_perp_squared);
    let plain = reflection(flat.last(), silicon, k0, k_perp_squared);
    (1.0 - layers.bottom * plain) / (layers.through * kz(flat.lens, k0, k_perp_squared).sqrt())
}

/// The flat layers on plain silicon, for all orders. What the trenches send back beyond plain silicon enters as
/// `extra`, upward power amplitudes in the last layer at the silicon.
pub(super) struct FlatStack {
    layers: Vec<Layers>,
    /// What plain silicon reflects.
    plain: Vec<C>,
    /// √k_z in the lens's matter: ψ times this is a power amplitude.
    root: Vec<C>,
    /// What layers and silicon reflect, seen from the lens's lower end.
    pub seen: Vec<C>,
}

impl FlatStack {
    pub fn new(flat: &FlatLayers, silicon: C, k0: f64, orders: &[Order]) -> Self {
        let layers: Vec<Layers> = orders
            .iter()
            .map(|o| Layers::new(flat, k0, o.k_perp_squared))
            .collect();
        let plain: Vec<C> = orders
            .iter()
            .map(|o| reflection(flat.last(), silicon, k0, o.k_perp_squared))
            .collect();
        let seen = layers
            .iter()
            .zip(&plain)
            .map(|(l, &r)| l.top + l.through * l.through * r / (1.0 - l.bottom * r))
            .collect();
        let root = orders
            .iter()
            .map(|o| kz(flat.lens, k0, o.k_perp_squared).sqrt())
            .collect();
        Self {
            layers,
            plain,
            root,
            seen,
        }
    }

    /// Amplitudes ψ under the lens that `extra` sends up.
    pub fn rising(&self, extra: &[C]) -> Vec<C> {
        (0..extra.len())
            .map(|i| {
                let l = &self.layers[i];
                l.through * extra[i] / (1.0 - l.bottom * self.plain[i]) / self.root[i]
            })
            .collect()
    }

    /// From the field ψ under the lens: the power amplitudes that come down onto the silicon, and the net flux into the
    /// layers.
    pub fn descend(&self, psi: &[C], rising: &[C], extra: &[C]) -> (Vec<C>, f64) {
        let mut flux = 0.0;
        let down = (0..psi.len())
            .map(|i| {
                let (l, root) = (&self.layers[i], self.root[i]);
                let down = (psi[i] - rising[i]) / (1.0 + self.seen[i]);
                let up = psi[i] - down;
                // Im(ψ* ∂z ψ) of both waves, pairs of evanescent ones included.
                flux += (psi[i].conj() * (down - up) * root * root).re;
                (l.through * down * root + l.bottom * extra[i]) / (1.0 - l.bottom * self.plain[i])
            })
            .collect();
        (down, flux)
    }

    /// What `up` holds beyond the reflection of plain silicon.
    pub fn beyond_plain(&self, down: &[C], up: &[C]) -> Vec<C> {
        (0..up.len())
            .map(|i| up[i] - self.plain[i] * down[i])
            .collect()
    }
}
