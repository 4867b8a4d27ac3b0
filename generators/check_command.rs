//! `qpgen check`: is a dataset what its specification says?

use std::path::PathBuf;

use clap::Args;

use quadpixel::command::CommandError;

/// Arguments of `qpgen check`.
#[derive(Args)]
pub struct CheckArgs {
    /// Folder of the dataset.
    folder: PathBuf,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Checks, and prints what is wrong; nothing wrong is exit code 0.
///
/// # Errors
/// A folder that is not there (2), or findings (1).
pub fn run(args: &CheckArgs) -> Result<(), CommandError> {
    let name = args.folder.display();
    if !args.folder.is_dir() {
        return Err(CommandError::input(format!(
            "{name}: is no folder; allowed: the folder of a dataset"
        )));
    }
    let bar = indicatif::ProgressBar::new(0);
    let report = datasets_spec::check_dataset(&args.folder, &mut |p| {
        bar.set_length(p.total as u64);
        bar.set_position(p.done as u64);
    });
    bar.finish_and_clear();
    if args.json {
        let findings: Vec<_> = report
            .findings
            .iter()
            .map(|f| serde_json::json!({ "path": f.path, "what": f.what }))
            .collect();
        let object = serde_json::json!({
            "samples": report.samples, "files": report.files, "bytes": report.bytes, "findings": findings
        });
        println!("{object}");
    } else {
        report.findings.iter().for_each(|f| println!("{f}"));
        let megabytes = report.bytes as f64 * 1e-6;
        println!(
            "{} samples, {} files, {megabytes:.1} MB: {} findings",
            report.samples,
            report.files,
            report.findings.len()
        );
    }
    match report.findings.len() {
        0 => Ok(()),
        n => Err(CommandError::failed(format!("{name}: {n} findings"))),
    }
}
