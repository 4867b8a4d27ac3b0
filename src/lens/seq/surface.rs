//! One surface of a CODE V file, and its glass.

use super::commands::unquoted;
use crate::lens::error::LensError;
use crate::lens::glass::{Glass, catalogue_glass, catalogue_names};
use crate::lens::system::ASPHERE_TERMS;
use crate::lens::zmx::{format_error, number};

/// A surface as the file has it, in the file's unit.
#[derive(Clone, Debug, Default)]
pub(super) struct SeqSurface {
    pub curvature: f64,
    pub thickness: f64,
    pub glass: Option<Glass>,
    pub conic: f64,
    /// A_2, A_4, …
    pub aspheric: [f64; ASPHERE_TERMS],
    pub semi_mm: Option<f64>,
    pub is_stop: bool,
    pub label: String,
}

/// Commands of surfaces that bend or block light otherwise.
const REFUSED: [(&str, &str); 20] = [
    ("SPS", "special surfaces"),
    ("XTO", "toroids"),
    ("YTO", "toroids"),
    ("CYL", "cylinders"),
    ("AAS", "anamorphic aspheres"),
    ("GRT", "gratings"),
    ("DIF", "diffractive surfaces"),
    ("HOE", "holograms"),
    ("GRN", "gradient indices"),
    ("MOD", "modules"),
    ("REX", "apertures that are not circles"),
    ("REY", "apertures that are not circles"),
    ("ELX", "apertures that are not circles"),
    ("ELY", "apertures that are not circles"),
    ("XDE", "decentred surfaces"),
    ("YDE", "decentred surfaces"),
    ("ADE", "tilted surfaces"),
    ("BDE", "tilted surfaces"),
    ("ZOO", "zoom positions"),
    ("PRV", "private catalogues"),
];

impl SeqSurface {
    pub(super) fn is_plane(&self) -> bool {
        self.curvature == 0.0 && self.aspheric.iter().all(|&a| a == 0.0)
    }

    /// From the file's unit to mm.
    pub(super) fn scale(&mut self, mm_per_unit: f64) {
        self.curvature /= mm_per_unit;
        self.thickness *= mm_per_unit;
        self.semi_mm = self.semi_mm.map(|semi| semi * mm_per_unit);
        for (i, a) in self.aspheric.iter_mut().enumerate() {
            *a /= mm_per_unit.powi(2 * i as i32 + 1);
        }
    }

    /// Sets radius or curvature, thickness and glass of `S r t glass`.
    pub(super) fn set(
        &mut self,
        file: &str,
        field: &str,
        (words, radii): (&[&str], bool),
    ) -> Result<(), LensError> {
        self.set_bend(file, field, words, radii)?;
        if words.len() > 1 {
            self.thickness = number(file, field, words, 1)?;
        }
        if let Some(name) = words.get(2) {
            self.glass = glass(file, field, name)?;
        }
        Ok(())
    }

    fn set_bend(
        &mut self,
        file: &str,
        field: &str,
        words: &[&str],
        radii: bool,
    ) -> Result<(), LensError> {
        let bend = number(file, field, words, 0)?;
        // A radius of 0 or of 1e10 and more is a plane.
        self.curvature = match radii {
            true if bend == 0.0 || bend.abs() >= 1e10 => 0.0,
            true => 1.0 / bend,
            false => bend,
        };
        Ok(())
    }

    /// Takes in one command below the surface; `false`: it is none of a surface that this reads.
    pub(super) fn read(
        &mut self,
        file: &str,
        field: &str,
        (keyword, words): (&str, &[&str]),
    ) -> Result<(), LensError> {
        let at = |place| number(file, field, words, place);
        if let Some((_, what)) = REFUSED.iter().find(|(known, _)| *known == keyword) {
            let is_zero = words.first().and_then(|w| w.parse::<f64>().ok()) == Some(0.0);
            if is_zero && keyword.ends_with("DE") {
                return Ok(());
            }
            let reason = format!("{what} are not supported");
            return Err(format_error(file, field, &reason));
        }
        match keyword {
            "STO" => self.is_stop = true,
            "SLB" => self.label = unquoted(words),
            "RMD"
                if words
                    .first()
                    .is_some_and(|w| w.eq_ignore_ascii_case("REFL")) =>
            {
                return Err(format_error(file, field, "mirrors are not supported"));
            }
            "CIR" => match words {
                [kind, ..] if kind.eq_ignore_ascii_case("EDG") => {}
                [kind, ..] if kind.parse::<f64>().is_err() => {
                    let reason = format!("{kind}: must be a semi-diameter");
                    return Err(format_error(file, field, &reason));
                }
                _ => self.semi_mm = Some(at(0)?),
            },
            "THI" => self.thickness = at(0)?,
            "RDY" => self.set_bend(file, field, words, true)?,
            "CUY" => self.set_bend(file, field, words, false)?,
            "GLA" => {
                let name = words.first().copied().unwrap_or("");
                self.glass = glass(file, field, name)?;
            }
            "K" => self.conic = at(0)?,
            "A" | "B" | "C" | "D" | "E" | "F" | "G" | "H" | "I" => {
                let term = 1 + usize::from(keyword.as_bytes()[0] - b'A');
                self.aspheric[term] = at(0)?;
            }
            "J" if at(0)? != 0.0 => {
                return Err(format_error(file, field, "must be 0: terms go up to r^20"));
            }
            _ => {}
        }
        Ok(())
    }
}

/// By name or number; `None` for air.
fn glass(file: &str, field: &str, name: &str) -> Result<Option<Glass>, LensError> {
    let name = name.trim_matches(['"', '\'']);
    if name.is_empty() || name.eq_ignore_ascii_case("AIR") {
        return Ok(None);
    }
    if name.eq_ignore_ascii_case("REFL") {
        return Err(format_error(file, field, "mirrors are not supported"));
    }
    if let Some(numbers) = fictitious(name) {
        let (nd, vd) = numbers;
        if !(1.0..=3.0).contains(&nd) || !(10.0..=200.0).contains(&vd) {
            let reason =
                format!("{name}: nd = {nd:.6}, vd = {vd:.4}; must be 1 to 3, and 10 to 200");
            return Err(format_error(file, field, &reason));
        }
        return Ok(Some(Glass::from_nd_vd(nd, Some(vd))));
    }
    let plain = |text: &str| text.replace('-', "").to_ascii_uppercase();
    let own = plain(name.split('_').next().unwrap_or(name));
    let known = catalogue_names().find(|known| plain(known) == own);
    match known.and_then(catalogue_glass) {
        Some(glass) => Ok(Some(glass)),
        None => {
            let all = catalogue_names().collect::<Vec<_>>().join(", ");
            let reason = format!(
                "unknown glass `{name}`; allowed: a number nnnnnn.vvvvvv (nd = 1.nnnnnn, vd = vv.vvvv), or one of {all}"
            );
            Err(format_error(file, field, &reason))
        }
    }
}

/// `517642.` or `516800.641700`: n_d − 1 and V_d by their digits.
fn fictitious(name: &str) -> Option<(f64, f64)> {
    let (index, abbe) = name.split_once('.').unwrap_or((name, ""));
    let digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit());
    if !digits(index) || !digits(abbe) {
        return None;
    }
    // Six digits without a point are three of each.
    let (index, abbe) = match (index.len(), abbe) {
        (6, "") => index.split_at(3),
        (3..=9, abbe) if abbe.len() >= 2 => (index, abbe),
        _ => return None,
    };
    let nd = 1.0 + index.parse::<f64>().ok()? / 10f64.powi(index.len() as i32);
    let vd = abbe.parse::<f64>().ok()? / 10f64.powi(abbe.len() as i32 - 2);
    Some((nd, vd))
}
