//! `--shard`, or the part of the work that the scheduler's environment names.

use crate::exit::CommandError;
use clap::Args;
use quadpixel::shard::Shard;

use crate::progress::Progress;

/// Arguments of commands that share their work.
#[derive(Args)]
pub struct ShardArgs {
    /// Makes only part I (counted from 1) of N, such as 2/4; 1/1: all. Absent: the part that SLURM_ARRAY_TASK_ID and
    /// SLURM_ARRAY_TASK_COUNT, or JOB_COMPLETION_INDEX and JOB_COMPLETION_COUNT say (QUADPIXEL_SHARDS replaces either
    /// count); without these, all.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

impl ShardArgs {
    /// The part to do; reports it where the environment named it.
    ///
    /// # Errors
    /// An environment that makes no sense (2).
    pub fn shard(&self, progress: &Progress) -> Result<Shard, CommandError> {
        if let Some(shard) = self.shard {
            return Ok(shard);
        }
        let variable = |name| std::env::var(name).ok();
        let shard = from_environment(&variable).map_err(CommandError::input)?;
        let shard = shard.unwrap_or(Shard::WHOLE);
        if !shard.is_whole() {
            progress.info(&format!("shard {shard}, by the scheduler's environment"));
        }
        Ok(shard)
    }
}

/// Why the environment names no part.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ShardEnvError {
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

/// The part that a scheduler's task is, by its environment; `None` outside of one. `variable` reads a variable.
///
/// - `QUADPIXEL_SHARDS` = n: the task's number (`SLURM_ARRAY_TASK_ID`, else `JOB_COMPLETION_INDEX`) counts from 0 to n
///   − 1. A single task can be submitted again this way.
/// - Slurm: `(SLURM_ARRAY_TASK_ID − SLURM_ARRAY_TASK_MIN) / SLURM_ARRAY_TASK_STEP` of `SLURM_ARRAY_TASK_COUNT`.
/// - Kubernetes: `JOB_COMPLETION_INDEX`, from 0, of `JOB_COMPLETION_COUNT`, which the job's file has to set.
///
/// # Errors
/// A number that is none or that is out of range, or a task's number without their count.
fn from_environment(
    variable: &dyn Fn(&'static str) -> Option<String>,
) -> Result<Option<Shard>, ShardEnvError> {
    let slurm = number(variable, SLURM_TASK)?;
    let Some((name, task)) =
        slurm
            .map(|task| (SLURM_TASK, task))
            .or(number(variable, KUBERNETES_TASK)?.map(|task| (KUBERNETES_TASK, task)))
    else {
        return Ok(None);
    };
    let (index, count) = match (number(variable, COUNT)?, name) {
        (Some(count), _) => (Some(task), count),
        (None, SLURM_TASK) => {
            let count = number(variable, SLURM_COUNT)?.ok_or(ShardEnvError::NoCount(name))?;
            let first = number(variable, SLURM_FIRST)?.unwrap_or(0);
            let step = number(variable, SLURM_STEP)?.unwrap_or(1).max(1);
            (task.checked_sub(first).map(|t| t / step), count)
        }
        (None, _) => {
            let count = number(variable, KUBERNETES_COUNT)?.ok_or(ShardEnvError::NoCount(name))?;
            (Some(task), count)
        }
    };
    let shard = index.and_then(|index| Shard::new(index + 1, count).ok());
    shard.map(Some).ok_or_else(|| ShardEnvError::Variable {
        name,
        value: task.to_string(),
        allowed: format!(
            "an unbroken range of {count} tasks (to run one again alone, number them from 0 and set {COUNT})"
        ),
    })
}

fn number(
    variable: &dyn Fn(&'static str) -> Option<String>,
    name: &'static str,
) -> Result<Option<usize>, ShardEnvError> {
    let Some(value) = variable(name).filter(|v| !v.is_empty()) else {
        return Ok(None);
    };
    match value.parse() {
        Ok(number) => Ok(Some(number)),
        Err(_) => Err(ShardEnvError::Variable {
            name,
            value,
            allowed: "a whole number from 0".into(),
        }),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn shard(variables: &[(&'static str, &str)]) -> Result<Option<Shard>, ShardEnvError> {
        from_environment(&|name| {
            let pair = variables.iter().find(|(known, _)| *known == name);
            pair.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn schedulers_number_their_tasks_from_where_they_like() {
        assert_eq!(shard(&[]).unwrap(), None);
        assert_eq!(shard(&[(COUNT, "4")]).unwrap(), None);
        for (task, first, step) in [("2", "0", "1"), ("3", "1", "1"), ("15", "11", "2")] {
            let slurm = [
                (SLURM_TASK, task),
                (SLURM_COUNT, "4"),
                (SLURM_FIRST, first),
                (SLURM_STEP, step),
            ];
            assert_eq!(shard(&slurm).unwrap().unwrap().to_string(), "3/4");
        }
        let job = [(KUBERNETES_TASK, "0"), (KUBERNETES_COUNT, "3")];
        assert_eq!(shard(&job).unwrap().unwrap().to_string(), "1/3");
        let job = [(KUBERNETES_TASK, "2"), (COUNT, "3")];
        assert_eq!(shard(&job).unwrap().unwrap().to_string(), "3/3");
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
        assert_eq!(shard(&again).unwrap().unwrap().to_string(), "4/4");
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
            assert!(shard(&bad).is_err(), "{bad:?}");
        }
    }
}
