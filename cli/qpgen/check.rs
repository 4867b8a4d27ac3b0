//! `qpgen check`: is a dataset what its specification says?

use crate::outln;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::exit::CommandError;
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use quadpixel_datasets::{Progress, Report, check_dataset, check_hashes};

use crate::log::{Level, Log};

/// How often progress is told of where no bar is drawn.
const TOLD_EVERY: Duration = Duration::from_secs(10);

/// Arguments of `qpgen check`.
#[derive(Args)]
pub struct CheckArgs {
    /// Folder of the dataset.
    folder: PathBuf,
    /// Checks lengths and hashes only, as fast as the disk reads; absent: also that every picture decodes and keeps the
    /// rules.
    #[arg(long)]
    hashes: bool,
    /// Prints one JSON object on stdout, and progress as one JSON object per line on stderr.
    #[arg(long)]
    pub json: bool,
}

/// Checks, and prints what is wrong; nothing wrong is exit code 0.
///
/// # Errors
/// A folder that is not there (2), or findings (1).
pub fn run(args: &CheckArgs, log: Log) -> Result<(), CommandError> {
    let depth = if args.hashes {
        check_hashes
    } else {
        check_dataset
    };
    check(&args.folder, depth, log, args.json)
}

/// A check of a dataset.
pub(crate) type Depth = fn(&Path, &mut (dyn FnMut(Progress) + Send)) -> Report;

/// As [`run`].
///
/// # Errors
/// As there.
pub(crate) fn check(folder: &Path, depth: Depth, log: Log, json: bool) -> Result<(), CommandError> {
    let name = folder.display();
    if !folder.is_dir() {
        return Err(CommandError::input(format!(
            "{name}: is no folder; allowed: the folder of a dataset"
        )));
    }
    let log = log.json(json);
    let began = Instant::now();
    let bar = bar(log);
    let mut told = began;
    let report = depth(folder, &mut |p| {
        bar.set_length(p.total as u64);
        bar.set_position(p.done as u64);
        if bar.is_hidden() && told.elapsed() > TOLD_EVERY {
            told = Instant::now();
            let fields = [
                ("event", "check".into()),
                ("done", p.done.into()),
                ("of", p.total.into()),
                ("seconds", began.elapsed().as_secs_f64().into()),
            ];
            let text = format!("checked {}/{} files", p.done, p.total);
            log.line(Level::Info, &text, &fields);
        }
    });
    bar.finish_and_clear();
    let seconds = began.elapsed().as_secs_f64();
    if json {
        let findings: Vec<_> = report
            .findings
            .iter()
            .map(|f| serde_json::json!({ "path": f.path, "what": f.what }))
            .collect();
        let object = serde_json::json!({
            "samples": report.samples, "files": report.files, "bytes": report.bytes, "seconds": seconds, "findings": findings
        });
        outln!("{object}");
    } else {
        for finding in &report.findings {
            outln!("{finding}");
        }
        let megabytes = report.bytes as f64 * 1e-6;
        outln!(
            "{} samples, {} files, {megabytes:.1} MB in {seconds:.1} s ({:.0} MB/s): {} findings",
            report.samples,
            report.files,
            megabytes / seconds.max(1e-9),
            report.findings.len()
        );
    }
    match report.findings.len() {
        0 => Ok(()),
        n => Err(CommandError::failed(format!("{name}: {n} findings"))),
    }
}

/// A bar over files, on a terminal.
fn bar(log: Log) -> ProgressBar {
    let target = match log.says(Level::Info) && !log.json {
        true => ProgressDrawTarget::stderr(),
        false => ProgressDrawTarget::hidden(),
    };
    let bar = ProgressBar::with_draw_target(Some(0), target);
    match ProgressStyle::with_template("{pos}/{len} files {wide_bar} {percent}% · {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}
