//! Complex refractive indices n + ik of the pixel's materials (time convention e^(−iωt), k > 0 is loss).
//!
//! Either a constant or a table of `materials.csv`, whose head names the source of each one (Green 2008 for silicon,
//! Malitson 1965 for SiO2, ...); linear between its lines, 400 to 700 nm.

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::StackError;

const TABLES: &str = include_str!("materials.csv");

/// A material of the pixel. In TOML: the name of a table (`"Si_Green2008"`), or `{ n = 1.56, k = 0.0 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Material {
    /// Index independent of the wavelength.
    Constant {
        /// Real part.
        n: f64,
        /// Imaginary part, ≥ 0.
        k: f64,
    },
    /// A table of `materials.csv`.
    Table(String),
}

impl Material {
    /// Refractive index at a wavelength in nm.
    ///
    /// # Errors
    /// An unknown table, a wavelength outside it, or n, k out of range.
    pub fn index(&self, wavelength_nm: f64) -> Result<Complex64, StackError> {
        self.check("material")?;
        match self {
            Self::Constant { n, k } => Ok(Complex64::new(*n, *k)),
            Self::Table(name) => from_table(name, wavelength_nm),
        }
    }

    /// Whether it is a known table or numbers in range; `field` names it in the error.
    pub(super) fn check(&self, field: &str) -> Result<(), StackError> {
        match self {
            Self::Constant { n, k } if !(0.1..=10.0).contains(n) || !(0.0..=10.0).contains(k) => {
                Err(StackError::value(
                    field,
                    format!("n = {n}, k = {k}"),
                    "n 0.1 to 10, k 0 to 10",
                ))
            }
            Self::Table(name) if !rows().any(|(known, _)| known == name) => Err(StackError::value(
                field,
                name,
                "{ n, k } or a name of materials.csv, such as Si_Green2008",
            )),
            _ => Ok(()),
        }
    }

    /// Names of the tables.
    pub fn table_names() -> Vec<&'static str> {
        let mut names: Vec<_> = rows().map(|(name, ..)| name).collect();
        names.dedup();
        names
    }
}

fn rows() -> impl Iterator<Item = (&'static str, [f64; 3])> {
    TABLES.lines().filter_map(|line| {
        let mut cells = line.split(',');
        let name = cells.next()?;
        let mut number = || cells.next()?.parse::<f64>().ok();
        // Comment and heading lines have no numbers and drop out here.
        Some((name, [number()?, number()?, number()?]))
    })
}

fn from_table(name: &str, wavelength_nm: f64) -> Result<Complex64, StackError> {
    let um = wavelength_nm * 1e-3;
    let mut below: Option<[f64; 3]> = None;
    for (_, row) in rows().filter(|(n, _)| *n == name) {
        // Half an ulp-ish slack: 550 nm × 1e-3 is not quite 0.550.
        if (row[0] - um).abs() < 1e-9 {
            return Ok(Complex64::new(row[1], row[2]));
        }
        if row[0] > um {
            return match below {
                Some(low) => {
                    let part = (um - low[0]) / (row[0] - low[0]);
                    Ok(Complex64::new(
                        low[1] + part * (row[1] - low[1]),
                        low[2] + part * (row[2] - low[2]),
                    ))
                }
                None => break,
            };
        }
        below = Some(row);
    }
    Err(StackError::value(
        "wavelength_nm",
        wavelength_nm,
        "400 to 700 (the material tables)",
    ))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn silicon_at_550_nm_is_greens() {
        let si = Material::Table("Si_Green2008".into()).index(550.0).unwrap();
        assert_eq!((si.re, si.im), (4.077, 0.027968));
        let between = Material::Table("Si_Green2008".into()).index(562.5).unwrap();
        assert!((between.re - 0.5 * (4.077 + 4.0015)).abs() < 1e-9);
    }

    #[test]
    fn unknown_names_and_wavelengths_are_refused() {
        let e = Material::Table("Si_Gren".into()).index(550.0).unwrap_err();
        assert!(e.to_string().contains("material is Si_Gren"), "{e}");
        let e = Material::Table("Si_Green2008".into())
            .index(900.0)
            .unwrap_err();
        assert!(e.to_string().contains("wavelength_nm is 900"), "{e}");
        assert!(Material::table_names().contains(&"SiO2_Malitson1965"));
    }
}
