//! Writes one sample into the native layout (datasets_spec, SPEC.md), and finishes a dataset of them.
//!
//! A sample is written into `samples/.tmp-NNNNNN-XXXXXX` and renamed to `samples/NNNNNN` when it is whole: a folder
//! under its final name is always complete, and an interrupted run goes on where it stopped ([`earlier_sample`]).

mod camera_pictures;
mod dataset;
mod encode;
mod error;
mod files;
mod json;
mod mosaic;
mod pages;
mod resume;
mod sound;
mod survey;
mod truth;

use std::path::Path;

use quadpixel::file::{self, FolderAside};
use quadpixel_datasets as spec;
use quadpixel_datasets::paths;

pub use dataset::{Dataset, finish_dataset, rebuild_pages};
pub use encode::described;
pub use error::WriteError;
pub use files::{NoisyFiles, RawEncoding, SampleFiles, WorldMaps};
pub use mosaic::picked;
pub(crate) use pages::half_made;
pub use pages::{Foreign, Pages};
pub use resume::{EarlierSample, earlier_sample, is_whole_sample};
pub use truth::Truth;

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
    write_folder(&half_made_prefix(&name), &samples.join(&name), &contents)?;
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
    let own_name = folder.file_name().unwrap_or_default().to_string_lossy();
    write_folder(&format!("{own_name}.tmp-"), folder, &contents)?;
    Ok(meta)
}

/// What the name begins with under which a sample is made; one that is not named again is the leftover of a killed run.
pub(crate) fn half_made_prefix(name: &str) -> String {
    format!(".tmp-{name}-")
}

/// Whether that is what a killed run left of a sample.
pub(crate) fn is_half_made_sample(name: &str) -> bool {
    let rest = name.strip_prefix(".tmp-").unwrap_or_default();
    let (number, end) = rest.split_once('-').unwrap_or((rest, ""));
    paths::is_sample_name(number) && end.bytes().all(|b| b.is_ascii_alphanumeric())
}

fn write_folder(
    prefix: &str,
    folder: &Path,
    contents: &[(String, Vec<u8>)],
) -> Result<(), WriteError> {
    if folder.symlink_metadata().is_ok() {
        return Err(WriteError::Occupied {
            path: folder.to_path_buf(),
            what: "is there already".into(),
        });
    }
    let aside = FolderAside::new(folder, prefix)?;
    for (name, bytes) in contents {
        file::write_synced(&aside.path().join(name), bytes)?;
    }
    Ok(aside.persist(folder)?)
}
