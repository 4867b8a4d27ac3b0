//! Writes one sample into the native layout (datasets_spec, SPEC.md), and finishes a dataset of them.
//!
//! A sample is written into `samples/.tmp-NNNNNN` and renamed to `samples/NNNNNN` when it is whole, so a folder under
//! its final name is always complete and an interrupted run goes on where it stopped ([`earlier_sample`]).

mod dataset;
mod encode;
mod error;
mod files;
mod json;
mod mosaic;
mod resume;
mod sound;
mod survey;
mod truth;

use std::path::{Path, PathBuf};

use quadpixel::file;
use quadpixel_datasets as spec;
use quadpixel_datasets::paths;

pub use dataset::{Dataset, finish_dataset, rebuild_pages};
pub use error::WriteError;
pub use files::{NoisyFiles, RawEncoding, SampleFiles, WorldMaps};
pub use resume::{EarlierSample, earlier_sample};

/// Writes a sample below `root` (created if missing), and waits for the disk.
///
/// # Errors
/// An image of another size than the sensor's, light that is negative or not finite, a sample of that name, a link in
/// the place of a folder, the disk. Nothing is left under the final name then.
pub fn write_sample(root: &Path, sample: &SampleFiles<'_>) -> Result<spec::SampleMeta, WriteError> {
    let name = paths::sample_name(sample.description.index)?;
    let samples = root.join(paths::SAMPLES);
    let (meta, contents) = encode::encode(sample, &name)?;
    file::create_folder(root)?;
    file::own_folder(&samples)?;
    write_folder(&aside_of(&samples, &name), &samples.join(&name), &contents)?;
    Ok(meta)
}

/// Writes a sample of no dataset as the new folder `folder`; as [`write_sample`] otherwise.
///
/// # Errors
/// As there.
pub fn write_alone(
    folder: &Path,
    sample: &SampleFiles<'_>,
) -> Result<spec::SampleMeta, WriteError> {
    let name = paths::sample_name(sample.description.index)?;
    let (meta, contents) = encode::encode(sample, &name)?;
    if let Some(parent) = folder.parent() {
        file::create_folder(parent)?;
    }
    write_folder(&file::aside(folder), folder, &contents)?;
    Ok(meta)
}

/// Where a sample is made before it gets its name; one that is not named again is the leftover of a killed run.
fn aside_of(samples: &Path, name: &str) -> PathBuf {
    samples.join(format!(".tmp-{name}"))
}

fn write_folder(
    aside: &Path,
    folder: &Path,
    contents: &[(String, Vec<u8>)],
) -> Result<(), WriteError> {
    if folder.symlink_metadata().is_ok() {
        return Err(WriteError::Occupied {
            path: folder.to_path_buf(),
            what: "is there already".into(),
        });
    }
    let write = || {
        file::remove(aside)?;
        file::own_folder(aside)?;
        for (name, bytes) in contents {
            file::write_synced(&aside.join(name), bytes)?;
        }
        file::rename_synced(aside, folder)
    };
    write().map_err(|error| {
        // The first error is the one to tell; a leftover that cannot be removed changes nothing about it.
        let _ = file::remove(aside);
        error.into()
    })
}
