//! Refractive index against wavelength.
//!
//! From the index n_d at the d line and the Abbe number V_d, by Cauchy's two terms fitted so that both are met:
//!
//! ```text
//! n(λ) = A + B/λ²     B = (n_d − 1) / V_d / (1/λ_F² − 1/λ_C²)     A = n_d − B/λ_d²
//! ```
//!
//! or, where its coefficients are given, by Sellmeier's three terms (λ in µm, B_i without unit, C_i in µm²; Born &
//! Wolf, Principles of Optics, section 2.3.4):
//!
//! ```text
//! n² = 1 + Σ B_i λ² / (λ² − C_i)
//! ```
//!
//! Indices are relative to air, as glass catalogues and lens files state them, and air itself counts as 1.

use super::error::LensError;
use crate::range::within;
use crate::units::{C_LINE_NM, D_LINE_NM, F_LINE_NM};

/// Shortest and longest wavelength at which a lens is asked for, nm: silicon's range, well inside that of the fits.
pub const WAVELENGTH_RANGE_NM: (f64, f64) = (350.0, 1100.0);

/// A glass.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub enum Glass {
    /// The same index everywhere: the file gives no Abbe number.
    Constant {
        /// Refractive index.
        n: f64,
    },
    /// Cauchy's two terms.
    Cauchy {
        /// A.
        a: f64,
        /// B, µm².
        b_um2: f64,
    },
    /// Sellmeier's three terms.
    Sellmeier {
        /// B_1, B_2, B_3.
        b: [f64; 3],
        /// C_1, C_2, C_3, µm².
        c_um2: [f64; 3],
    },
}

/// 1/λ² in 1/µm² of a wavelength in nm.
fn inverse_square_um(wavelength_nm: f64) -> f64 {
    1e6 / (wavelength_nm * wavelength_nm)
}

impl Glass {
    /// The glass with index `nd` at the d line and Abbe number `vd`; constant where `vd` is not known.
    pub fn from_nd_vd(nd: f64, vd: Option<f64>) -> Glass {
        match vd {
            None => Glass::Constant { n: nd },
            Some(vd) => {
                let spread = inverse_square_um(F_LINE_NM) - inverse_square_um(C_LINE_NM);
                let b_um2 = (nd - 1.0) / vd / spread;
                Glass::Cauchy {
                    a: nd - b_um2 * inverse_square_um(D_LINE_NM),
                    b_um2,
                }
            }
        }
    }

    /// Refractive index at a wavelength in nm. A Sellmeier fit gives NaN inside one of its own absorption bands.
    pub fn index(&self, wavelength_nm: f64) -> f64 {
        match self {
            Glass::Constant { n } => *n,
            Glass::Cauchy { a, b_um2 } => a + b_um2 * inverse_square_um(wavelength_nm),
            Glass::Sellmeier { b, c_um2 } => {
                let l2 = 1.0 / inverse_square_um(wavelength_nm);
                let sum: f64 = (0..3).map(|i| b[i] * l2 / (l2 - c_um2[i])).sum();
                (1.0 + sum).sqrt()
            }
        }
    }

    /// The glass with another index at the d line, by `difference`: Sellmeier's strengths B all scaled alike, else the
    /// same difference at every wavelength.
    pub fn with_index_deviation(&self, difference: f64) -> Glass {
        match *self {
            Glass::Constant { n } => Glass::Constant { n: n + difference },
            Glass::Cauchy { a, b_um2 } => Glass::Cauchy {
                a: a + difference,
                b_um2,
            },
            Glass::Sellmeier { b, c_um2 } => {
                let nd = self.index(D_LINE_NM);
                let scale = ((nd + difference).powi(2) - 1.0) / (nd * nd - 1.0);
                Glass::Sellmeier {
                    b: b.map(|b| b * scale),
                    c_um2,
                }
            }
        }
    }

    /// Whether the index depends on the wavelength.
    pub fn is_dispersive(&self) -> bool {
        !matches!(self, Glass::Constant { .. })
    }

    /// Index at the d line and Abbe number (n_d − 1)/(n_F − n_C); infinite without dispersion.
    pub fn nd_vd(&self) -> (f64, f64) {
        let nd = self.index(D_LINE_NM);
        (
            nd,
            (nd - 1.0) / (self.index(F_LINE_NM) - self.index(C_LINE_NM)),
        )
    }
}

/// The wavelength, if it is one at which a lens can be asked for.
///
/// # Errors
/// [`LensError::Value`] outside [`WAVELENGTH_RANGE_NM`].
pub(crate) fn checked_wavelength(lens: &str, wavelength_nm: f64) -> Result<f64, LensError> {
    let (low, high) = WAVELENGTH_RANGE_NM;
    within(lens.to_owned(), "wavelength_nm", wavelength_nm, low..=high)?;
    Ok(wavelength_nm)
}

/// The glasses of SCHOTT's catalogue that lens files here ask for by name, with the catalogue's Sellmeier coefficients
/// (B_1, B_2, B_3, then C_1, C_2, C_3 in µm²; SCHOTT, Optical Glass data sheets). A test holds each to the data sheet's
/// printed n_d and V_d.
#[rustfmt::skip]
const CATALOGUE: &[(&str, [f64; 3], [f64; 3])] = &[
    ("N-BK7",    [1.03961212,  0.231792344, 1.01046945],  [0.00600069867, 0.0200179144, 103.560653]),
    ("N-SK2",    [1.28189012,  0.257738258, 0.96818604],  [0.0072719164,  0.0242823527, 110.377773]),
    ("N-SK16",   [1.34317774,  0.241144399, 0.994317969], [0.00704687339, 0.0229005,    92.7508526]),
    ("N-SSK2",   [1.4306027,   0.153150554, 1.01390904],  [0.00823982975, 0.0333736841, 106.870822]),
    ("F2",       [1.34533359,  0.209073176, 0.937357162], [0.00997743871, 0.0470450767, 111.886764]),
    ("F5",       [1.3104463,   0.19603426,  0.96612977],  [0.00958633048, 0.0457627627, 115.011883]),
    ("SF5",      [1.46141885,  0.247713019, 0.949995832], [0.0111826126,  0.0508594669, 112.041888]),
    ("SF6",      [1.72448482,  0.390104889, 1.04572858],  [0.0134871947,  0.0569318095, 118.557185]),
    ("N-SF5",    [1.52481889,  0.187085527, 1.42729015],  [0.011254756,   0.0588995392, 129.141675]),
    ("N-SF6",    [1.77931763,  0.338149866, 2.08734474],  [0.0133714182,  0.0617533621, 174.01759]),
    ("N-SF11",   [1.73759695,  0.313747346, 1.89878101],  [0.013188707,   0.0623068142, 155.23629]),
    ("N-BAF10",  [1.5851495,   0.143559385, 1.08521269],  [0.00926681282, 0.0424489805, 105.613573]),
    ("N-LAK10",  [1.72878017,  0.169257825, 1.19386956],  [0.00886014635, 0.0363416509, 82.9009069]),
    ("N-LASF41", [1.86348331,  0.413307255, 1.35784815],  [0.00910368219, 0.0339247268, 93.3580595]),
    ("N-LASF43", [1.93502827,  0.23662935,  1.26291344],  [0.0104001413,  0.0447505292, 87.437569]),
];

/// A glass of the catalogue by its name.
pub fn catalogue_glass(name: &str) -> Option<Glass> {
    CATALOGUE
        .iter()
        .find(|(known, ..)| known.eq_ignore_ascii_case(name))
        .map(|&(_, b, c_um2)| Glass::Sellmeier { b, c_um2 })
}

/// The names in the catalogue.
pub fn catalogue_names() -> impl Iterator<Item = &'static str> {
    CATALOGUE.iter().map(|(name, ..)| *name)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn cauchy_fit_meets_index_and_abbe_number() {
        let (nd, vd) = Glass::from_nd_vd(1.544, Some(55.9)).nd_vd();
        assert!((nd - 1.544).abs() < 1e-12 && (vd - 55.9).abs() < 1e-9);
    }

    #[test]
    fn sellmeier_coefficients_meet_the_printed_index_and_abbe_number() {
        let printed = [
            ("N-BK7", 1.51680, 64.17),
            ("N-SK2", 1.60738, 56.65),
            ("N-SK16", 1.62041, 60.32),
            ("N-SSK2", 1.62229, 53.27),
            ("F2", 1.62004, 36.37),
            ("F5", 1.60342, 38.03),
            ("SF5", 1.67270, 32.21),
            ("SF6", 1.80518, 25.43),
            ("N-SF5", 1.67271, 32.25),
            ("N-SF6", 1.80518, 25.36),
            ("N-SF11", 1.78472, 25.68),
            ("N-BAF10", 1.67003, 47.11),
            ("N-LAK10", 1.72003, 50.62),
            ("N-LASF41", 1.83501, 43.13),
            ("N-LASF43", 1.80610, 40.61),
        ];
        assert_eq!(printed.len(), catalogue_names().count());
        for (name, nd, vd) in printed {
            let (n, v) = catalogue_glass(name).unwrap().nd_vd();
            assert!((n - nd).abs() < 1e-5, "{name}: nd {n} against {nd}");
            assert!((v - vd).abs() < 0.01, "{name}: vd {v} against {vd}");
        }
    }

    #[test]
    fn cauchy_and_sellmeier_agree_between_the_lines_that_fix_them() {
        let exact = catalogue_glass("N-BK7").unwrap();
        let (nd, vd) = exact.nd_vd();
        let fit = Glass::from_nd_vd(nd, Some(vd));
        for nm in [486.0, 530.0, 656.0] {
            assert!((fit.index(nm) - exact.index(nm)).abs() < 3e-4);
        }
    }
}
