//! The one error of a value out of its range, and the checks that give it.
//!
//! Its message names whose value it is, the field, the value and what is allowed, as in
//! `sensor: pitch_um is 0; allowed: a positive length`. No check lets NaN pass.

use std::borrow::Cow;
use std::fmt::Display;
use std::ops::RangeInclusive;

/// A value out of its range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}: {field} is {value}; allowed: {allowed}")]
pub struct OutOfRange {
    /// Whose value it is: the part of the camera, a file, an entry of a list.
    pub what: Cow<'static, str>,
    /// The field.
    pub field: Cow<'static, str>,
    /// The value that was given.
    pub value: String,
    /// What is allowed.
    pub allowed: Cow<'static, str>,
}

impl OutOfRange {
    /// The error of `field` of `what`, which is `value` and may be what `allowed` says.
    pub fn new(
        what: impl Into<Cow<'static, str>>,
        field: impl Into<Cow<'static, str>>,
        value: impl Display,
        allowed: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self {
            what: what.into(),
            field: field.into(),
            value: short(&value),
            allowed: allowed.into(),
        }
    }
}

/// Checks that `value` lies in `allowed`, ends included.
///
/// # Errors
/// [`OutOfRange`] if it does not, or is NaN.
pub fn within(
    what: impl Into<Cow<'static, str>>,
    field: impl Into<Cow<'static, str>>,
    value: f64,
    allowed: RangeInclusive<f64>,
) -> Result<(), OutOfRange> {
    let ends = || format!("{} to {}", short(allowed.start()), short(allowed.end()));
    require(allowed.contains(&value), || {
        OutOfRange::new(what, field, value, ends())
    })
}

/// The longest whole number of 64 bits.
const MOST_DIGITS: usize = 20;

/// A value as people write it: 1e300 has 301 digits.
pub fn short(value: &impl Display) -> String {
    let text = value.to_string();
    match text.parse::<f64>() {
        Ok(number) if text.len() > MOST_DIGITS => format!("{number:e}"),
        _ => text,
    }
}

/// Checks a condition that is no interval; `error` is made only where it does not hold.
///
/// # Errors
/// What `error` gives, unless `holds`.
pub fn require(holds: bool, error: impl FnOnce() -> OutOfRange) -> Result<(), OutOfRange> {
    if holds { Ok(()) } else { Err(error()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_allowed_and_nan_is_not() {
        for value in [0.0, 0.25, 0.5] {
            assert_eq!(within("readout", "prnu", value, 0.0..=0.5), Ok(()));
        }
        for (value, shown) in [
            (-f64::EPSILON, "-2.220446049250313e-16"),
            (0.75, "0.75"),
            (1e300, "1e300"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            let error = OutOfRange::new("readout", "prnu", shown, "0 to 0.5");
            assert_eq!(within("readout", "prnu", value, 0.0..=0.5), Err(error));
        }
    }

    #[test]
    fn values_of_every_kind_are_short() {
        for (error, value) in [
            (OutOfRange::new("lens", "radius_mm", 1e30, ""), "1e30"),
            (
                OutOfRange::new("lens", "radius_mm", -2.5e-19, ""),
                "-2.5e-19",
            ),
            (
                OutOfRange::new("run", "seed", u64::MAX, ""),
                "18446744073709551615",
            ),
            (
                OutOfRange::new("lens", "name", "nanometre", ""),
                "nanometre",
            ),
        ] {
            assert_eq!(error.value, value);
        }
    }

    #[test]
    fn the_message_names_the_field_its_value_and_what_is_allowed() {
        let error = OutOfRange::new("sensor", "pitch_um", 0.0, "a positive length");
        let message = "sensor: pitch_um is 0; allowed: a positive length";
        assert_eq!(error.to_string(), message);
    }
}
