//! A sample's folder in the making: its files grow row by row, and it gets its name when it is whole.

use std::path::{Path, PathBuf};

use quadpixel::file::{self, FolderAside};
use quadpixel_datasets::{FileEntry, SampleMeta, paths};
use rayon::prelude::*;

use super::described::Kind;
use super::error::WriteError;
use super::files::SampleFiles;
use super::findings::Findings;
use super::half_made_prefix;
use super::json::json;
use super::rows::Rows;
use super::sound::{check, input};
use super::stored::Stored;
use crate::describe::Description;
use crate::preview::Panels;

/// A sample's folder in the making. Dropped before its end, it leaves nothing.
pub struct SampleWriter {
    /// Of the sample.
    name: String,
    kind: Kind,
    aside: FolderAside,
    /// What it becomes.
    folder: PathBuf,
    files: Vec<Stored>,
    panels: Panels,
    findings: Findings,
    /// Rows that there are.
    rows: usize,
}

/// Where a sample goes.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// Among the samples of the dataset in this folder, which is created if missing.
    Dataset(&'a Path),
    /// As this new folder, of no dataset.
    Alone(&'a Path),
}

impl SampleWriter {
    /// Begins a sample.
    ///
    /// # Errors
    /// A sample of that name, a link in the place of a folder, the disk.
    pub fn new(place: Place<'_>, kind: Kind, given: &Description) -> Result<Self, WriteError> {
        let name = paths::sample_name(given.index)?;
        let (folder, prefix) = match place {
            Place::Dataset(root) => {
                let samples = root.join(paths::SAMPLES);
                file::create_folder(root)?;
                file::own_folder(&samples)?;
                (samples.join(&name), half_made_prefix(&name))
            }
            Place::Alone(folder) => {
                if let Some(parent) = folder.parent() {
                    file::create_folder(parent)?;
                }
                let own_name = folder.file_name().unwrap_or_default().to_string_lossy();
                (folder.to_path_buf(), format!("{own_name}.tmp-"))
            }
        };
        if folder.symlink_metadata().is_ok() {
            return Err(WriteError::Occupied {
                path: folder,
                what: "is there already".into(),
            });
        }
        let aside = FolderAside::new(&folder, prefix)?;
        let files = kind.files(given);
        let files = files.iter().map(|f| Stored::new(f, aside.path(), given));
        let sensor = &given.sensor;
        let size = (sensor.width_px as usize, sensor.height_px as usize);
        Ok(Self {
            files: files.collect::<Result<_, _>>()?,
            panels: Panels::new(sensor.subpixels, size, given.channels.len()),
            findings: Findings::default(),
            rows: 0,
            name,
            kind,
            aside,
            folder,
        })
    }

    /// Goes on with some rows, a multiple of the period of the colours' pattern of them but for the last.
    ///
    /// # Errors
    /// Images of different sizes, light that is negative or not finite, or above what half precision holds where the
    /// sample is not of bright light; the disk.
    pub fn rows(&mut self, sample: &SampleFiles<'_>) -> Result<(), WriteError> {
        let height = sample.depth_m.height();
        check(sample, &self.name, height)?;
        self.add(&Rows::new(sample, &self.name, self.rows)?)
    }

    pub(super) fn add(&mut self, rows: &Rows<'_>) -> Result<(), WriteError> {
        let (files, panels) = (&mut self.files, &mut self.panels);
        let (stored, ()) = rayon::join(
            || files.par_iter_mut().try_for_each(|file| file.add(rows)),
            || rows.shown_by(panels),
        );
        stored?;
        self.findings.add(&rows.truth);
        self.rows += rows.sample.depth_m.height();
        Ok(())
    }

    /// Ends the sample, and waits for the disk.
    ///
    /// # Errors
    /// Missing rows, the disk. Nothing is left under the final name then.
    pub fn finish(self, given: Description) -> Result<SampleMeta, WriteError> {
        let height = given.sensor.height_px as usize;
        if self.rows != height {
            let what = format!("{} rows of {height}", self.rows);
            return Err(input(&self.name, what));
        }
        let (panels, clipped) = (&self.panels, self.files.iter().map(|f| f.clipped).sum());
        let entries = self.files.into_par_iter().map(|f| f.finish(panels, &given));
        let mut contents: Vec<FileEntry> = entries.collect::<Result<_, _>>()?;
        let curves = given.curves.clone();
        let mut meta = self
            .kind
            .describe(given, &self.name, &self.findings, clipped);
        let camera = meta.camera(curves);
        contents.push(written(self.aside.path(), paths::CAMERA, &camera)?);
        contents.sort_by(|a, b| a.path.cmp(&b.path));
        meta.contents = contents;
        written(self.aside.path(), paths::META, &meta)?;
        self.aside.persist(&self.folder)?;
        Ok(meta)
    }
}

fn written<T: serde::Serialize>(
    folder: &Path,
    name: &str,
    value: &T,
) -> Result<FileEntry, WriteError> {
    let bytes = json(Path::new(name), value)?;
    file::write_synced(&folder.join(name), &bytes)?;
    Ok(FileEntry::new(name, &bytes))
}

/// Writes a sample below `root` (created if missing), and waits for the disk.
///
/// # Errors
/// An image of another size than the sensor's, light that is negative or not finite, a sample of that name, a link in
/// the place of a folder, the disk. Nothing is left under the final name then.
pub fn write_sample(root: &Path, sample: &SampleFiles<'_>) -> Result<SampleMeta, WriteError> {
    write(Place::Dataset(root), sample)
}

/// Writes a sample of no dataset as the new folder `folder`; as [`write_sample`] otherwise.
///
/// # Errors
/// As there.
pub fn write_alone(folder: &Path, sample: &SampleFiles<'_>) -> Result<SampleMeta, WriteError> {
    write(Place::Alone(folder), sample)
}

fn write(place: Place<'_>, sample: &SampleFiles<'_>) -> Result<SampleMeta, WriteError> {
    let given = sample.description;
    let name = paths::sample_name(given.index)?;
    check(sample, &name, given.sensor.height_px as usize)?;
    let rows = Rows::new(sample, &name, 0)?;
    let mut writer = SampleWriter::new(place, Kind::of(&rows), given)?;
    writer.add(&rows)?;
    writer.finish(given.clone())
}
