//! QPDNet (Z. Wu et al., BMVC 2024): `{set}_{c,l,r,t,b}/source/seq_NNN/NAME.png` and
//! `{set}_c/target_disp/seq_NNN/NAME.npy`. Its loader sorts each folder, takes 8-bit pictures in the order c, l, r, t,
//! b, and trains on flow = −disparity where that is below 512 px.

use std::collections::BTreeMap;
use std::path::Path;

use ndarray::Array2;
use ndarray_npy::WriteNpyExt;
use quadpixel::image::Image;
use quadpixel::image::views::Side;
use quadpixel_datasets::SampleEntry;

use super::error::ExportError;
use super::pictures;
use super::source::Sample;
use super::written::{Exported, put, put_png};

pub(super) const CONVENTIONS: &str = "NAME.png is 8-bit sRGB. c/source: the sum of all sub-pixels; l, r, t, b: the left, right, upper and lower half \
of the pupil, times 2; c/target: all in focus; c/target_disp/NAME.npy: float32, rows x columns, x_L - x_R of the green channel of l and r, in px at the place in c, positive for \
points nearer than the focus, 1024 where there is no truth (the loader trains below 512). flow = -disp is the way from l to r. seq_NNN: one scene.";

/// What the loader leaves out.
const NO_TRUTH_PX: f32 = 1024.0;

const FOLDERS: [(&str, Side); 5] = [
    ("c", Side::All),
    ("l", Side::Left),
    ("r", Side::Right),
    ("t", Side::Top),
    ("b", Side::Bottom),
];

/// Number of each scene within its split, in the order of the samples.
pub(super) struct Sequences {
    of_scene: BTreeMap<String, String>,
}

impl Sequences {
    pub fn new(entries: &[SampleEntry]) -> Self {
        let mut next: BTreeMap<&str, usize> = BTreeMap::new();
        let mut of_scene: BTreeMap<String, usize> = BTreeMap::new();
        for entry in entries {
            if !of_scene.contains_key(&entry.scene) {
                let number = next.entry(entry.split.name()).or_default();
                of_scene.insert(entry.scene.clone(), *number);
                *number += 1;
            }
        }
        // All names of one length, so that they sort in order.
        let most = next.values().max().map_or(0, |n| n.saturating_sub(1));
        let digits = most.to_string().len().max(3);
        let name = |(scene, n): (String, usize)| (scene, format!("seq_{n:0digits$}"));
        Self {
            of_scene: of_scene.into_iter().map(name).collect(),
        }
    }
}

pub(super) fn write(
    sample: &Sample<'_>,
    sequences: &Sequences,
    root: &Path,
    noisy: bool,
) -> Result<Exported, ExportError> {
    let (split, id) = (sample.entry.split.name(), &sample.entry.id);
    let Some(sequence) = sequences.of_scene.get(&sample.entry.scene) else {
        unreachable!("every sample's scene is numbered");
    };
    let sides = FOLDERS.map(|(_, side)| side);
    let mut pngs: Vec<(String, Image)> = (FOLDERS.iter())
        .zip(sample.parts(noisy, &sides)?)
        .map(|((folder, _), image)| (format!("{split}_{folder}/source"), image))
        .collect();
    pngs.push((format!("{split}_c/target"), sample.target()?));
    let mut written = Exported::default();
    for (folder, image) in pngs {
        let png = pictures::eight_bit(id, &image)?;
        let path = format!("{folder}/{sequence}/{id}.png");
        written = written.plus(put_png(root, &path, &png)?);
    }
    let npy = npy(&sample.left_right_px()?)?;
    let path = format!("{split}_c/target_disp/{sequence}/{id}.npy");
    Ok(written.plus(put(root, &path, &npy)?))
}

fn npy(map: &Image) -> Result<Vec<u8>, ExportError> {
    let known = |v: f32| if v.is_nan() { NO_TRUTH_PX } else { v };
    let mut bytes = Vec::new();
    let array = Array2::from_shape_fn((map.height(), map.width()), |(row, column)| {
        known(map.data()[row * map.width() + column])
    });
    array.write_npy(&mut bytes)?;
    Ok(bytes)
}
