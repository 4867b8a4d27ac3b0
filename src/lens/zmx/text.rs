//! The text of files of lens design programs: its encoding, its numbers, its errors.

use crate::lens::error::LensError;

/// UTF-16 by its byte order mark, or by the zero bytes of its ASCII; else UTF-8; else Latin-1, as old files are.
pub(in crate::lens) fn decode(bytes: &[u8]) -> String {
    let utf16 = |rest: &[u8], join: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = rest
            .chunks_exact(2)
            .map(|pair| join([pair[0], pair[1]]))
            .collect();
        String::from_utf16_lossy(&units)
    };
    match bytes {
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes),
        [0xEF, 0xBB, 0xBF, rest @ ..] => String::from_utf8_lossy(rest).into_owned(),
        [first, 0, ..] if *first != 0 => utf16(bytes, u16::from_le_bytes),
        [0, second, ..] if *second != 0 => utf16(bytes, u16::from_be_bytes),
        _ => match std::str::from_utf8(bytes) {
            Ok(text) => text.into(),
            Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
        },
    }
}

/// The finite number that stands at place `at` of a keyword's words.
pub(in crate::lens) fn number(
    file: &str,
    field: &str,
    words: &[&str],
    at: usize,
) -> Result<f64, LensError> {
    let word = words.get(at).copied().unwrap_or("nothing");
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format_error(
            file,
            field,
            &format!("{word}: must be a finite number"),
        )),
    }
}

/// What is wrong with a keyword, and what is allowed.
pub(in crate::lens) fn format_error(file: &str, field: &str, reason: &str) -> LensError {
    LensError::Format {
        file: file.into(),
        field: field.into(),
        reason: reason.into(),
    }
}
