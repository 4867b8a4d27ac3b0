//! Where the light of a place in the pupil lands, for a point out of focus: a stand-in for a lens whose prescription is
//! not known, by the transverse aberrations of a rotationally symmetric system: those of third and of fifth order, but
//! for distortion (W. T. Welford, Aberrations of Optical Systems (1986), ch. 8), on a sensor that may stand askew. All
//! are gradients over the pupil of one wavefront.
//!
//! With ρ in the unit disk of the pupil and h the field over a unit, in px:
//!
//! ```text
//! ε = (B + T·h + F h² + F₄ h⁴) ρ                            defocus, tilt of the sensor, field curvature
//!   + (S ρ² + S₅ ρ⁴ + S_h h² ρ²) ρ                          spherical
//!   + (C + C_h h²) (2 (ρ·h) ρ + ρ² h)                       coma
//!   + C_ρ ρ² (4 (ρ·h) ρ + ρ² h)                             coma of the aperture's fifth power
//!   + (A + A_h h²) (ρ·h) h + E (ρ·h)² h                     astigmatism, elliptical coma
//!   + O ((ρ·h)² ρ + ρ² (ρ·h) h)                             oblique spherical, its astigmatic part
//! ```
//! The disk's light is denser where the mapping is slower: that, and no loss of light, makes one side brighter.

use super::parameters::Name;

/// The coefficients at one field.
#[derive(Clone, Copy, Debug)]
pub struct LensLaw {
    field: [f64; 2],
    radial: [f64; 3],
    coma: [f64; 2],
    astigmatism: f64,
    elliptical: f64,
    oblique: f64,
}

impl LensLaw {
    /// Of the values of all parameters, at a place of the sensor; `unit_mm`: the field at which h is 1.
    pub fn new(values: &[f64], field_mm: [f64; 2], unit_mm: f64) -> Self {
        let v = |name: Name| values[name as usize];
        let hx = (field_mm[0] - v(Name::CentreXMm)) / unit_mm;
        let hy = (field_mm[1] - v(Name::CentreYMm)) / unit_mm;
        let h2 = hx * hx + hy * hy;
        Self {
            field: [hx, hy],
            radial: [
                v(Name::DefocusPx)
                    + v(Name::TiltXPx) * hx
                    + v(Name::TiltYPx) * hy
                    + h2 * (v(Name::FieldPx) + v(Name::Field4Px) * h2),
                v(Name::SphericalPx) + v(Name::SphericalFieldPx) * h2,
                v(Name::Spherical5Px),
            ],
            coma: [
                v(Name::ComaPx) + v(Name::ComaFieldPx) * h2,
                v(Name::ComaAperturePx),
            ],
            astigmatism: v(Name::AstigmatismPx) + v(Name::AstigmatismFieldPx) * h2,
            elliptical: v(Name::EllipticalComaPx),
            oblique: v(Name::ObliqueSphericalPx),
        }
    }

    /// The same of a point at another distance, whose disk has this radius in the middle of the picture, px.
    #[must_use]
    pub fn defocused(mut self, values: &[f64], radius_px: f64) -> Self {
        self.radial[0] += radius_px - values[Name::DefocusPx as usize];
        self
    }

    /// Where the light of a place of the unit disk lands, px from the chief ray.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [hx, hy] = self.field;
        let r2 = x * x + y * y;
        let along = x * hx + y * hy;
        let coma = self.coma[0] + 2.0 * r2 * self.coma[1];
        let radial = self.radial[0]
            + r2 * (self.radial[1] + r2 * self.radial[2])
            + along * (2.0 * coma + along * self.oblique);
        let far = along * (self.astigmatism + along * self.elliptical + r2 * self.oblique)
            + r2 * (self.coma[0] + r2 * self.coma[1]);
        [(x, hx), (y, hy)].map(|(p, h)| radial * p + far * h)
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::COUNT;
    use super::*;

    fn law(set: &[(Name, f64)], field_mm: [f64; 2]) -> LensLaw {
        let mut values = [0.0; COUNT];
        for &(name, value) in set {
            values[name as usize] = value;
        }
        LensLaw::new(&values, field_mm, 2.8)
    }

    #[test]
    fn coma_sends_a_ring_of_the_pupil_to_a_ring_that_is_run_through_twice() {
        // Seidel's figure: radius C h r², centre 2 C h r² from the chief ray, twice the pupil's azimuth.
        let law = law(&[(Name::ComaPx, 3.0)], [2.8, 0.0]);
        for k in 0..12 {
            let (sin, cos) = (0.5 * f64::from(k)).sin_cos();
            let r = 0.7;
            let [x, y] = law.at([r * cos, r * sin]);
            let radius = 3.0 * r * r;
            assert!((x - 2.0 * radius - radius * (f64::from(k)).cos()).abs() < 1e-12);
            assert!((y - radius * (f64::from(k)).sin()).abs() < 1e-12);
        }
    }

    #[test]
    fn the_rays_of_all_terms_belong_to_one_wavefront() {
        // ∂ε_x/∂y = ∂ε_y/∂x wherever ε is a gradient.
        let terms =
            (0..COUNT).filter(|i| (Name::DefocusPx as usize..=Name::TiltYPx as usize).contains(i));
        for term in terms {
            let mut values = [0.0; COUNT];
            values[term] = 3.0;
            let law = LensLaw::new(&values, [1.9, -0.8], 2.8);
            let (d, [x, y]) = (1e-5, [0.5, 0.3]);
            let slope = |axis: usize, to: [f64; 2]| {
                let [a, b] = [1.0, -1.0].map(|s| law.at([x + s * to[0], y + s * to[1]])[axis]);
                (a - b) / (2.0 * d)
            };
            let [across, down] = [slope(0, [0.0, d]), slope(1, [d, 0.0])];
            assert!((across - down).abs() < 1e-6, "{term}: {across} {down}");
        }
    }

    #[test]
    fn defocus_alone_is_a_disk_everywhere() {
        let law = law(&[(Name::DefocusPx, 10.0)], [1.0, -0.5]);
        let [x, y] = law.at([0.6, -0.8]);
        assert!((x.hypot(y) - 10.0).abs() < 1e-12);
    }
}
