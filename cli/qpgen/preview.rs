//! `qpgen preview`: gallery and data card anew, also of a run that is not at its end.

use crate::outln;
use std::path::PathBuf;

use crate::exit::CommandError;
use clap::Args;
use quadpixel_datasets::paths;

use crate::qpgen::dataset::foreign;
use quadpixel_generators::production::dataset::LICENCE;
use quadpixel_generators::writer::rebuild_pages;

/// Arguments of `qpgen preview`.
#[derive(Args)]
pub struct PreviewArgs {
    /// Folder of a dataset, of a run in progress, or of a shard.
    #[arg(default_value = "out")]
    folder: PathBuf,
    /// Replaces files of others where the gallery (index.html) and the data card (README.md, plots/) go; absent: such a
    /// file ends the command.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Rebuilds `index.html`, `README.md` and the plots from the samples' descriptions.
///
/// # Errors
/// A folder without samples (2), or the disk (1).
pub fn run(args: &PreviewArgs) -> Result<(), CommandError> {
    let name = args.folder.display();
    if !args.folder.join(paths::SAMPLES).is_dir() && !args.folder.join(paths::RUN).is_file() {
        return Err(CommandError::input(format!(
            "{name}: holds no samples; allowed: the folder of a dataset"
        )));
    }
    let samples = rebuild_pages(&args.folder, LICENCE, foreign(args.force))?;
    let gallery = args.folder.join(paths::INDEX).display().to_string();
    if args.json {
        outln!(
            "{}",
            serde_json::json!({ "samples": samples, "gallery": gallery })
        );
    } else {
        outln!("{samples} samples; gallery: {gallery}");
    }
    Ok(())
}
