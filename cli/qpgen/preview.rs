//! `qpgen preview`: gallery and data card anew, also of a run that is not at its end.

use std::path::PathBuf;

use clap::Args;
use quadpixel::file;
use quadpixel_cli::exit::CommandError;
use quadpixel_datasets::{DatasetManifest, paths};

use quadpixel_generators::production::dataset::LICENCE;
use quadpixel_generators::writer::rebuild_pages;

/// Arguments of `qpgen preview`.
#[derive(Args)]
pub struct PreviewArgs {
    /// Folder of a dataset, of a run in progress, or of a shard.
    #[arg(default_value = "out")]
    folder: PathBuf,
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
    if !args.folder.join(paths::SAMPLES).is_dir() {
        return Err(CommandError::input(format!(
            "{name}: holds no samples; allowed: the folder of a dataset"
        )));
    }
    let path = args.folder.join(paths::DATASET);
    let unfinished = args.folder.join(paths::RUN).is_file();
    let manifest = (path.is_file() && !unfinished).then(|| {
        let bytes = file::read(&path)?;
        serde_json::from_slice::<DatasetManifest>(&bytes)
            .map_err(|e| CommandError::input(format!("{}: {e}", path.display())))
    });
    let manifest = manifest.transpose()?;
    let licence = manifest
        .as_ref()
        .map_or(LICENCE.to_string(), |m| m.licence.clone());
    let samples = rebuild_pages(&args.folder, manifest, &licence)?;
    let gallery = args.folder.join(paths::INDEX).display().to_string();
    if args.json {
        println!(
            "{}",
            serde_json::json!({ "samples": samples, "gallery": gallery })
        );
    } else {
        println!("{samples} samples; gallery: {gallery}");
    }
    Ok(())
}
