//! Prescriptions from Zemax sequential files (`.zmx`), in UTF-8, Latin-1 or UTF-16.
//!
//! Read: `MODE SEQ`, `NAME`, `NOTE`, `UNIT MM`, `ENPD`, `FNUM`, `WAVM` (the number of them in use is the fourth number
//! of `FTYP`), and per `SURF`: `TYPE STANDARD|EVENASPH`, `CURV`, `CONI`, `PARM 1…8` (A_2 … A_16), `DISZ`, `GLAS`,
//! `DIAM`, `CLAP`, `STOP`, `COMM`. The object surface (the first) is left out, the image surface (the last) becomes the
//! last distance, and so do plane dummies in air that are not the stop. What would change the rays and is not read is
//! refused: coordinate breaks, mirrors, other surface types, apertures that are not circles. Every other keyword is
//! passed over.
//!
//! **Stop.** `ENPD` (entrance pupil diameter) or `FNUM` (F-number) at the head, where given and not 0, sets the stop:
//! its `DIAM` is then only where rays happened to go. Else (`FLOA`) the stop's `DIAM` is the stop.
//!
//! **Glass.** `GLAS NAME flag 0 nd vd …`. The catalogue's coefficients are taken where the name is known and its n_d
//! and V_d are those of the line, or the line has Zemax's placeholders (1.5, 40). Where the line's own n_d and V_d
//! differ from the named glass's, the line's are taken: such files name the nearest catalogue glass and write the
//! patent's numbers beside it. A model glass (flag 1, or an unknown name) is its n_d and V_d.

mod surface;
mod text;

use super::error::LensError;
use super::placed::Lens;
use super::prescription::{PrescribedSurface, Prescription, Stated, Verification};
use super::system::ASPHERE_TERMS;
use crate::units::D_LINE_NM;
use surface::ZmxSurface;
pub(super) use text::{decode, format_error, number};

#[derive(Default)]
struct Header {
    name: String,
    notes: Vec<String>,
    wavelengths_nm: Vec<f64>,
    wavelengths_used: Option<usize>,
    aperture: Option<SystemAperture>,
}

/// What a file's head says of the aperture.
#[derive(Clone, Copy)]
enum SystemAperture {
    /// Diameter of the entrance pupil, mm.
    EntrancePupilDiameter(f64),
    /// F-number at infinity.
    FNumber(f64),
}

impl Prescription {
    /// Reads and checks a Zemax sequential file; `file` is what errors call it.
    ///
    /// # Errors
    /// [`LensError::Format`] for what cannot be read or is not supported, naming the surface and the keyword;
    /// [`LensError::Value`] for values that no lens can have (see [`Prescription::check`]).
    pub fn from_zmx(bytes: &[u8], file: &str) -> Result<Prescription, LensError> {
        let text = decode(bytes);
        let mut reader = Reader {
            file,
            header: Header::default(),
            surfaces: Vec::new(),
        };
        for line in text.lines() {
            reader.read(line.trim())?;
        }
        let Reader {
            header, surfaces, ..
        } = reader;
        if surfaces.len() < 3 {
            return Err(format_error(
                file,
                "SURF",
                &format!(
                    "{} surfaces: there must be an object, a lens and an image",
                    surfaces.len()
                ),
            ));
        }
        if surfaces[0].is_stop {
            return Err(format_error(
                file,
                "SURF 0 STOP",
                "the stop must not be the object surface",
            ));
        }
        let used = header.wavelengths_used.unwrap_or(usize::MAX);
        let prescription = Prescription {
            file: file.into(),
            name: header.name,
            source: file.into(),
            notes: header.notes.join(" "),
            surfaces: prescribed(surfaces, file)?,
            wavelengths_nm: header.wavelengths_nm.into_iter().take(used).collect(),
            fold: None,
            stated: Stated::default(),
            verification: Verification::default(),
            warnings: Vec::new(),
        }
        .checked()?;
        match header.aperture {
            Some(aperture) => with_stop_for(prescription, aperture),
            None => Ok(prescription),
        }
    }
}

/// The prescription with its stop opened or closed so that the paraxial pupil is as the file's head says.
fn with_stop_for(
    mut prescription: Prescription,
    aperture: SystemAperture,
) -> Result<Prescription, LensError> {
    let p = Lens::new(&prescription)?.paraxial(D_LINE_NM)?;
    let wanted_semi_mm = match aperture {
        SystemAperture::EntrancePupilDiameter(d_mm) => 0.5 * d_mm,
        SystemAperture::FNumber(f) => 0.5 * p.efl_mm / f,
    };
    for stop in prescription.surfaces.iter_mut().filter(|s| s.is_stop) {
        stop.semi_aperture_mm *= wanted_semi_mm / p.entrance_pupil_semi_mm;
    }
    prescription.check()?;
    Ok(prescription)
}

/// Object and image surface taken off, plane dummies in air joined to the distance before them.
fn prescribed(surfaces: Vec<ZmxSurface>, file: &str) -> Result<Vec<PrescribedSurface>, LensError> {
    let last = surfaces.len() - 1;
    let mut kept: Vec<PrescribedSurface> = Vec::new();
    for (i, s) in surfaces.into_iter().enumerate().skip(1) {
        if i == last {
            break;
        }
        let in_air = s.glass.is_none() && kept.last().is_none_or(|before| before.glass.is_none());
        if in_air && s.is_plane() && !s.is_stop {
            if let Some(before) = kept.last_mut() {
                before.thickness_mm += s.thickness_mm;
            }
            continue;
        }
        if s.semi_mm <= 0.0 {
            let field = format!("SURF {} DIAM", s.number);
            return Err(format_error(
                file,
                &field,
                "must be a semi-diameter above 0",
            ));
        }
        kept.push(PrescribedSurface {
            curvature: s.curvature,
            thickness_mm: s.thickness_mm,
            glass: s.glass,
            conic: s.conic,
            aspheric: if s.is_asphere {
                s.aspheric
            } else {
                [0.0; ASPHERE_TERMS]
            },
            semi_aperture_mm: s.semi_mm,
            reflectance: None,
            is_stop: s.is_stop,
            label: s.comment,
        });
    }
    Ok(kept)
}

/// What has been read so far.
struct Reader<'a> {
    file: &'a str,
    header: Header,
    surfaces: Vec<ZmxSurface>,
}

impl Reader<'_> {
    fn read(&mut self, line: &str) -> Result<(), LensError> {
        let mut words = line.split_whitespace();
        let Some(keyword) = words.next() else {
            return Ok(());
        };
        let words: Vec<&str> = words.collect();
        let rest = line[keyword.len()..].trim();
        if keyword == "SURF" {
            self.surfaces.push(ZmxSurface {
                number: rest.into(),
                ..ZmxSurface::default()
            });
            return Ok(());
        }
        let is_object = self.surfaces.len() == 1;
        match self.surfaces.last_mut() {
            Some(surface) => surface.read(self.file, is_object, (keyword, &words, rest)),
            None => self.read_header(keyword, &words, rest),
        }
    }

    fn read_header(&mut self, keyword: &str, words: &[&str], rest: &str) -> Result<(), LensError> {
        let first = words.first().copied().unwrap_or("");
        let refuse = |allowed: &str| {
            let reason = format!("{first}: must be {allowed}");
            Err(format_error(self.file, keyword, &reason))
        };
        match keyword {
            "MODE" if first != "SEQ" => return refuse("SEQ, a sequential lens"),
            "UNIT" if first != "MM" => return refuse("MM"),
            "NAME" => self.header.name = rest.into(),
            // `NOTE 0 text`: the number is the kind of note.
            "NOTE" => self
                .header
                .notes
                .push(words[1.min(words.len())..].join(" ")),
            "WAVM" => {
                let um = number(self.file, keyword, words, 1)?;
                self.header.wavelengths_nm.push(um * 1e3);
            }
            "ENPD" | "FNUM" => {
                let size = number(self.file, keyword, words, 0)?;
                if size < 0.0 {
                    return refuse("0 or more");
                }
                let aperture = if keyword == "ENPD" {
                    SystemAperture::EntrancePupilDiameter(size)
                } else {
                    SystemAperture::FNumber(size)
                };
                self.header.aperture = Some(aperture).filter(|_| size > 0.0);
            }
            "FTYP" => {
                let used = words.get(3).and_then(|w| w.parse().ok());
                self.header.wavelengths_used = used.filter(|&n| n > 0);
            }
            _ => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
