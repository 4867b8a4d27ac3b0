//! `qpgen check`: is a dataset what its specification says?

use std::path::PathBuf;

use clap::Args;

use crate::command_error::CommandError;

/// Arguments of `qpgen check`.
#[derive(Args)]
pub struct CheckArgs {
    /// Folder of the dataset.
    folder: PathBuf,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}
