//! Exports read back by the conventions of the loaders that they are for.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use crate::common;

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use common::small::{SMALL, dataset};
use common::{done, files, layer, qpgen, refused};
use image::{ColorType, ImageReader};
use ndarray::Array2;
use quadpixel::image::exr::read_layers;

/// A dataset of three samples, with noisy captures, and its export.
fn exported(folder: &Path, layout: &str, more: &[&str]) -> (PathBuf, PathBuf) {
    let (root, out) = (folder.join("d"), folder.join(layout));
    if !root.exists() {
        // Rays enough that the render's own noise does not hide a shift of a pixel.
        let text = SMALL.replace("rays_per_pixel = 16", "rays_per_pixel = 128");
        let noisy = format!("{text}[readout]\n");
        dataset(folder, "d", &noisy, &["--count", "3"]);
    }
    let mut arguments = vec!["export", root.to_str().unwrap(), "--layout", layout, "-o"];
    arguments.push(out.to_str().unwrap());
    arguments.extend(more);
    done(&arguments);
    (root, out)
}

/// `sorted(glob(...))` of all files below a folder with this ending.
fn sorted(folder: &Path, ending: &str) -> Vec<PathBuf> {
    if !folder.exists() {
        return Vec::new(); // a split without samples
    }
    let names = files(folder).into_keys().filter(|n| n.ends_with(ending));
    names.map(|n| folder.join(n)).collect()
}

/// The sRGB curve by the standard's formula, in f64.
fn srgb(v: f64) -> f64 {
    let v = v.clamp(0.0, 1.0);
    if v <= 0.003_130_8 {
        12.92 * v
    } else {
        1.055 * v.powf(1.0 / 2.4) - 0.055
    }
}

fn linear(c: f64) -> f64 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

#[test]
fn dpdd_is_sixteen_bit_srgb_in_sorted_pairs_and_c_is_the_mean_of_l_and_r() {
    let folder = tempfile::tempdir().unwrap();
    let (root, out) = exported(folder.path(), "dpdd", &[]);
    let mut pairs = 0;
    for set in ["train", "val", "test"] {
        let list = fs::read_to_string(root.join(format!("splits/{set}.txt"))).unwrap();
        let of =
            |part: &str, kind: &str| sorted(&out.join(format!("{set}_{part}")).join(kind), ".png");
        let [c, l, r] = ["c", "l", "r"].map(|part| of(part, "source"));
        let target = of("c", "target");
        let stems = |paths: &[PathBuf]| -> Vec<String> {
            paths
                .iter()
                .map(|p| p.file_stem().unwrap().to_string_lossy().into_owned())
                .collect()
        };
        for other in [&l, &r, &target, &of("l", "target"), &of("r", "target")] {
            assert_eq!(stems(&c), stems(other));
        }
        assert_eq!(stems(&c), list.lines().collect::<Vec<_>>());
        for (i, id) in stems(&c).iter().enumerate() {
            // cv2.imread(path, -1) / 65535
            let read = |path: &Path| -> Vec<f64> {
                let picture = ImageReader::open(path).unwrap().decode().unwrap();
                assert_eq!(picture.color(), ColorType::Rgb16);
                picture
                    .into_rgb16()
                    .into_raw()
                    .into_iter()
                    .map(|v| f64::from(v) / 65535.0)
                    .collect()
            };
            let sample = root.join("samples").join(id);
            let sum = read_layers(&sample.join("views.exr")).unwrap();
            let sharp = read_layers(&sample.join("target.exr")).unwrap();
            for (path, truth) in [(&c[i], layer(&sum, "sum")), (&target[i], &sharp[0].image)] {
                for (code, &v) in read(path).iter().zip(truth.data()) {
                    assert!((code - srgb(f64::from(v))).abs() <= 0.51 / 65535.0 + 1e-6);
                }
            }
            let (c, l, r) = (read(&c[i]), read(&l[i]), read(&r[i]));
            for ((c, l), r) in c
                .iter()
                .zip(&l)
                .zip(&r)
                .filter(|((_, l), r)| l.max(**r) < 1.0)
            {
                // Half precision of six numbers and three codes: 2^-11 of each.
                assert!(
                    (linear(*c) - 0.5 * (linear(*l) + linear(*r))).abs() < 2e-3 * linear(*c) + 1e-4
                );
            }
            pairs += 1;
        }
    }
    assert_eq!(pairs, 3);
}

#[test]
fn qpdnet_layout_has_five_views_and_a_disparity_from_left_to_right() {
    let folder = tempfile::tempdir().unwrap();
    let (root, out) = exported(folder.path(), "qpdnet", &[]);
    let (mut along, mut against, mut count) = (0.0, 0.0, 0);
    for set in ["train", "val", "test"] {
        let of = |part: &str, kind: &str, end: &str| {
            sorted(&out.join(format!("{set}_{part}")).join(kind), end)
        };
        let lists = ["c", "l", "r", "t", "b"].map(|part| of(part, "source", ".png"));
        let disparities = of("c", "target_disp", ".npy");
        for (i, path) in disparities.iter().enumerate() {
            let id = path.file_stem().unwrap();
            assert!(lists.iter().all(|list| list[i].file_stem() == Some(id)));
            assert!(
                path.parent()
                    .unwrap()
                    .file_name()
                    .unwrap()
                    .to_string_lossy()
                    .starts_with("seq_00")
            );
            let disparity: Array2<f32> = ndarray_npy::read_npy(path).unwrap();
            let (height, width) = disparity.dim();
            assert_eq!((height, width), (32, 40));
            let read = |path: &Path| {
                let picture = ImageReader::open(path).unwrap().decode().unwrap();
                assert_eq!(picture.color(), ColorType::Rgb8);
                picture.into_rgb8()
            };
            let (left, right) = (read(&lists[1][i]), read(&lists[2][i]));
            let green = |p: &image::RgbImage, x: f64, y: usize| {
                let at = |x: usize| f64::from(p.get_pixel(x as u32, y as u32)[1]);
                let (i, f) = (x.floor() as usize, x.fract());
                at(i) * (1.0 - f) + at(i + 1) * f
            };
            // The truth itself: mean dx of B and D (left) minus that of A and C.
            let shifts = read_layers(&root.join("samples").join(id).join("disparity.exr")).unwrap();
            let dx = |name: &str, x: usize, y: usize| layer(&shifts, name).pixel(x, y)[0];
            for y in 0..height {
                for x in 8..width - 8 {
                    let d = disparity[(y, x)];
                    let truth =
                        0.5 * (dx("B", x, y) + dx("D", x, y) - dx("A", x, y) - dx("C", x, y));
                    assert!(
                        (d - truth).abs() < 1e-5 || (truth.is_nan() && d == 1024.0),
                        "{d} {truth}"
                    );
                    if d.abs() < 512.0 && d.abs() > 0.5 {
                        // A point seen at x in c is at x + d/2 in l; flow = −d leads from there to its place in r.
                        let (d, flow) = (f64::from(d), -f64::from(d));
                        let from = x as f64 + 0.5 * d;
                        let error = |flow: f64| {
                            (green(&left, from, y) - green(&right, from + flow, y)).powi(2)
                        };
                        let wrong = x as f64 - 0.5 * d;
                        along += error(flow);
                        against +=
                            (green(&left, wrong, y) - green(&right, wrong - flow, y)).powi(2);
                        count += 1;
                    }
                }
            }
        }
    }
    assert!(count > 500, "{count} shifted pixels");
    assert!(
        along < 0.5 * against,
        "{along} with flow = −disparity, {against} with the other sign"
    );
}

/// What a WebDataset reader does with a shard: members in file order, grouped while the key (the name up to its first
/// dot) stays.
fn groups(path: &Path) -> Vec<(String, BTreeMap<String, Vec<u8>>)> {
    let mut archive = tar::Archive::new(fs::File::open(path).unwrap());
    let mut groups: Vec<(String, BTreeMap<String, Vec<u8>>)> = Vec::new();
    for entry in archive.entries().unwrap() {
        let mut entry = entry.unwrap();
        let header = entry.header();
        assert_eq!(
            (
                header.mtime().unwrap(),
                header.uid().unwrap(),
                header.gid().unwrap()
            ),
            (0, 0, 0)
        );
        let name = entry.path().unwrap().display().to_string();
        let (key, ending) = name.split_once('.').unwrap();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        if groups.last().is_none_or(|(last, _)| last != key) {
            groups.push((key.to_string(), BTreeMap::new()));
        }
        groups
            .last_mut()
            .unwrap()
            .1
            .insert(ending.to_string(), bytes);
    }
    groups
}

#[test]
fn webdataset_shards_keep_a_samples_files_together_and_are_indexed() {
    let folder = tempfile::tempdir().unwrap();
    let (root, out) = exported(folder.path(), "webdataset", &["--shard-mb", "1"]);
    let truth = files(&root);
    let mut seen = Vec::new();
    for set in ["train", "val", "test"] {
        let list = fs::read_to_string(root.join(format!("splits/{set}.txt"))).unwrap();
        let Ok(text) = fs::read(out.join(format!("{set}.json"))) else {
            assert!(list.is_empty());
            continue;
        };
        let index: serde_json::Value = serde_json::from_slice(&text).unwrap();
        assert_eq!(index["__kind__"], "wids-shard-index-v1");
        let mut of_set = Vec::new();
        for shard in index["shardlist"].as_array().unwrap() {
            let path = out.join(shard["url"].as_str().unwrap());
            let bytes = fs::read(&path).unwrap();
            assert_eq!(shard["filesize"], bytes.len());
            assert_eq!(shard["blake3"], blake3::hash(&bytes).to_hex().as_str());
            let groups = groups(&path);
            assert_eq!(shard["nsamples"], groups.len());
            for (key, members) in groups {
                for (ending, bytes) in &members {
                    assert!(
                        bytes == &truth[&format!("samples/{key}/{ending}")],
                        "{key}.{ending}"
                    );
                }
                let own = truth
                    .keys()
                    .filter(|n| n.starts_with(&format!("samples/{key}/")));
                assert_eq!(own.count(), members.len());
                of_set.push(key);
            }
        }
        assert_eq!(of_set, list.lines().collect::<Vec<_>>());
        seen.extend(of_set);
    }
    assert_eq!(seen.len(), 3);
    // Again: the same bytes.
    let second = folder.path().join("second");
    let arguments = [
        "export",
        root.to_str().unwrap(),
        "--layout",
        "webdataset",
        "--shard-mb",
        "1",
        "-o",
    ];
    done(&[&arguments[..], &[second.to_str().unwrap()]].concat());
    assert!(files(&out) == files(&second));
}

#[test]
fn noisy_captures_are_exported_and_unfit_datasets_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (root, clean) = exported(folder.path(), "dpdd", &[]);
    let export = |out: &str, more: &[&str]| {
        let out = folder.path().join(out);
        let arguments = [
            "export",
            root.to_str().unwrap(),
            "-o",
            out.to_str().unwrap(),
        ];
        (qpgen(&[&arguments[..], more].concat()), out)
    };
    let (noisy, out) = export("noisy", &["--layout", "dpdd", "--noisy"]);
    assert!(noisy.status.success(), "{noisy:?}");
    let (a, b) = (files(&clean), files(&out));
    let source = a.keys().find(|n| n.contains("_c/source")).unwrap();
    assert!(
        a[source] != b[source]
            && a[&source.replace("source", "target")] == b[&source.replace("source", "target")]
    );
    // A flipped byte, a folder that is there, a folder that is no dataset.
    let path = root.join("samples/000001/views.exr");
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).unwrap();
    for layout in ["dpdd", "qpdnet", "webdataset"] {
        let (output, out) = export("broken", &["--layout", layout]);
        refused(&output, "000001/views.exr");
        assert!(!out.exists());
    }
    let (again, _) = export("noisy", &["--layout", "dpdd"]);
    assert_eq!(again.status.code(), Some(2));
    let other = folder.path().join("none");
    let no_dataset = qpgen(&[
        "export",
        clean.to_str().unwrap(),
        "--layout",
        "dpdd",
        "-o",
        other.to_str().unwrap(),
    ]);
    assert_eq!(no_dataset.status.code(), Some(2));
    let leftovers = fs::read_dir(folder.path()).unwrap().filter(|e| {
        let name = e.as_ref().unwrap().file_name();
        name.to_string_lossy().contains(".tmp-")
    });
    assert_eq!(leftovers.count(), 0);
}

#[test]
fn exports_say_which_truth_they_carry() {
    let folder = tempfile::tempdir().unwrap();
    for layout in ["dpdd", "qpdnet", "webdataset"] {
        let (root, out) = exported(folder.path(), layout, &[]);
        let read = |path: PathBuf| -> serde_json::Value {
            serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
        };
        let (meta, index) = (
            read(root.join("samples/000000/meta.json")),
            read(out.join("export.json")),
        );
        let truth = &index["truth"];
        assert_eq!(truth["registration"], meta["truth"]["registration"]);
        assert_eq!(truth["channels_differ"], meta["truth"]["channels_differ"]);
        assert_eq!(
            (&truth["registration"], &truth["channel"], &truth["kind"]),
            (&"centroid".into(), &"G".into(), &"centroid".into())
        );
        let text = index["conventions"].as_str().unwrap();
        assert!(
            text.contains("green") && text.contains("registration"),
            "{text}"
        );
    }
}
