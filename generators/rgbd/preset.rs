//! Folder layouts of published data sets: which files are pairs, and what their numbers mean.
//!
//! | preset | picture | depth | numbers |
//! |---|---|---|---|
//! | `pairs` | `rgb`, `image` or `images` `/STEM` | `depth` or `depths` `/STEM` | as flags and sidecars say |
//! | `nyuv2` | `N_colors`, or `rgb_N` | `N_depth`, or `sync_depth_N` | 16 bit, z in mm, 0 a hole |
//! | `flyingthings3d` | `frames_cleanpass/…/left/N` (else `frames_finalpass`) | `disparity/…/left/N` | px |
//! | `hypersim` | `scene_cam_C_final_hdf5/frame.N.color` | `…_geometry_hdf5/frame.N.depth_meters` | m, ray |
//! | `middlebury` | `SCENE/im0` | `SCENE/disp0` | px, +∞ a hole; `calib.txt` has the rest |
//!
//! FlyingThings3D's cameras are one unit of its scenes apart and have f = 1050 px at a width of 960; the unit is taken
//! for a metre. Hypersim's have f = 886.81 px at a width of 1024.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::error::PictureError;
use super::meaning::{DepthKind, Meaning};
use super::pairs::{Pair, is_picture};

/// Folders that deep are looked into.
const DEEPEST: usize = 8;
const MM: f64 = 1e-3;

/// A folder layout; see the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Two folders of the same stems.
    Pairs,
    /// NYU Depth V2, as pictures.
    Nyuv2,
    /// FlyingThings3D with its disparity.
    Flyingthings3d,
    /// Hypersim, its arrays exported to EXR or NPY.
    Hypersim,
    /// Middlebury stereo, 2014 and 2021.
    Middlebury,
}

impl Preset {
    /// Its name, as in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pairs => "pairs",
            Self::Nyuv2 => "nyuv2",
            Self::Flyingthings3d => "flyingthings3d",
            Self::Hypersim => "hypersim",
            Self::Middlebury => "middlebury",
        }
    }

    /// What its numbers mean; a flag stands before it.
    pub fn meaning(self) -> Meaning {
        let hfov_deg =
            |width: f64, focal: f64| Some(2.0 * (0.5 * width / focal).atan().to_degrees());
        match self {
            Self::Pairs => Meaning::default(),
            Self::Nyuv2 => Meaning {
                kind: Some(DepthKind::Z),
                unit: Some(MM),
                ..Meaning::default()
            },
            Self::Flyingthings3d => Meaning {
                kind: Some(DepthKind::Disparity),
                baseline_m: Some(1.0),
                hfov_deg: hfov_deg(960.0, 1050.0),
                ..Meaning::default()
            },
            Self::Hypersim => Meaning {
                kind: Some(DepthKind::Ray),
                unit: Some(1.0),
                hfov_deg: hfov_deg(1024.0, 886.81),
                ..Meaning::default()
            },
            Self::Middlebury => Meaning {
                kind: Some(DepthKind::Disparity),
                ..Meaning::default()
            },
        }
    }

    /// The pairs below a folder, in the order of their paths, and what has no other half: a line each.
    ///
    /// # Errors
    /// A folder that cannot be read, or without a pair of this layout.
    pub fn pairs(self, root: &Path) -> Result<(Vec<Pair>, Vec<String>), PictureError> {
        let mut files = BTreeMap::new();
        gather(root, Path::new(""), DEEPEST, &mut files)?;
        let (mut pairs, mut alone) = (Vec::new(), Vec::new());
        let passes: &[&str] = match self {
            Self::Flyingthings3d => &["frames_cleanpass", "frames_finalpass"],
            _ => &[""],
        };
        for pass in passes {
            for (stem, image) in &files {
                let Some(depth) = self.depth_of(stem, pass) else {
                    continue;
                };
                match files.get(&depth) {
                    Some(depth) => pairs.push(Pair {
                        image: image.clone(),
                        depth: depth.clone(),
                    }),
                    None => alone.push(format!("{}: no depth at {depth}", image.display())),
                }
            }
            if !pairs.is_empty() {
                break;
            }
        }
        match pairs.is_empty() {
            true => Err(PictureError::Pairs(format!(
                "{}: no pair in the layout of preset {}; allowed: {}{}",
                root.display(),
                self.name(),
                self.example(),
                alone.first().map_or(String::new(), |a| format!(" ({a})"))
            ))),
            false => Ok((pairs, alone)),
        }
    }

    /// The path of the depth of a picture, both without their endings and below the root; `None` if it is no picture.
    fn depth_of(self, stem: &str, pass: &str) -> Option<String> {
        let (folder, name) = stem.rsplit_once('/').unwrap_or(("", stem));
        let beside = |name: String| match folder {
            "" => name,
            _ => format!("{folder}/{name}"),
        };
        let parts: Vec<&str> = stem.split('/').collect();
        match self {
            Self::Pairs => {
                let other = match *parts.first()? {
                    "rgb" | "image" => "depth",
                    "images" => "depths",
                    _ => return None,
                };
                Some([&[other], &parts[1..]].concat().join("/"))
            }
            Self::Nyuv2 => {
                let raw = || Some(format!("sync_depth_{}", name.strip_prefix("rgb_")?));
                let labelled = name.strip_suffix("_colors").map(|n| format!("{n}_depth"));
                labelled.or_else(raw).map(beside)
            }
            Self::Flyingthings3d => {
                let place = parts.iter().position(|part| *part == pass)?;
                let is_left = parts.get(parts.len().checked_sub(2)?) == Some(&"left");
                let mut parts = parts;
                parts[place] = "disparity";
                is_left.then(|| parts.join("/"))
            }
            Self::Hypersim => {
                let frame = name.strip_suffix(".color")?;
                let folder = folder.strip_suffix("_final_hdf5")?;
                Some(format!("{folder}_geometry_hdf5/{frame}.depth_meters"))
            }
            Self::Middlebury => (name == "im0").then(|| beside("disp0".to_owned())),
        }
    }

    fn example(self) -> &'static str {
        match self {
            Self::Pairs => "rgb/NAME.png with depth/NAME.exr and the like",
            Self::Nyuv2 => {
                "00000_colors.png with 00000_depth.png, or rgb_00000.jpg with sync_depth_00000.png"
            }
            Self::Flyingthings3d => {
                "frames_cleanpass/TRAIN/A/0000/left/0006.png with disparity/TRAIN/A/0000/left/0006.pfm"
            }
            Self::Hypersim => {
                "scene_cam_00_final_hdf5/frame.0000.color.exr with scene_cam_00_geometry_hdf5/frame.0000.depth_meters.exr, \
                 exported from .hdf5 (.npy too)"
            }
            Self::Middlebury => "SCENE/im0.png with SCENE/disp0.pfm and SCENE/calib.txt",
        }
    }
}

/// Every picture below a folder, by its path without the ending.
fn gather(
    root: &Path,
    below: &Path,
    deepest: usize,
    files: &mut BTreeMap<String, PathBuf>,
) -> Result<(), PictureError> {
    let folder = root.join(below);
    let failed = |cause: std::io::Error| PictureError::File {
        path: folder.clone(),
        what: format!("cannot be read: {cause}"),
    };
    for entry in std::fs::read_dir(&folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let Some(name) = path.file_name() else {
            continue;
        };
        let below = below.join(name);
        if path.is_dir() {
            if deepest > 0 {
                gather(root, &below, deepest - 1, files)?;
            }
        } else if is_picture(&path) {
            let parts = below.with_extension("");
            let parts: Vec<_> = parts.iter().map(|p| p.to_string_lossy()).collect();
            let stem = parts.join("/");
            if let Some(other) = files.insert(stem, path.clone()) {
                let (a, b) = (other.display(), path.display());
                return Err(PictureError::Pairs(format!(
                    "{a} and {b} have one stem; allowed: one file of each stem"
                )));
            }
        }
    }
    Ok(())
}

/// What Middlebury's `calib.txt` says.
///
/// # Errors
/// A line that is missing, or whose numbers are none.
pub(super) fn calibration(text: &str) -> Result<Meaning, String> {
    let value = |key: &str| {
        let line = text.lines().find_map(|l| l.trim().strip_prefix(key));
        let rest = line.and_then(|rest| rest.trim_start().strip_prefix('='));
        rest.map(str::trim).ok_or_else(|| {
            format!("no line {key}=…; allowed: cam0, doffs and baseline as Middlebury has them")
        })
    };
    let numbers = |text: &str| -> Vec<f64> {
        let inner = text.trim_matches(|c| c == '[' || c == ']');
        let parts = inner.split([' ', ';']).filter(|part| !part.is_empty());
        parts.filter_map(|part| part.parse().ok()).collect()
    };
    let number = |key: &str| {
        let text = value(key)?;
        let number = text.parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or_else(|| format!("{key} is {text}; allowed: a number"))
    };
    let camera = numbers(value("cam0")?);
    let [fx_px, _, cx_px, _, fy_px, cy_px, ..] = camera[..] else {
        return Err(format!("cam0 has {} numbers; allowed: 9", camera.len()));
    };
    Ok(Meaning {
        kind: Some(DepthKind::Disparity),
        baseline_m: Some(MM * number("baseline")?),
        disparity_offset_px: Some(number("doffs")?),
        intrinsics: Some(super::meaning::Intrinsics {
            fx_px,
            fy_px: Some(fy_px),
            cx_px: Some(cx_px),
            cy_px: Some(cy_px),
        }),
        ..Meaning::default()
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_calibration_says_what_disparities_mean() {
        let text = "cam0=[3997.684 0 1176.728; 0 3997.684 1011.728; 0 0 1]\ncam1=[1 0 0; 0 1 0; 0 0 1]\n\
                    doffs=131.111\nbaseline=193.001\nwidth=2964\n";
        let meaning = calibration(text).unwrap();
        assert_eq!(meaning.baseline_m, Some(193.001 * MM));
        assert_eq!(meaning.disparity_offset_px, Some(131.111));
        let camera = meaning.intrinsics.unwrap();
        assert_eq!([camera.fx_px, camera.cx_px.unwrap()], [3997.684, 1176.728]);
        assert!(calibration("cam0=[1 0 0]\ndoffs=0\nbaseline=1").is_err());
        assert!(calibration("cam0=[1 0 0; 0 1 0; 0 0 1]\nbaseline=1").is_err());
    }

    #[test]
    fn each_layout_names_the_depth_of_a_picture() {
        let cases = [
            (Preset::Pairs, "rgb/a/b", Some("depth/a/b")),
            (
                Preset::Nyuv2,
                "kitchen/rgb_00042",
                Some("kitchen/sync_depth_00042"),
            ),
            (Preset::Nyuv2, "00001_colors", Some("00001_depth")),
            (Preset::Nyuv2, "00001_depth", None),
            (
                Preset::Hypersim,
                "ai_001_001/images/scene_cam_00_final_hdf5/frame.0000.color",
                Some("ai_001_001/images/scene_cam_00_geometry_hdf5/frame.0000.depth_meters"),
            ),
            (
                Preset::Middlebury,
                "Adirondack/im0",
                Some("Adirondack/disp0"),
            ),
            (Preset::Middlebury, "Adirondack/im1", None),
        ];
        for (preset, stem, depth) in cases {
            assert_eq!(preset.depth_of(stem, "").as_deref(), depth, "{stem}");
        }
        let left = "frames_cleanpass/TRAIN/A/0000/left/0006";
        let things = Preset::Flyingthings3d;
        let depth = things.depth_of(left, "frames_cleanpass");
        assert_eq!(depth.as_deref(), Some("disparity/TRAIN/A/0000/left/0006"));
        assert_eq!(
            things.depth_of(&left.replace("left", "right"), "frames_cleanpass"),
            None
        );
    }
}
