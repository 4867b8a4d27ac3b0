//! Which effects are asked for, and how much may be wrong.

use std::collections::BTreeSet;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::{Effect, Estimate};

/// Which effects are simulated. In files: `"auto"`, `"all"`, `"none"`, or a list of names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Text", into = "Text")]
pub enum Choice {
    /// Those that the scene calls for.
    #[default]
    Auto,
    /// All of them.
    All,
    /// These; the others are left out where that is possible. None: an empty set.
    Only(BTreeSet<Effect>),
}

/// An effect that there is not.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("effects: `{name}` is not one; allowed: auto, all, none, or a list of {known}")]
pub struct ChoiceError {
    /// What was given.
    pub name: String,
    /// Names of all effects.
    pub known: String,
}

/// A choice as files have it.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Text {
    One(String),
    Many(Vec<String>),
}

impl Choice {
    /// Whether nothing was chosen.
    pub fn is_auto(&self) -> bool {
        *self == Self::Auto
    }

    /// Whether an effect is asked for by name or by `all`; `None`: the scene decides.
    pub fn asks_for(&self, effect: Effect) -> Option<bool> {
        match self {
            Self::Auto => None,
            Self::All => Some(true),
            Self::Only(effects) => Some(effects.contains(&effect)),
        }
    }

    fn only<'a>(names: impl Iterator<Item = &'a str>) -> Result<Self, ChoiceError> {
        let effect = |name: &str| {
            let effect = Effect::SELECTABLE.into_iter().find(|e| e.name() == name);
            effect.ok_or_else(|| ChoiceError {
                name: name.to_string(),
                known: Effect::SELECTABLE.map(Effect::name).join(", "),
            })
        };
        names.map(effect).collect::<Result<_, _>>().map(Self::Only)
    }
}

impl FromStr for Choice {
    type Err = ChoiceError;

    /// `auto`, `all`, `none`, or names with commas between them.
    fn from_str(text: &str) -> Result<Self, ChoiceError> {
        match text {
            "auto" => Ok(Self::Auto),
            "all" => Ok(Self::All),
            "none" => Ok(Self::Only(BTreeSet::new())),
            names => Self::only(names.split(',')),
        }
    }
}

impl TryFrom<Text> for Choice {
    type Error = ChoiceError;
    fn try_from(text: Text) -> Result<Self, ChoiceError> {
        match text {
            Text::One(word) => word.parse(),
            Text::Many(names) => Self::only(names.iter().map(String::as_str)),
        }
    }
}

impl From<Choice> for Text {
    fn from(choice: Choice) -> Self {
        match choice {
            Choice::Auto => Self::One("auto".into()),
            Choice::All => Self::One("all".into()),
            Choice::Only(effects) if effects.is_empty() => Self::One("none".into()),
            Choice::Only(effects) => {
                Self::Many(effects.into_iter().map(|e| e.name().to_string()).collect())
            }
        }
    }
}

/// What leaving effects out may change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// RMS difference of the sub-pixels' values over their mean, %.
    pub signal_percent: f64,
    /// Shift of what a sub-pixel sees, px.
    pub shift_px: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self {
            signal_percent: 0.5,
            shift_px: 0.02,
        }
    }
}

impl Tolerance {
    /// Whether it is the usual one.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Whether both numbers are 0 or more and finite; the message names what is not.
    ///
    /// # Errors
    /// The field, its value and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let fields = [
            ("tolerance.signal_percent", self.signal_percent),
            ("tolerance.shift_px", self.shift_px),
        ];
        let bad = fields.iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite()));
        bad.map_or(Ok(()), |(field, value)| {
            Err(format!("{field} is {value}; allowed: 0 or more"))
        })
    }

    /// Whether an estimate is below it. What was not estimated is not.
    pub(super) fn allows(&self, estimate: &Estimate) -> bool {
        let shift = estimate.shift_px.is_none_or(|s| s < self.shift_px);
        shift
            && estimate
                .signal_percent
                .is_some_and(|s| s < self.signal_percent)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn choices_are_words_or_lists_and_come_back() {
        for (text, json) in [
            ("auto", "\"auto\""),
            ("all", "\"all\""),
            ("none", "\"none\""),
            ("dispersion,noise", "[\"dispersion\",\"noise\"]"),
        ] {
            let choice: Choice = text.parse().unwrap();
            assert_eq!(serde_json::to_string(&choice).unwrap(), json);
            assert_eq!(serde_json::from_str::<Choice>(json).unwrap(), choice);
        }
        let error = "dispersion,glare"
            .parse::<Choice>()
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("`glare`") && error.contains("cra-variation"),
            "{error}"
        );
        assert!(serde_json::from_str::<Choice>("[\"all\"]").is_err());
    }

    #[test]
    fn a_tolerance_of_nothing_allows_nothing_and_nan_is_none() {
        let small = Estimate {
            signal_percent: Some(0.0),
            shift_px: Some(0.0),
        };
        let zero = Tolerance {
            signal_percent: 0.0,
            shift_px: 0.0,
        };
        assert!(Tolerance::default().allows(&small) && !zero.allows(&small));
        let nan = Estimate {
            signal_percent: Some(f64::NAN),
            shift_px: None,
        };
        assert!(!Tolerance::default().allows(&nan));
        let undecided = Estimate {
            signal_percent: None,
            shift_px: Some(0.0),
        };
        assert!(!Tolerance::default().allows(&undecided));
        for bad in [f64::NAN, -1.0, f64::INFINITY] {
            let t = Tolerance {
                signal_percent: bad,
                shift_px: 0.1,
            };
            assert!(t.check().unwrap_err().contains("signal_percent"));
        }
    }
}
