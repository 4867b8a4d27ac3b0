//! A dataset in the layouts that published training code reads.
//!
//! An export is made beside its name and renamed when it is whole; every file of the dataset is held to its hash on the
//! way.

mod dpdd;
mod error;
mod pictures;
mod qpdnet;
mod source;
mod webdataset;
mod written;

use std::path::Path;

use quadpixel::file::{self, FolderAside};
use rayon::prelude::*;

use crate::observer::{Event, Observer};
pub use error::ExportError;
use source::{Sample, Source};
pub use written::Exported;

/// What disparities are the distance of.
const KIND: &str = "centroid";

/// What `export.json` says of every layout's truth.
const TRUTH: &str = "Truth: by `registration` in `truth`, maps and target stand where the sum of all sub-pixels shows a point (`centroid`; \
each channel of the target where that channel of the sum does), or on the chief ray (`chief-ray`), up to 0.5 px beside it. Disparity is that \
of `channel` (G: green) and the distance of centroids (`kind`); red and blue have their own, as shifts.exr of the dataset says.";

/// What is written.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// `{train,val,test}_{c,l,r}/{source,target}/NAME.png`, 16-bit sRGB: sum, left and right half; the all-in-focus
    /// target.
    Dpdd,
    /// `{set}_{c,l,r,t,b}/source/seq_NNN/NAME.png`, 8-bit sRGB, and `{set}_c/target_disp/seq_NNN/NAME.npy`, x_L − x_R
    /// in px.
    Qpdnet,
    /// `{set}-NNNNNN.tar` of `NAME.FILE` members, the dataset's own files, with a wids index `{set}.json`.
    Webdataset,
}

impl Layout {
    /// All layouts.
    pub const ALL: [Self; 3] = [Self::Dpdd, Self::Qpdnet, Self::Webdataset];

    /// Its name in `export.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dpdd => "dpdd",
            Self::Qpdnet => "qpdnet",
            Self::Webdataset => "webdataset",
        }
    }
}

/// How a dataset is exported.
#[derive(Clone, Copy, Debug)]
pub struct ExportSettings {
    /// Layout to write.
    pub layout: Layout,
    /// Takes the noisy captures instead of the clean ones (dpdd, qpdnet; a webdataset has both).
    pub noisy: bool,
    /// Largest size of a tar shard, bytes; a sample is never split (webdataset).
    pub shard_bytes: u64,
}

/// Exports the dataset in the folder `dataset` into the new folder `out`.
///
/// # Errors
/// A folder that is no dataset or a file that differs from its hash, or a disk that fails. Nothing is left under the
/// name then.
pub fn export(
    dataset: &Path,
    out: &Path,
    settings: &ExportSettings,
    observer: &dyn Observer,
) -> Result<Exported, ExportError> {
    if out.exists() {
        let place = format!("--out {}", out.display());
        let what = "is there already; allowed: a new folder";
        return Err(ExportError::refused(place, what));
    }
    let source = Source::open(dataset)?;
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let aside = FolderAside::new(out, format!("{name}.tmp-"))?;
    observer.event(Event::Start {
        samples: source.entries().len(),
        rays: 0,
    });
    let written = write(&source, aside.path(), settings, observer);
    observer.event(Event::End);
    let written = written?;
    aside.persist(out)?;
    Ok(written)
}

fn write(
    source: &Source,
    root: &Path,
    settings: &ExportSettings,
    observer: &dyn Observer,
) -> Result<Exported, ExportError> {
    let noisy = settings.noisy;
    let (written, conventions) = match settings.layout {
        Layout::Dpdd => {
            let each = |sample: &Sample<'_>| dpdd::write(sample, root, noisy);
            (each_sample(source, &each, observer)?, dpdd::CONVENTIONS)
        }
        Layout::Qpdnet => {
            let sequences = qpdnet::Sequences::new(source.entries());
            let each = |sample: &Sample<'_>| qpdnet::write(sample, &sequences, root, noisy);
            (each_sample(source, &each, observer)?, qpdnet::CONVENTIONS)
        }
        Layout::Webdataset => (
            webdataset::write(source, root, settings.shard_bytes, observer)?,
            webdataset::CONVENTIONS,
        ),
    };
    let truth = match source.entries().first() {
        None => serde_json::Value::Null,
        Some(entry) => {
            // All samples of a dataset are of one configuration.
            let truth = source.sample(entry)?.meta.truth;
            serde_json::json!({
                "registration": truth.registration,
                "channel": truth.channel,
                "channels_differ": truth.channels_differ,
                "kind": KIND,
            })
        }
    };
    let index = serde_json::json!({
        "layout": settings.layout.name(),
        "dataset_blake3": source.hash(),
        "images": if noisy { "noisy" } else { "clean" },
        "samples": written.samples,
        "clipped": written.clipped,
        "licence": source.licence(),
        "truth": truth,
        "conventions": format!("{conventions} {TRUTH}"),
    });
    let text = format!("{index:#}\n");
    file::write_aside(&root.join("export.json"), text.as_bytes())?;
    Ok(written)
}

/// All samples, in parallel: each writes files of its own.
fn each_sample(
    source: &Source,
    write: &(dyn Fn(&Sample<'_>) -> Result<Exported, ExportError> + Sync),
    observer: &dyn Observer,
) -> Result<Exported, ExportError> {
    let one = |entry| {
        if observer.stop_asked() {
            return Err(ExportError::Stopped);
        }
        let written = write(&source.sample(entry)?)?;
        observer.event(Event::SampleDone);
        Ok(Exported {
            samples: 1,
            ..written
        })
    };
    let all = source.entries().par_iter().map(one);
    all.try_reduce(Exported::default, |a, b| Ok(a.plus(b)))
}
