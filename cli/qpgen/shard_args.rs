//! `--shard`, or what the scheduler's environment says.

use clap::Args;
use quadpixel::command::CommandError;
use quadpixel::shard::Shard;

use quadpixel_generators::progress::Progress;

/// Arguments of commands that share their work.
#[derive(Args)]
pub struct ShardArgs {
    /// Makes only part I (counted from 1) of N, such as 2/4; 1/1: all. Absent: the part that SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT, or
    /// JOB_COMPLETION_INDEX and JOB_COMPLETION_COUNT say (QUADPIXEL_SHARDS replaces either count); without these, all.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
}

impl ShardArgs {
    /// The part to do; tells of it where the environment said so.
    ///
    /// # Errors
    /// An environment that makes no sense (2).
    pub fn shard(&self, progress: &Progress) -> Result<Shard, CommandError> {
        if let Some(shard) = self.shard {
            return Ok(shard);
        }
        let variable = |name| std::env::var(name).ok();
        let found = Shard::from_environment(&variable).map_err(CommandError::input)?;
        let shard = found.unwrap_or(Shard::WHOLE);
        if !shard.is_whole() {
            progress.info(&format!("shard {shard}, by the scheduler's environment"));
        }
        Ok(shard)
    }
}
