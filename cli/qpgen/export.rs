//! `qpgen export`: arguments, and what is printed.

use crate::outln;
use std::path::PathBuf;

use crate::exit::CommandError;
use crate::stop::Stop;
use clap::{Args, ValueEnum};
use indicatif::ProgressBar;
use quadpixel_generators::export::{self, ExportSettings, Layout};
use quadpixel_generators::observer::{Event, Observer};

/// Size of a tar shard where none is given, and the largest, MB.
const SHARD_MB: u64 = 512;
const LARGEST_SHARD_MB: u64 = 1_000_000;

/// Arguments of `qpgen export`.
#[derive(Args)]
pub struct ExportArgs {
    /// Folder of the dataset.
    dataset: PathBuf,
    /// Layout to write.
    #[arg(long, value_enum)]
    layout: LayoutName,
    /// New folder to write.
    #[arg(long, short)]
    out: PathBuf,
    /// Writes the noisy captures instead of the clean ones (dpdd, qpdnet; a webdataset has both).
    #[arg(long)]
    noisy: bool,
    /// Largest size of a tar shard, MB; a sample is never split (webdataset) [default: 512].
    #[arg(long)]
    shard_mb: Option<u64>,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

/// What is written.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum LayoutName {
    /// `{train,val,test}_{c,l,r}/{source,target}/NAME.png`, 16-bit sRGB: sum, left and right half; the all-in-focus
    /// target.
    Dpdd,
    /// `{set}_{c,l,r,t,b}/source/seq_NNN/NAME.png`, 8-bit sRGB, and `{set}_c/target_disp/seq_NNN/NAME.npy`, x_L − x_R
    /// in px.
    Qpdnet,
    /// `{set}-NNNNNN.tar` of `NAME.FILE` members, the dataset's own files, with a wids index `{set}.json`.
    Webdataset,
}

impl LayoutName {
    fn layout(self) -> Layout {
        match self {
            Self::Dpdd => Layout::Dpdd,
            Self::Qpdnet => Layout::Qpdnet,
            Self::Webdataset => Layout::Webdataset,
        }
    }
}

/// A bar over samples, on a terminal; and whether a signal asked to stop.
struct Bar(ProgressBar, Stop);

impl Observer for Bar {
    fn event(&self, event: Event<'_>) {
        match event {
            Event::Start { samples, .. } => self.0.set_length(samples as u64),
            Event::SampleDone => self.0.inc(1),
            Event::End => self.0.finish_and_clear(),
            _ => {}
        }
    }

    fn stop_asked(&self) -> bool {
        self.1.is_asked()
    }
}

/// Exports a dataset, and prints what was written.
///
/// # Errors
/// A folder that is no dataset or a file that differs from its hash (2), or a disk that fails (1).
pub fn run(args: &ExportArgs) -> Result<(), CommandError> {
    let megabytes = args.shard_mb.unwrap_or(SHARD_MB);
    if !(1..=LARGEST_SHARD_MB).contains(&megabytes) {
        return Err(CommandError::input(format!(
            "--shard-mb is {megabytes}; allowed: 1 to {LARGEST_SHARD_MB}"
        )));
    }
    if args.shard_mb.is_some() && args.layout != LayoutName::Webdataset {
        return Err(CommandError::input(
            "--shard-mb: only webdataset has shards; allowed: --layout webdataset",
        ));
    }
    let settings = ExportSettings {
        layout: args.layout.layout(),
        noisy: args.noisy,
        shard_bytes: megabytes * 1_000_000,
    };
    let done = export::export(
        &args.dataset,
        &args.out,
        &settings,
        &Bar(ProgressBar::new(0), Stop::on_signals()?),
    )?;
    if args.json {
        let object = serde_json::json!({
            "samples": done.samples, "files": done.files, "bytes": done.bytes, "clipped": done.clipped,
            "out": args.out.display().to_string()
        });
        outln!("{object}");
    } else {
        let megabytes = done.bytes as f64 * 1e-6;
        outln!(
            "{} samples, {} files, {megabytes:.1} MB, {} values above white: {}",
            done.samples,
            done.files,
            done.clipped,
            args.out.display()
        );
    }
    Ok(())
}
