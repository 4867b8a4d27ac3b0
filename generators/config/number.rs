//! A number of a configuration: given, or drawn.

use quadpixel::sampling::uniform;
use serde::{Deserialize, Serialize};

use crate::field_error::FieldError;

/// A number, or how one is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Draw {
    /// Always this.
    Fixed(f64),
    /// Between two numbers.
    Range(Range),
}

/// See [`Draw`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// In which scale the density is even.
    #[serde(default)]
    pub scale: Scale,
}

/// Scale of an even density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// In the number itself.
    #[default]
    Linear,
    /// In its logarithm.
    Log,
    /// In its inverse (depths: even in disparity).
    Inverse,
}

impl Range {
    /// The number at a part t (0 to 1) of the way from `min` to `max`, even in the scale.
    pub fn at(&self, t: f64) -> f64 {
        let Self { min, max, scale } = *self;
        match scale {
            Scale::Linear => min + t * (max - min),
            Scale::Log => (min.ln() + t * (max / min).ln()).exp(),
            Scale::Inverse => 1.0 / (1.0 / min + t * (1.0 / max - 1.0 / min)),
        }
    }
}

impl Draw {
    /// The number for a seed and key.
    pub fn at(&self, seed: u64, key: &[u64]) -> f64 {
        match self {
            Self::Fixed(value) => *value,
            Self::Range(range) => range.at(uniform(seed, key)),
        }
    }

    /// Smallest and largest value.
    pub fn bounds(&self) -> (f64, f64) {
        match *self {
            Self::Fixed(v) => (v, v),
            Self::Range(Range { min, max, .. }) => (min, max),
        }
    }

    /// Checks that every number that can be drawn lies in a range, ends included.
    fn check(&self, field: &'static str, [lowest, highest]: [f64; 2]) -> Result<(), FieldError> {
        let (min, max) = self.bounds();
        let positive_scale = !matches!(
            self,
            Self::Range(Range {
                scale: Scale::Log | Scale::Inverse,
                ..
            })
        ) || min > 0.0;
        // Written so that NaN fails.
        if min >= lowest && max <= highest && min <= max && positive_scale {
            return Ok(());
        }
        let value = if min == max {
            format!("{min}")
        } else {
            format!("{min} to {max}")
        };
        let allowed =
            format!("{lowest} to {highest}, min ≤ max, and above 0 for a log or inverse scale");
        Err(FieldError::new(field, value, allowed))
    }
}

/// A field, what is drawn for it (`None`: nothing) and the range that it may come from.
pub(super) type Row = (&'static str, Option<Draw>, [f64; 2]);

/// Checks all rows.
pub(super) fn check(rows: &[Row]) -> Result<(), FieldError> {
    rows.iter().try_for_each(|(field, draw, range)| match draw {
        Some(draw) => draw.check(field, *range),
        None => Ok(()),
    })
}
