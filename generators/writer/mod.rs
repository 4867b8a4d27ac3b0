//! Writes one sample into the native layout (datasets_spec, SPEC.md), and finishes a dataset of them.
//!
//! A sample is written into `samples/.tmp-NNNNNN-XXXXXX` and renamed to `samples/NNNNNN` when it is whole: a folder
//! under its final name is always complete, and an interrupted run goes on where it stopped ([`earlier_sample`]).

mod camera_pictures;
mod dataset;
mod described;
mod error;
mod files;
mod findings;
mod json;
mod making;
mod mosaic;
mod pages;
mod resume;
mod rows;
mod sound;
mod stored;
mod survey;
mod truth;

use quadpixel_datasets::paths;

pub use dataset::{Dataset, finish_dataset, rebuild_pages};
pub use described::{Kind, described};
pub use error::WriteError;
pub use files::{NoisyFiles, RawEncoding, SampleFiles, WorldMaps};
pub use making::{Place, SampleWriter, write_alone, write_sample};
pub use mosaic::picked;
pub(crate) use pages::half_made;
pub use pages::{Foreign, Pages};
pub use resume::{EarlierSample, earlier_sample, is_whole_sample};
pub use truth::Truth;

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
