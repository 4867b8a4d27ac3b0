//! One part of n of work that falls into numbered units (samples, directions), so that n machines can share it. A unit belongs to
//! exactly one part, whatever the other parts do; what a unit yields does not depend on the part that computes it.

use std::fmt;
use std::str::FromStr;

/// Part `i` of `n`, written `i/n` and counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 0.
    index: usize,
    of: usize,
}

/// A part that there is not.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardError {
    /// The text of a part.
    #[error("shard is `{0}`; allowed: i/n with i from 1 to n, such as 2/4")]
    Text(String),
    /// An environment variable that is no such number.
    #[error("{name} is `{value}`; allowed: {allowed}")]
    Variable {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it may be.
        allowed: String,
    },
    /// A task's number without the number of tasks.
    #[error("{0} is set, but the number of tasks is not; set {COUNT} to it, or give --shard i/n")]
    NoCount(&'static str),
}

/// Number of tasks, for schedulers that do not tell it and for a task that is run again alone.
const COUNT: &str = "QUADPIXEL_SHARDS";
const SLURM_TASK: &str = "SLURM_ARRAY_TASK_ID";
const SLURM_COUNT: &str = "SLURM_ARRAY_TASK_COUNT";
const SLURM_FIRST: &str = "SLURM_ARRAY_TASK_MIN";
const SLURM_STEP: &str = "SLURM_ARRAY_TASK_STEP";
const KUBERNETES_TASK: &str = "JOB_COMPLETION_INDEX";
const KUBERNETES_COUNT: &str = "JOB_COMPLETION_COUNT";

impl Shard {
    /// All of the work.
    pub const WHOLE: Self = Self { index: 0, of: 1 };

    /// Part `number` (from 1) of `of`.
    ///
    /// # Errors
    /// A number that is 0 or above `of`.
    pub fn new(number: usize, of: usize) -> Result<Self, ShardError> {
        match number.checked_sub(1) {
            Some(index) if index < of => Ok(Self { index, of }),
            _ => Err(ShardError::Text(format!("{number}/{of}"))),
        }
    }

    /// The part's number, from 1.
    pub fn number(self) -> usize {
        self.index + 1
    }

    /// How many parts there are.
    pub fn of(self) -> usize {
        self.of
    }

    /// Whether it is all of the work.
    pub fn is_whole(self) -> bool {
        self.of == 1
    }

    /// Whether unit `unit` (from 0) belongs to this part: every `of`-th does, so that parts are alike in size and difficulty.
    pub fn owns(self, unit: usize) -> bool {
        unit % self.of == self.index
    }

    /// The part that a scheduler's task is, by its environment; `None` outside of one. `variable` reads a variable.
    ///
    /// - `QUADPIXEL_SHARDS` = n: the task's number (`SLURM_ARRAY_TASK_ID`, else `JOB_COMPLETION_INDEX`) counts from 0 to n − 1. A
    ///   single task can be submitted again this way.
    /// - Slurm: `(SLURM_ARRAY_TASK_ID − SLURM_ARRAY_TASK_MIN) / SLURM_ARRAY_TASK_STEP` of `SLURM_ARRAY_TASK_COUNT`.
    /// - Kubernetes: `JOB_COMPLETION_INDEX`, from 0, of `JOB_COMPLETION_COUNT`, which the job's file has to set.
    ///
    /// # Errors
    /// A number that is none or that is out of range, or a task's number without their count.
    pub fn from_environment(
        variable: &dyn Fn(&'static str) -> Option<String>,
    ) -> Result<Option<Self>, ShardError> {
        let slurm = number(variable, SLURM_TASK)?;
        let Some((name, task)) =
            slurm
                .map(|task| (SLURM_TASK, task))
                .or(number(variable, KUBERNETES_TASK)?.map(|task| (KUBERNETES_TASK, task)))
        else {
            return Ok(None);
        };
        let (place, of) = match (number(variable, COUNT)?, name) {
            (Some(of), _) => (Some(task), of),
            (None, SLURM_TASK) => {
                let of = number(variable, SLURM_COUNT)?.ok_or(ShardError::NoCount(name))?;
                let first = number(variable, SLURM_FIRST)?.unwrap_or(0);
                let step = number(variable, SLURM_STEP)?.unwrap_or(1).max(1);
                (task.checked_sub(first).map(|t| t / step), of)
            }
            (None, _) => {
                let of = number(variable, KUBERNETES_COUNT)?.ok_or(ShardError::NoCount(name))?;
                (Some(task), of)
            }
        };
        match place {
            Some(index) if index < of => Ok(Some(Self { index, of })),
            _ => Err(ShardError::Variable {
                name,
                value: task.to_string(),
                allowed: format!(
                    "an unbroken range of {of} tasks (to run one again alone, number them from 0 and set {COUNT})"
                ),
            }),
        }
    }
}

fn number(
    variable: &dyn Fn(&'static str) -> Option<String>,
    name: &'static str,
) -> Result<Option<usize>, ShardError> {
    let Some(value) = variable(name).filter(|v| !v.is_empty()) else {
        return Ok(None);
    };
    match value.parse() {
        Ok(number) => Ok(Some(number)),
        Err(_) => Err(ShardError::Variable {
            name,
            value,
            allowed: "a whole number from 0".into(),
        }),
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parts = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        let wrong = || ShardError::Text(text.to_owned());
        let (number, of) = parts.ok_or_else(wrong)?;
        Self::new(number, of).map_err(|_| wrong())
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number(), self.of)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn of(variables: &[(&'static str, &str)]) -> Result<Option<Shard>, ShardError> {
        Shard::from_environment(&|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        })
    }

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

    #[test]
    fn schedulers_number_their_tasks_from_where_they_like() {
        assert_eq!(of(&[]).unwrap(), None);
        assert_eq!(of(&[(COUNT, "4")]).unwrap(), None);
        for (task, first, step) in [("2", "0", "1"), ("3", "1", "1"), ("15", "11", "2")] {
            let slurm = [
                (SLURM_TASK, task),
                (SLURM_COUNT, "4"),
                (SLURM_FIRST, first),
                (SLURM_STEP, step),
            ];
            assert_eq!(of(&slurm).unwrap().unwrap().to_string(), "3/4");
        }
        let job = [(KUBERNETES_TASK, "0"), (KUBERNETES_COUNT, "3")];
        assert_eq!(of(&job).unwrap().unwrap().to_string(), "1/3");
        let job = [(KUBERNETES_TASK, "2"), (COUNT, "3")];
        assert_eq!(of(&job).unwrap().unwrap().to_string(), "3/3");
    }

    #[test]
    fn one_task_submitted_again_alone_is_not_the_whole() {
        // Slurm then says that there is 1 task, and that the first is number 3.
        let again = [
            (SLURM_TASK, "3"),
            (SLURM_COUNT, "1"),
            (SLURM_FIRST, "3"),
            (COUNT, "4"),
        ];
        assert_eq!(of(&again).unwrap().unwrap().to_string(), "4/4");
    }

    #[test]
    fn a_task_without_a_count_or_out_of_range_is_refused() {
        for bad in [
            vec![(SLURM_TASK, "1")],
            vec![(KUBERNETES_TASK, "1")],
            vec![(KUBERNETES_TASK, "3"), (KUBERNETES_COUNT, "3")],
            vec![(SLURM_TASK, "7"), (SLURM_COUNT, "3"), (SLURM_FIRST, "1")],
            vec![(SLURM_TASK, "x"), (SLURM_COUNT, "3")],
            vec![(SLURM_TASK, "0"), (COUNT, "0")],
        ] {
            assert!(of(&bad).is_err(), "{bad:?}");
        }
    }
}
