//! Numbers on the command line.

/// Reads an option's number. NaN is refused here, for every option: compared with anything it is false, so that a check
/// of a range further on could pass it by.
///
/// # Errors
/// What is no number.
pub fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    match value.is_nan() {
        true => Err("NaN is not a number".to_owned()),
        false => Ok(value),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn nan_and_words_are_refused_and_infinity_is_a_number() {
        assert_eq!(number("-2.5e3").unwrap(), -2500.0);
        assert_eq!(number("inf").unwrap(), f64::INFINITY);
        for text in ["NaN", "nan", "-nan", "far", "", "1,5"] {
            assert!(number(text).is_err(), "{text}");
        }
    }
}
