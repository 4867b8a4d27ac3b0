//! `qpgen merge`: joins the shards of a dataset and checks the whole.

use std::path::PathBuf;

use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use clap::Args;
use quadpixel_generators::production::merge::merge;

use crate::qpgen::check;
use crate::qpgen::dataset::foreign;

/// Arguments of `qpgen merge`.
#[derive(Args)]
pub struct MergeArgs {
    /// Folder of the dataset: the --out of the shards.
    #[arg(default_value = "out")]
    out: PathBuf,
    /// Folders of shards that lie elsewhere; they are copied. Absent: the shards in the dataset's folder, which are
    /// moved.
    #[arg(long, num_args = 1.., value_name = "FOLDER")]
    from: Vec<PathBuf>,
    /// Removes files of others with the folders of the shards, and replaces those where the gallery, the data card and
    /// the lists go; absent: such a file ends the command.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end, and progress as one JSON object per line on stderr.
    #[arg(long)]
    pub json: bool,
}

/// Joins the shards, then checks.
///
/// # Errors
/// As of [`merge`], or findings of the check (1).
pub fn run(args: &MergeArgs, log: Log) -> Result<(), CommandError> {
    let progress = Progress::new(log.json(args.json));
    merge(&args.out, &args.from, foreign(args.force), &progress)?;
    check::check(&args.out, quadpixel_datasets::check_dataset, log, args.json)
}
