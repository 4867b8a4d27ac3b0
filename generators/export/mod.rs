//! `qpgen export`: a dataset in the layouts that published training code reads.
//!
//! An export is made beside its name and renamed when it is whole; every file of the dataset is held to its hash on the way.

mod dpdd;
mod pictures;
mod qpdnet;
mod source;
mod webdataset;

use std::fs;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use quadpixel::command::CommandError;
use quadpixel::file;
use rayon::prelude::*;

use source::{Sample, Source};

/// Arguments of `qpgen export`.
#[derive(Args)]
pub struct ExportArgs {
    /// Folder of the dataset.
    dataset: PathBuf,
    /// Layout to write.
    #[arg(long, value_enum)]
    layout: Layout,
    /// New folder to write.
    #[arg(long, short)]
    out: PathBuf,
    /// Writes the noisy captures instead of the clean ones (dpdd, qpdnet; a webdataset has both).
    #[arg(long)]
    noisy: bool,
    /// Largest size of a tar shard, MB; a sample is never split (webdataset).
    #[arg(long, default_value_t = 512)]
    shard_mb: u64,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Layout {
    /// `{train,val,test}_{c,l,r}/{source,target}/NAME.png`, 16-bit sRGB: sum, left and right half; the all-in-focus target.
    Dpdd,
    /// `{set}_{c,l,r,t,b}/source/seq_NNN/NAME.png`, 8-bit sRGB, and `{set}_c/target_disp/seq_NNN/NAME.npy`, x_L − x_R in px.
    Qpdnet,
    /// `{set}-NNNNNN.tar` of `NAME.FILE` members, the dataset's own files, with a wids index `{set}.json`.
    Webdataset,
}

/// What an export did.
#[derive(Clone, Copy, Debug, Default)]
struct Written {
    files: u64,
    bytes: u64,
    /// Values above white, stored as white.
    clipped: u64,
}

impl Written {
    fn plus(self, other: Self) -> Self {
        Self {
            files: self.files + other.files,
            bytes: self.bytes + other.bytes,
            clipped: self.clipped + other.clipped,
        }
    }
}

/// Exports a dataset.
///
/// # Errors
/// A folder that is no dataset or a file that differs from its hash (2), or a disk that fails (1). Nothing is left under the name then.
pub fn run(args: &ExportArgs) -> Result<(), CommandError> {
    let out = &args.out;
    if out.exists() {
        return Err(CommandError::input(format!(
            "--out {}: is there already; allowed: a new folder",
            out.display()
        )));
    }
    let source = Source::open(&args.dataset)?;
    let aside = file::aside(out);
    let bar = indicatif::ProgressBar::new(source.entries().len() as u64);
    let written = write(args, &source, &aside, &|| bar.inc(1));
    bar.finish_and_clear();
    let done = written.and_then(|written| {
        let rename = fs::rename(&aside, out);
        rename
            .map_err(|e| CommandError::failed(format!("{}: cannot write: {e}", out.display())))?;
        Ok(written)
    });
    if done.is_err() {
        // The first error is the one to tell; a leftover that cannot be removed changes nothing about it.
        let _ = fs::remove_dir_all(&aside);
    }
    let written = done?;
    let samples = source.entries().len();
    if args.json {
        let object = serde_json::json!({
            "samples": samples, "files": written.files, "bytes": written.bytes, "clipped": written.clipped, "out": out
        });
        println!("{object}");
    } else {
        let megabytes = written.bytes as f64 * 1e-6;
        println!(
            "{samples} samples, {} files, {megabytes:.1} MB, {} values above white: {}",
            written.files,
            written.clipped,
            out.display()
        );
    }
    Ok(())
}

fn write(
    args: &ExportArgs,
    source: &Source,
    root: &Path,
    progress: &(dyn Fn() + Sync),
) -> Result<Written, CommandError> {
    if args.shard_mb == 0 {
        return Err(CommandError::input("--shard-mb is 0; allowed: at least 1"));
    }
    file::create_folder(root).map_err(CommandError::failed)?;
    let (written, conventions) = match args.layout {
        Layout::Dpdd => {
            let each = |sample: &Sample<'_>| dpdd::write(sample, root, args.noisy);
            (each_sample(source, &each, progress)?, dpdd::CONVENTIONS)
        }
        Layout::Qpdnet => {
            let sequences = qpdnet::Sequences::of(source.entries());
            let each = |sample: &Sample<'_>| qpdnet::write(sample, &sequences, root, args.noisy);
            (each_sample(source, &each, progress)?, qpdnet::CONVENTIONS)
        }
        Layout::Webdataset => (
            webdataset::write(source, root, args.shard_mb * 1_000_000, progress)?,
            webdataset::CONVENTIONS,
        ),
    };
    let index = serde_json::json!({
        "layout": args.layout.to_possible_value().map(|v| v.get_name().to_string()),
        "dataset_blake3": source.hash(),
        "images": if args.noisy { "noisy" } else { "clean" },
        "samples": source.entries().len(),
        "clipped": written.clipped,
        "licence": source.licence(),
        "conventions": conventions,
    });
    let text = format!("{index:#}\n");
    file::write_aside(&root.join("export.json"), text.as_bytes()).map_err(CommandError::failed)?;
    Ok(written)
}

/// All samples, in parallel: each writes files of its own.
fn each_sample(
    source: &Source,
    write: &(dyn Fn(&Sample<'_>) -> Result<Written, CommandError> + Sync),
    progress: &(dyn Fn() + Sync),
) -> Result<Written, CommandError> {
    let one = |entry| {
        let written = write(&source.sample(entry)?)?;
        progress();
        Ok(written)
    };
    let all = source.entries().par_iter().map(one);
    all.try_reduce(Written::default, |a, b| Ok(a.plus(b)))
}

/// Writes a file of the export and its folders.
fn put(root: &Path, path: &str, bytes: &[u8]) -> Result<Written, CommandError> {
    let path = root.join(path);
    if let Some(folder) = path.parent() {
        file::create_folder(folder).map_err(CommandError::failed)?;
    }
    fs::write(&path, bytes)
        .map_err(|e| CommandError::failed(format!("{}: cannot write: {e}", path.display())))?;
    Ok(Written {
        files: 1,
        bytes: bytes.len() as u64,
        clipped: 0,
    })
}
