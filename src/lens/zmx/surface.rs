//! One `SURF` block of a Zemax file.

use super::text::{format_error, number};
use crate::lens::error::LensError;
use crate::lens::glass::{Glass, catalogue_glass, catalogue_names};
use crate::lens::system::ASPHERE_TERMS;

/// A named glass is the line's own when n_d and V_d agree to these, the digits that patents print.
const SAME_GLASS: (f64, f64) = (1e-4, 0.15);
/// What Zemax writes on the line of a catalogue glass that it has not looked up.
const PLACEHOLDER: (f64, f64) = (1.5, 40.0);
/// Keywords of a surface that block light in other shapes than a circle.
const OTHER_APERTURES: [&str; 8] = [
    "OBSC", "SQAP", "SQOB", "ELAP", "ELOB", "SPID", "UDAP", "OBDC",
];

/// A surface as the file has it.
#[derive(Default)]
pub(super) struct ZmxSurface {
    pub number: String,
    pub curvature: f64,
    pub conic: f64,
    pub aspheric: [f64; ASPHERE_TERMS],
    pub is_asphere: bool,
    pub thickness_mm: f64,
    pub glass: Option<Glass>,
    pub semi_mm: f64,
    pub is_stop: bool,
    pub comment: String,
}

impl ZmxSurface {
    pub(super) fn is_plane(&self) -> bool {
        self.curvature == 0.0 && (!self.is_asphere || self.aspheric.iter().all(|&a| a == 0.0))
    }

    /// Takes in one line: `keyword`, its words, and the same words as one text. `is_object` for the first surface.
    pub(super) fn read(
        &mut self,
        file: &str,
        is_object: bool,
        (keyword, words, rest): (&str, &[&str], &str),
    ) -> Result<(), LensError> {
        let field = format!("SURF {} {keyword}", self.number);
        let refuse = |reason: String| Err(format_error(file, &field, &reason));
        let at = |place| number(file, &field, words, place);
        let first = words.first().copied().unwrap_or("");
        match keyword {
            "TYPE" if first == "EVENASPH" => self.is_asphere = true,
            "TYPE" if first != "STANDARD" => {
                return refuse(format!("{first}: must be STANDARD or EVENASPH"));
            }
            "STOP" => self.is_stop = true,
            "COMM" => self.comment = rest.into(),
            "CURV" => self.curvature = at(0)?,
            "CONI" => self.conic = at(0)?,
            "PARM" => {
                let (term, a) = (at(0)?, at(1)?);
                if (1.0..=8.0).contains(&term) {
                    self.aspheric[term as usize - 1] = a;
                } else if a != 0.0 {
                    return refuse(format!("{term}: must be 1 to 8"));
                }
            }
            "DISZ" if first.eq_ignore_ascii_case("INFINITY") && is_object => {}
            "DISZ" => self.thickness_mm = at(0)?,
            "DIAM" => self.semi_mm = at(0)?,
            "CLAP" if at(0)? != 0.0 => {
                return refuse("a ring: its inner radius must be 0".into());
            }
            "CLAP" => self.semi_mm = at(1)?,
            "GLAS" => self.glass = Some(glass(file, &field, words)?),
            _ if OTHER_APERTURES.contains(&keyword) => {
                return refuse("is not supported: apertures must be circles".into());
            }
            _ => {}
        }
        Ok(())
    }
}

fn glass(file: &str, field: &str, words: &[&str]) -> Result<Glass, LensError> {
    let name = words.first().copied().unwrap_or("");
    if name == "MIRROR" {
        let reason = "MIRROR: is not supported; unfold the lens and name the fold in a JSON file";
        return Err(format_error(file, field, reason));
    }
    let written = match (words.get(3), words.get(4)) {
        (Some(_), Some(_)) => {
            let nd = number(file, field, words, 3)?;
            let vd = number(file, field, words, 4)?;
            Some((nd, vd)).filter(|&numbers| nd != 0.0 && numbers != PLACEHOLDER)
        }
        _ => None,
    };
    match (catalogue_glass(name), written) {
        (Some(known), None) => Ok(known),
        (known, Some((nd, vd))) => {
            let same = known.filter(|glass| {
                let (n, v) = glass.nd_vd();
                (n - nd).abs() <= SAME_GLASS.0 && (v - vd).abs() <= SAME_GLASS.1
            });
            if !(1.0..=5.0).contains(&nd) || !(vd == 0.0 || (10.0..=200.0).contains(&vd)) {
                let reason =
                    format!("nd = {nd}, vd = {vd}: must be 1 to 5, and 10 to 200 (or 0 for none)");
                return Err(format_error(file, field, &reason));
            }
            Ok(same.unwrap_or_else(|| Glass::from_nd_vd(nd, Some(vd).filter(|&v| v != 0.0))))
        }
        (None, None) => {
            let known = catalogue_names().collect::<Vec<_>>().join(", ");
            let reason = format!("unknown glass `{name}` without nd and vd; known are {known}");
            Err(format_error(file, field, &reason))
        }
    }
}
