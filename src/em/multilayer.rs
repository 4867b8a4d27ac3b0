//! A flat stack between two half spaces, exactly: reflected, transmitted and absorbed power of a plane wave at any
//! angle, s or p.
//!
//! The amplitude of tangential E and its admittance y (s: k_z/k0, p: n² k0/k_z) meet an interface from a to b with
//! r = (y_a − y_b)/(y_a + y_b), t = 1 + r (Born & Wolf, Principles of Optics, 1.6). Layers are added from the bottom:
//! ρ = (r + ρ_below e²)/(1 + r ρ_below e²), e = e^(i k_z d). Only decaying exponentials occur, so thick and absorbing
//! layers are safe. Time convention e^(−iωt).

use rustfft::num_complex::Complex64;

use super::StackError;
use super::stack::PixelStack;
use crate::units::um_from_nm;

type C = Complex64;

/// Which field stands across the plane of incidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarization {
    /// E across the plane of incidence.
    S,
    /// H across the plane of incidence.
    P,
}

/// Where the light goes, as parts of the incident power.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatPowers {
    /// Reflected.
    pub reflected: f64,
    /// Flux that enters each layer from above, and last the lower half space: the absorption of layer i is
    /// `entering[i] − entering[i + 1]`.
    pub entering: Vec<f64>,
}

impl FlatPowers {
    /// Flux into the lower half space.
    pub fn transmitted(&self) -> f64 {
        self.entering.last().copied().unwrap_or(0.0)
    }
}

/// A flat stack: indices of `above`, of the layers from the top (with thickness in µm) and of `below`.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatStack {
    /// The half space that the light comes from; its index is real.
    pub above: f64,
    /// Index and thickness in µm.
    pub layers: Vec<(C, f64)>,
    /// The half space below.
    pub below: C,
}

impl FlatStack {
    /// The pixel with its lens flattened at its mean height and no trenches or walls, its counted silicon as last
    /// layer, silicon below.
    ///
    /// # Errors
    /// A pixel out of range, one with a mosaic, or a material that does not know the wavelength.
    pub fn from_pixel(stack: &PixelStack, wavelength_nm: f64) -> Result<Self, StackError> {
        stack.check()?;
        if stack.mosaic.is_some() {
            let allowed = "none in a flat stack, which has one filter";
            return Err(StackError::value("mosaic", "there", allowed));
        }
        let n = stack.indices(wavelength_nm)?;
        let mut layers = vec![(n.lens, stack.mean_lens_height_um())];
        layers.extend(
            n.layers
                .iter()
                .zip(&stack.layers)
                .map(|(n, l)| (*n, l.thickness_um)),
        );
        layers.push((n.silicon, stack.silicon_um));
        Ok(Self {
            above: 1.0,
            layers,
            below: n.silicon,
        })
    }

    /// Powers at `wavelength_nm` for a wave of transverse wavenumber `sine` k0 (in air the sine of the angle; |`sine`|
    /// < `above`).
    ///
    /// # Errors
    /// A wave that does not travel in the upper half space, or a wavelength that is not positive.
    pub fn solve(
        &self,
        wavelength_nm: f64,
        sine: f64,
        polarization: Polarization,
    ) -> Result<FlatPowers, StackError> {
        if !(sine.abs() < self.above && wavelength_nm > 0.0 && wavelength_nm.is_finite()) {
            return Err(StackError::value(
                "(wavelength_nm, sine)",
                format!("({wavelength_nm}, {sine})"),
                "a positive wavelength, |sine| below the index of the upper half space",
            ));
        }
        let k0 = 2.0 * std::f64::consts::PI / um_from_nm(wavelength_nm);
        let media: Vec<(C, f64)> = std::iter::once((C::new(self.above, 0.0), 0.0))
            .chain(self.layers.iter().copied())
            .chain(std::iter::once((self.below, 0.0)))
            .collect();
        let cosines: Vec<C> = media.iter().map(|(n, _)| normal_part(*n, sine)).collect();
        let y: Vec<C> = media
            .iter()
            .zip(&cosines)
            .map(|((n, _), c)| match polarization {
                Polarization::S => *c,
                Polarization::P => n * n / c,
            })
            .collect();
        // Phase through medium i, and ρ at its bottom.
        let phase = |i: usize| (C::I * cosines[i] * k0 * media[i].1).exp();
        let last = media.len() - 1;
        let mut rho = vec![C::ZERO; last + 1];
        for i in (0..last).rev() {
            let e = phase(i + 1);
            let below = rho[i + 1] * e * e;
            let r = (y[i] - y[i + 1]) / (y[i] + y[i + 1]);
            rho[i] = (r + below) / (C::ONE + r * below);
        }
        // Downward tangential E at the top of medium i+1 follows from that at the bottom of medium i.
        let incident = y[0].re;
        let mut down = C::ONE;
        let mut entering = Vec::with_capacity(last);
        for i in 0..last {
            let e = phase(i + 1);
            let total = down * (C::ONE + rho[i]);
            let flux = total.conj() * y[i] * down * (C::ONE - rho[i]);
            entering.push(flux.re / incident);
            down = total / (C::ONE + rho[i + 1] * e * e) * e;
        }
        Ok(FlatPowers {
            reflected: rho[0].norm_sqr(),
            entering,
        })
    }
}

/// k_z / k0 with Im ≥ 0.
fn normal_part(n: C, sine: f64) -> C {
    let c = (n * n - sine * sine).sqrt();
    if c.im < 0.0 { -c } else { c }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn stack(layers: &[(f64, f64, f64)], below: C) -> FlatStack {
        FlatStack {
            above: 1.0,
            layers: layers
                .iter()
                .map(|(n, k, d)| (C::new(*n, *k), *d))
                .collect(),
            below,
        }
    }

    #[test]
    fn one_interface_is_fresnels() {
        let n = 1.5;
        for deg in [0.0f64, 30.0, 70.0] {
            let (s, c) = deg.to_radians().sin_cos();
            let inside = (1.0 - (s / n) * (s / n)).sqrt();
            let rs = (c - n * inside) / (c + n * inside);
            let rp = (n * c - inside) / (n * c + inside);
            let one = stack(&[], C::new(n, 0.0));
            for (p, r) in [(Polarization::S, rs), (Polarization::P, rp)] {
                let f = one.solve(550.0, s, p).unwrap();
                assert!((f.reflected - r * r).abs() < 1e-14);
                assert!((f.transmitted() - (1.0 - r * r)).abs() < 1e-14);
            }
        }
        // No p light is reflected at Brewster's angle.
        let brewster = (n.atan()).sin();
        let f = stack(&[], C::new(n, 0.0)).solve(550.0, brewster, Polarization::P);
        assert!(f.unwrap().reflected < 1e-30);
    }

    #[test]
    fn a_quarter_wave_of_the_geometric_mean_reflects_nothing() {
        let quarter = 0.55 / 4.0 / 2.0;
        let f = stack(&[(2.0, 0.0, quarter)], C::new(4.0, 0.0));
        let f = f.solve(550.0, 0.0, Polarization::S).unwrap();
        assert!(f.reflected < 1e-30 && (f.transmitted() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_thick_absorber_follows_beers_law_and_energy_is_kept() {
        // In matched media nothing is reflected but at order k².
        let (k, d) = (1e-4, 20.0);
        let f = stack(&[(1.0, k, d)], C::ONE);
        let f = f.solve(550.0, 0.0, Polarization::P).unwrap();
        let beer = (-4.0 * std::f64::consts::PI * k * d / 0.55).exp();
        assert!((f.transmitted() - beer).abs() < 1e-7);
        // A metal a hundred skin depths thick neither overflows nor lets light through.
        let metal = stack(&[(0.2, 3.0, 30.0), (1.5, 0.0, 0.0)], C::ONE);
        for p in [Polarization::S, Polarization::P] {
            let f = metal.solve(550.0, 0.9, p).unwrap();
            assert!((f.reflected + f.entering[0] - 1.0).abs() < 1e-12);
            assert!(f.entering.windows(2).all(|w| w[1] <= w[0] + 1e-15));
            assert!(f.transmitted() < 1e-100);
        }
    }

    #[test]
    fn a_layer_of_no_thickness_changes_nothing() {
        let with = stack(&[(1.5, 0.0, 0.3), (2.2, 0.1, 0.0)], C::new(4.0, 0.03));
        let without = stack(&[(1.5, 0.0, 0.3)], C::new(4.0, 0.03));
        for p in [Polarization::S, Polarization::P] {
            let (a, b) = (with.solve(550.0, 0.6, p), without.solve(550.0, 0.6, p));
            let (a, b) = (a.unwrap(), b.unwrap());
            assert!((a.reflected - b.reflected).abs() < 1e-14);
        }
    }

    /// `exact` columns (R_tmm, A_si_tmm, A_cf_tmm) of an independent transfer matrix, printed to 1e-5: air | resin
    /// 0.5 | filter 0.75, k 0.01 and 0.005 | SiO2 0.65 | Si, 4 µm counted; 550 nm.
    #[test]
    fn the_pixels_layers_are_those_of_an_independent_transfer_matrix() {
        let rows = [
            (0.0, Polarization::S, 0.01, [0.14583, 0.59895, 0.20482]),
            (20.0, Polarization::S, 0.01, [0.07623, 0.64297, 0.22723]),
            (20.0, Polarization::P, 0.01, [0.07563, 0.65072, 0.21942]),
            (0.0, Polarization::P, 0.005, [0.17554, 0.65927, 0.10971]),
            (20.0, Polarization::S, 0.005, [0.10145, 0.71586, 0.12304]),
            (20.0, Polarization::P, 0.005, [0.09985, 0.72179, 0.11823]),
        ];
        for (deg, p, k, [r, si, filter]) in rows {
            let oxide = 1.45991;
            let silicon = C::new(4.077, 0.027968);
            let f = FlatStack {
                above: 1.0,
                layers: vec![
                    (C::new(1.56, 0.0), 0.5),
                    (C::new(1.6, k), 0.75),
                    (C::new(oxide, 0.0), 0.65),
                    (silicon, 4.0),
                ],
                below: silicon,
            };
            let sine = f64::to_radians(deg).sin();
            let f = f.solve(550.0, sine, p).unwrap();
            let got = [
                f.reflected,
                f.entering[3] - f.entering[4],
                f.entering[1] - f.entering[2],
            ];
            for (got, want) in got.iter().zip([r, si, filter]) {
                assert!((got - want).abs() < 2e-5, "{deg} {p:?}: {got} {want}");
            }
        }
    }
}
