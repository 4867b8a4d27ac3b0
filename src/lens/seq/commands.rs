//! The commands of a CODE V file, one after the other.

use super::surface::SeqSurface;
use crate::lens::error::LensError;
use crate::lens::zmx::{format_error, number};

/// What a file's head says.
#[derive(Debug)]
pub(super) struct Header {
    pub title: String,
    pub wavelengths_nm: Vec<f64>,
    pub mm_per_unit: f64,
    pub aperture: Option<SystemAperture>,
    /// Largest field angle, deg.
    pub field_deg: f64,
    /// Largest paraxial image height, in the file's unit.
    pub image_height: f64,
    radii: bool,
}

/// In the file's unit.
#[derive(Clone, Copy, Debug)]
pub(super) enum SystemAperture {
    /// Diameter of the entrance pupil.
    EntrancePupilDiameter(f64),
    /// F-number at infinity.
    FNumber(f64),
}

/// What has been read so far.
pub(super) struct Reader<'a> {
    file: &'a str,
    pub header: Header,
    pub surfaces: Vec<SeqSurface>,
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a str) -> Self {
        Self {
            file,
            header: Header {
                title: String::new(),
                wavelengths_nm: Vec::new(),
                mm_per_unit: 1.0,
                aperture: None,
                field_deg: 0.0,
                image_height: 0.0,
                radii: false,
            },
            surfaces: Vec::new(),
        }
    }

    pub(super) fn read(&mut self, text: &str) -> Result<(), LensError> {
        let mut joined = String::new();
        for line in text.lines() {
            let line = before(line, '!').trim_end();
            match line.strip_suffix('&') {
                Some(begun) => joined.push_str(begun),
                None => {
                    joined.push_str(line);
                    joined.push('\n');
                }
            }
        }
        for mut rest in joined.lines() {
            while !rest.is_empty() {
                let command = before(rest, ';');
                rest = rest[command.len()..].trim_start_matches(';');
                let words: Vec<&str> = command.split_whitespace().collect();
                if let Some((keyword, words)) = words.split_first() {
                    self.command(&keyword.to_ascii_uppercase(), words)?;
                }
            }
        }
        Ok(())
    }

    fn command(&mut self, keyword: &str, words: &[&str]) -> Result<(), LensError> {
        let radii = self.header.radii;
        let is_surface = keyword == "SO"
            || keyword == "SI"
            || keyword
                .strip_prefix('S')
                .is_some_and(|n| n.bytes().all(|b| b.is_ascii_digit()));
        if is_surface {
            let field = format!("S{}", self.surfaces.len());
            let mut surface = SeqSurface::default();
            // An object at infinity has its distance as 1e10 or more, which is of no use; `SI` may stand alone.
            if !words.is_empty() {
                surface.set(self.file, &field, (words, radii))?;
            }
            self.surfaces.push(surface);
            return Ok(());
        }
        let number_of = self.surfaces.len();
        if let Some(surface) = self.surfaces.last_mut() {
            let field = format!("S{} {keyword}", number_of - 1);
            return surface.read(self.file, &field, (keyword, words));
        }
        self.head(keyword, words)
    }

    fn head(&mut self, keyword: &str, words: &[&str]) -> Result<(), LensError> {
        let file = self.file;
        let at = |place| number(file, keyword, words, place);
        let largest = || -> Result<f64, LensError> {
            let mut all = (0..words.len()).map(|i| number(file, keyword, words, i));
            all.try_fold(0.0, |most, value| Ok(f64::max(most, value?.abs())))
        };
        let first = words.first().copied().unwrap_or("");
        let header = &mut self.header;
        match keyword {
            "RDM" => header.radii = !first.to_ascii_uppercase().starts_with('N'),
            "TIT" | "TITLE" => header.title = unquoted(words),
            "DIM" => {
                header.mm_per_unit = match first.to_ascii_uppercase().as_str() {
                    "M" | "MM" => 1.0,
                    "C" | "CM" => 10.0,
                    "I" | "IN" => 25.4,
                    _ => {
                        let reason = format!("{first}: must be M, C or I");
                        return Err(format_error(file, keyword, &reason));
                    }
                }
            }
            "EPD" => header.aperture = Some(SystemAperture::EntrancePupilDiameter(at(0)?)),
            "FNO" => header.aperture = Some(SystemAperture::FNumber(at(0)?)),
            "NA" | "NAO" => {
                return Err(format_error(
                    file,
                    keyword,
                    "must be EPD or FNO: for an object far away",
                ));
            }
            "WL" => {
                let all = (0..words.len()).map(at);
                header.wavelengths_nm = all.collect::<Result<_, _>>()?;
            }
            "XAN" | "YAN" => header.field_deg = header.field_deg.max(largest()?),
            "XIM" | "YIM" | "XRI" | "YRI" => {
                header.image_height = header.image_height.max(largest()?)
            }
            "ZOO" => {
                return Err(format_error(
                    file,
                    keyword,
                    "zoom positions are not supported",
                ));
            }
            _ => {}
        }
        Ok(())
    }
}

/// Words as one text, without the quotes around it.
pub(super) fn unquoted(words: &[&str]) -> String {
    let text = words.join(" ");
    let inner = ['"', '\''].iter().find_map(|quote| {
        let inner = text.strip_prefix(*quote)?.strip_suffix(*quote)?;
        Some(inner.to_owned())
    });
    inner.unwrap_or(text)
}

/// The text before a mark that stands outside of quotes; all of it where there is none.
fn before(line: &str, mark: char) -> &str {
    let mut quote = None;
    for (i, c) in line.char_indices() {
        match (quote, c) {
            (None, c) if c == mark => return &line[..i],
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), c) if c == open => quote = None,
            _ => {}
        }
    }
    line
}
