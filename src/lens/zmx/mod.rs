//! Prescriptions from Zemax sequential files (`.zmx`), in UTF-8, Latin-1 or UTF-16.
//!
//! Read: `MODE SEQ`, `NAME`, `NOTE`, `UNIT MM`, `WAVM` (the number of them in use is the fourth number of `FTYP`), and per `SURF`:
//! `TYPE STANDARD|EVENASPH`, `CURV`, `CONI`, `PARM 1…8` (A_2 … A_16), `DISZ`, `GLAS`, `DIAM`, `CLAP`, `STOP`, `COMM`. The
//! object surface (the first) is left out, the image surface (the last) becomes the last distance, and so do plane dummies in air
//! that are not the stop. What would change the rays and is not read is refused: coordinate breaks, mirrors, other
//! surface types, apertures that are not circles. Every other keyword is passed over.
//!
//! **Glass.** `GLAS NAME flag 0 nd vd …`. The catalogue's coefficients are taken where the name is known and its n_d and V_d are
//! those of the line, or the line has Zemax's placeholders (1.5, 40). Where the line's own n_d and V_d differ from the named glass's,
//! the line's are taken: such files name the nearest catalogue glass and write the patent's numbers beside it. A model glass
//! (flag 1, or an unknown name) is its n_d and V_d.

mod surface;
mod text;

use super::error::LensError;
use super::prescription::{PrescribedSurface, Prescription, Stated, Verification};
use super::system::ASPHERE_TERMS;
use surface::ZmxSurface;
use text::{decode, format_error, number};

#[derive(Default)]
struct Header {
    name: String,
    notes: Vec<String>,
    wavelengths_nm: Vec<f64>,
    wavelengths_used: Option<usize>,
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
        };
        prescription.check()?;
        Ok(prescription)
    }
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
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use crate::lens::{Lens, Prescription};
    use crate::units::D_LINE_NM;

    /// A plano-convex singlet of N-BK7, f = R/(n − 1), behind a dummy plane.
    const SINGLET: &str = "MODE SEQ\nNAME singlet\nUNIT MM X W X CM MR CPMM\nWAVM 1 0.5875618 1\nFTYP 0 0 1 1 0 0 0\n\
        SURF 0\n TYPE STANDARD\n CURV 0.0\n DISZ INFINITY\n\
        SURF 1\n TYPE STANDARD\n COMM a dummy\n CURV 0.0\n DISZ 5\n DIAM 3\n\
        SURF 2\n STOP\n TYPE EVENASPH\n CURV 0.02\n CONI -0.5\n PARM 2 1e-6\n DISZ 3\n GLAS N-BK7 0 0 1.5 40\n DIAM 5\n\
        SURF 3\n TYPE STANDARD\n CURV 0.0\n DISZ 90\n DIAM 5\n\
        SURF 4\n TYPE STANDARD\n CURV 0.0\n DISZ 4\n DIAM 5\n\
        SURF 5\n TYPE STANDARD\n CURV 0.0\n DISZ 0\n";

    fn utf16(text: &str, join: fn(u16) -> [u8; 2]) -> Vec<u8> {
        "\u{feff}"
            .encode_utf16()
            .chain(text.encode_utf16())
            .flat_map(join)
            .collect()
    }

    #[test]
    fn singlet_in_every_encoding_has_the_lensmakers_focal_length() {
        let encodings = [
            SINGLET.as_bytes().to_vec(),
            [&[0xEF, 0xBB, 0xBF], SINGLET.as_bytes()].concat(),
            utf16(SINGLET, u16::to_le_bytes),
            utf16(SINGLET, u16::to_be_bytes),
            utf16(SINGLET, u16::to_le_bytes)[2..].to_vec(),
        ];
        for bytes in encodings {
            let p = Prescription::from_zmx(&bytes, "singlet.zmx").unwrap();
            assert_eq!(p.surfaces.len(), 2);
            assert_eq!(p.surfaces[1].thickness_mm, 94.0);
            assert_eq!(
                (p.surfaces[0].conic, p.surfaces[0].aspheric[1]),
                (-0.5, 1e-6)
            );
            let efl = Lens::new(&p).unwrap().paraxial(D_LINE_NM).unwrap().efl_mm;
            assert!((efl - 50.0 / 0.5168).abs() < 2e-3, "{efl}");
        }
    }

    #[test]
    fn a_lines_own_index_beats_the_name_it_does_not_agree_with() {
        let nd = |glas: &str| {
            let text = SINGLET.replace("N-BK7 0 0 1.5 40", glas);
            let p = Prescription::from_zmx(text.as_bytes(), "singlet.zmx").unwrap();
            p.surfaces[0].glass.unwrap().nd_vd().0
        };
        assert!((nd("N-LAK10 0 0 1.734 51.5") - 1.734).abs() < 1e-12);
        assert!((nd("___BLANK 1 0 1.6 30") - 1.6).abs() < 1e-12);
        assert!((nd("SF6 0 0 1.80518 25.4") - 1.80518).abs() < 1e-5);
    }

    #[test]
    fn what_is_not_supported_is_refused_by_name() {
        let cases = [
            ("MODE SEQ", "MODE NSC", "MODE"),
            ("UNIT MM", "UNIT IN", "UNIT"),
            ("TYPE EVENASPH", "TYPE COORDBRK", "SURF 2 TYPE: COORDBRK"),
            (
                "N-BK7 0 0 1.5 40",
                "UNOBTAINIUM 0 0 1.5 40",
                "`UNOBTAINIUM`",
            ),
            ("N-BK7 0 0 1.5 40", "MIRROR 0 0 1.5 40", "MIRROR"),
            ("N-BK7 0 0 1.5 40", "X 1 0 0.7 40", "nd = 0.7"),
            ("CURV 0.02", "CURV NaN", "SURF 2 CURV: NaN"),
            ("DISZ 90", "DISZ INFINITY", "SURF 3 DISZ"),
            ("DIAM 5\nSURF 3", "DIAM 0\nSURF 3", "SURF 2 DIAM"),
            (" STOP\n", "", "is_stop"),
            (
                "CURV 0.0\n DISZ INFINITY",
                "STOP\n CURV 0.0\n DISZ INFINITY",
                "SURF 0 STOP",
            ),
        ];
        for (from, to, expected) in cases {
            let text = SINGLET.replacen(from, to, 1);
            assert_ne!(text, SINGLET, "{from}");
            let error = Prescription::from_zmx(text.as_bytes(), "bad.zmx").unwrap_err();
            let message = error.to_string();
            assert!(
                message.starts_with("bad.zmx: ") && message.contains(expected),
                "{message}"
            );
        }
        for garbage in [
            &b""[..],
            b"\xff\xfe",
            b"\xff\xfe\x41",
            b"SURF 0",
            &[0u8; 64],
        ] {
            assert!(Prescription::from_zmx(garbage, "bad.zmx").is_err());
        }
    }
}
