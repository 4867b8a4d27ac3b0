//! The dataset that is exported: its files by name, each held to its hash, and the pictures that layouts are made of.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use quadpixel::file;
use quadpixel::image::exr::{NamedLayer, decode_layers};
use quadpixel::image::views::{Side, sum_of};
use quadpixel::image::{Image, channel};
use quadpixel_datasets::{DatasetManifest, FileEntry, SUM_LAYER, SampleEntry, SampleMeta};
use quadpixel_datasets::{paths, read_description};

use super::error::ExportError;

/// A dataset that is read.
pub(super) struct Source {
    root: PathBuf,
    manifest: DatasetManifest,
    hash: String,
    files: BTreeMap<String, FileEntry>,
}

/// One of its samples.
pub(super) struct Sample<'a> {
    source: &'a Source,
    pub entry: &'a SampleEntry,
    pub meta: SampleMeta,
}

impl Source {
    pub fn open(root: &Path) -> Result<Self, ExportError> {
        let path = root.join(paths::DATASET);
        let named = |what: String| ExportError::refused(path.display(), what);
        let bytes = file::read(&path).map_err(ExportError::NoDataset)?;
        let manifest: DatasetManifest =
            read_description(&bytes).map_err(|e| named(e.to_string()))?;
        let files = manifest.files.iter().map(|f| (f.path.clone(), f.clone()));
        Ok(Self {
            root: root.to_path_buf(),
            files: files.collect(),
            hash: blake3::hash(&bytes).to_hex().to_string(),
            manifest,
        })
    }

    pub fn entries(&self) -> &[SampleEntry] {
        &self.manifest.samples
    }

    pub fn licence(&self) -> &str {
        &self.manifest.licence
    }

    /// BLAKE3 of `dataset.json`, which names every file.
    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// A listed file, held to its hash.
    fn read(&self, path: &str) -> Result<Vec<u8>, ExportError> {
        let named = |what: &str| ExportError::refused(self.root.join(path).display(), what);
        let listed =
            (self.files.get(path)).ok_or_else(|| named("is not listed in dataset.json"))?;
        let place = paths::inside(&self.root, path).map_err(|e| named(&e.to_string()))?;
        let bytes = file::read(&place).map_err(ExportError::Read)?;
        if blake3::hash(&bytes).to_hex().as_str() == listed.blake3 {
            Ok(bytes)
        } else {
            Err(named(
                "differs from its hash in dataset.json; qpgen check says more",
            ))
        }
    }

    pub fn sample<'a>(&'a self, entry: &'a SampleEntry) -> Result<Sample<'a>, ExportError> {
        let path = format!("{}/{}/{}", paths::SAMPLES, entry.id, paths::META);
        let meta =
            read_description(&self.read(&path)?).map_err(|e| ExportError::refused(&path, e))?;
        Ok(Sample {
            source: self,
            entry,
            meta,
        })
    }
}

impl Sample<'_> {
    /// Name and content of every file, `meta.json` too, in the order of their names.
    pub fn all_files(&self) -> Result<Vec<(String, Vec<u8>)>, ExportError> {
        let mut names: Vec<&str> = self.meta.files.iter().map(|f| f.name.as_str()).collect();
        names.extend([paths::CAMERA, paths::META]);
        names.sort_unstable();
        let each = names.into_iter();
        each.map(|name| Ok((name.to_string(), self.read(name)?)))
            .collect()
    }

    fn read(&self, name: &str) -> Result<Vec<u8>, ExportError> {
        self.source
            .read(&format!("{}/{}/{name}", paths::SAMPLES, self.entry.id))
    }

    fn layers(&self, name: &str) -> Result<Vec<NamedLayer>, ExportError> {
        let path = Path::new(&self.entry.id).join(name);
        decode_layers(&path, &self.read(name)?).map_err(ExportError::Picture)
    }

    /// The all-in-focus image, linear.
    pub fn target(&self) -> Result<Image, ExportError> {
        let first = self.layers("target.exr")?.into_iter().next();
        first
            .map(|l| l.image)
            .ok_or_else(|| self.lacks("target.exr", "a layer"))
    }

    /// The sum of all sub-pixels and the parts of the pupil asked for, linear, each part scaled by all over its own
    /// sub-pixels: a gray wall is equally bright in all of them.
    pub fn parts(&self, noisy: bool, sides: &[Side]) -> Result<Vec<Image>, ExportError> {
        let name = if noisy {
            "noisy_views.exr"
        } else {
            "views.exr"
        };
        if noisy && self.meta.noise.readout().is_none() {
            return Err(self.lacks(name, "itself: --noisy needs a dataset with [readout]"));
        }
        let layers = self.layers(name)?;
        let subpixels = self.meta.sensor.subpixels;
        let names = subpixels.names();
        let find = |wanted: &str| {
            let found = layers.iter().find(|l| l.name == wanted);
            found
                .map(|l| &l.image)
                .ok_or_else(|| self.lacks(name, &format!("layer {wanted}")))
        };
        let part = |side: &Side| {
            if *side == Side::All {
                return Ok(find(SUM_LAYER)?.clone());
            }
            let members = side.members(subpixels);
            let images =
                (members.iter().map(|&i| find(&names[i]))).collect::<Result<Vec<_>, _>>()?;
            let mut image = sum_of(images).ok_or_else(|| {
                let what = format!("{subpixels} sub-pixels have no {} half", side.name());
                ExportError::refused(format!("sample {}", self.entry.id), what)
            })?;
            let scale = subpixels.count() as f32 / members.len() as f32;
            image.data_mut().iter_mut().for_each(|v| *v *= scale);
            Ok(image)
        };
        sides.iter().map(part).collect()
    }

    /// x_L − x_R, px; NaN where there is no truth.
    pub fn left_right_px(&self) -> Result<Image, ExportError> {
        let layers = self.layers("disparity.exr")?;
        let subpixels = self.meta.sensor.subpixels;
        let names = subpixels.names();
        let mean = |side: Side| {
            let members = side.members(subpixels);
            let shift = |&i: &usize| {
                let layer = layers.iter().find(|l| l.name == names[i])?;
                let at = layer.channels.iter().position(|c| c == "dx")?;
                Some(channel(&layer.image, at))
            };
            let shifts: Option<Vec<Image>> = members.iter().map(shift).collect();
            let mut mean = sum_of(shifts.as_ref()?)?;
            let count = members.len() as f32;
            mean.data_mut().iter_mut().for_each(|v| *v /= count);
            Some(mean)
        };
        let (left, right) = (mean(Side::Left), mean(Side::Right));
        let (Some(mut left), Some(right)) = (left, right) else {
            return Err(self.lacks("disparity.exr", "a left and a right half"));
        };
        let pairs = left.data_mut().iter_mut().zip(right.data());
        pairs.for_each(|(l, r)| *l -= r);
        Ok(left)
    }

    fn lacks(&self, name: &str, what: &str) -> ExportError {
        let place = format!("sample {}", self.entry.id);
        ExportError::refused(place, format!("{name} lacks {what}"))
    }
}
