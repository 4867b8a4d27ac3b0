//! One part of n of work that falls into numbered units (samples, directions), so that n machines can share it. A unit
//! belongs to exactly one part, whatever the other parts do; what a unit yields does not depend on the part that
//! computes it.

use std::fmt;
use std::str::FromStr;

/// Part `i` of `n`, written `i/n` and counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    index: usize,
    count: usize,
}

/// A part that there is not.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("shard is `{text}`; allowed: i/n with i from 1 to n, such as 2/4")]
pub struct ShardError {
    /// What was given.
    pub text: String,
}

impl Shard {
    /// All of the work.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// Part `number` (from 1) of `count`.
    ///
    /// # Errors
    /// A number that is 0 or above `count`.
    pub fn new(number: usize, count: usize) -> Result<Self, ShardError> {
        match number.checked_sub(1) {
            Some(index) if index < count => Ok(Self { index, count }),
            _ => Err(ShardError {
                text: format!("{number}/{count}"),
            }),
        }
    }

    /// The part's number, from 1.
    pub fn number(self) -> usize {
        self.index + 1
    }

    /// How many parts there are.
    pub fn count(self) -> usize {
        self.count
    }

    /// Whether it is all of the work.
    pub fn is_whole(self) -> bool {
        self.count == 1
    }

    /// Whether unit `unit` (from 0) belongs to this part: every `count`-th does, so that parts are alike in size and
    /// difficulty.
    pub fn owns(self, unit: usize) -> bool {
        unit % self.count == self.index
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parts = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let wrong = || ShardError {
            text: text.to_owned(),
        };
        let (number, count) = parts.ok_or_else(wrong)?;
        Self::new(number, count).map_err(|_| wrong())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number(), self.count)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_in_exactly_one_part() {
        for n in 1..8 {
            let parts: Vec<Shard> = (1..=n).map(|i| Shard::new(i, n).unwrap()).collect();
            for unit in 0..50 {
                assert_eq!(parts.iter().filter(|p| p.owns(unit)).count(), 1);
            }
        }
    }

    #[test]
    fn a_part_is_written_and_read_from_1_to_n() {
        assert_eq!("2/4".parse::<Shard>().unwrap().to_string(), "2/4");
        assert!("1/1".parse::<Shard>().unwrap().is_whole());
        for bad in ["0/4", "5/4", "1/0", "2", "a/4", "-1/4", "1/4/2", ""] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
