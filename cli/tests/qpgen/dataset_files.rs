//! A dataset as written is sound, is the same every time, and every way of breaking it is found.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use crate::common;
use crate::fixture;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::files;
use fixture::{HALF_DISK_RATIO, synthetic};
use quadpixel_datasets::{DatasetManifest, Report, check_dataset};
use quadpixel_generators::writer::{
    Dataset, EarlierSample, Foreign, RawEncoding, WriteError, earlier_sample, finish_dataset,
    write_sample,
};

const SIZE: [u32; 2] = [48, 32];

fn write(root: &Path, count: u32, subpixels: [u32; 2]) -> DatasetManifest {
    for index in 0..count {
        write_sample(root, &synthetic(index, SIZE, subpixels).files()).unwrap();
    }
    finish(root, count)
}

fn finish(root: &Path, count: u32) -> DatasetManifest {
    let dataset = Dataset {
        seed: 7,
        configuration: serde_json::json!({"lens": "thin"}),
        inputs: BTreeMap::new(),
        licence: "CC0-1.0",
        count,
    };
    finish_dataset(root, &dataset, Foreign::Refuse).unwrap()
}

fn check(root: &Path) -> Report {
    let mut last = None;
    let report = check_dataset(root, &mut |progress| last = Some(progress));
    if report.findings.is_empty() {
        let last = last.unwrap();
        assert_eq!(last.done, last.total);
    }
    report
}

#[test]
fn a_dataset_as_written_is_sound_for_every_pixel_kind_and_raw_format() {
    for subpixels in [[1, 1], [2, 1], [1, 2], [2, 2], [3, 3], [4, 4]] {
        let folder = tempfile::tempdir().unwrap();
        let manifest = write(folder.path(), 1, subpixels);
        let report = check(folder.path());
        assert_eq!(report.findings, [], "{subpixels:?}");
        assert_eq!(report.files, manifest.files.len());
    }
    let folder = tempfile::tempdir().unwrap();
    let mut sample = synthetic(0, SIZE, [2, 2]);
    sample.raw_encoding = RawEncoding::Exr;
    write_sample(folder.path(), &sample.files()).unwrap();
    finish(folder.path(), 1);
    assert_eq!(check(folder.path()).findings, []);
}

#[test]
fn the_same_samples_give_the_same_bytes_on_any_number_of_threads() {
    let written: Vec<_> = [1, 3]
        .into_iter()
        .map(|threads| {
            let folder = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| write(folder.path(), 2, [2, 2]));
            files(folder.path())
        })
        .collect();
    assert!(written[0] == written[1]);
}

#[test]
fn the_half_disk_ratio_of_disparity_to_defocus_is_recovered() {
    let folder = tempfile::tempdir().unwrap();
    let written = write_sample(folder.path(), &synthetic(0, SIZE, [2, 2]).files()).unwrap();
    let ratio = written.coc_disparity.unwrap();
    // Disparities of about a px are stored to 2^-12 px.
    let stored = 0.5f64.powi(12);
    assert!(
        (ratio.paraxial_ratio - HALF_DISK_RATIO).abs() < stored,
        "{ratio:?}"
    );
    // The ripple of the fixture's traced disparity is common to all sub-pixels and falls out.
    assert!(
        (ratio.traced_ratio - HALF_DISK_RATIO).abs() < stored,
        "{ratio:?}"
    );
    let one = write_sample(folder.path(), &synthetic(1, SIZE, [1, 2]).files()).unwrap();
    assert!(one.coc_disparity.is_none());
    // Three pixels were marked, one has a NaN in a single map: all maps are NaN at all four.
    assert_eq!(written.statistics.invalid_pixels, 4);
}

#[test]
fn a_flipped_byte_in_any_file_is_found_by_its_hash() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = write(folder.path(), 1, [2, 2]);
    for entry in &manifest.files {
        let path = folder.path().join(&entry.path);
        let sound = fs::read(&path).unwrap();
        if sound.is_empty() {
            continue; // the list of a split without samples
        }
        let mut broken = sound.clone();
        broken[sound.len() / 2] ^= 1;
        fs::write(&path, &broken).unwrap();
        let findings = check(folder.path()).findings;
        assert!(
            findings
                .iter()
                .any(|f| f.path == entry.path && f.what.contains("hash")),
            "{entry:?}"
        );
        fs::write(&path, &sound).unwrap();
    }
    assert_eq!(check(folder.path()).findings, []);
}

#[test]
fn truncated_missing_and_stray_files_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = write(folder.path(), 1, [2, 2]);
    for entry in &manifest.files {
        let path = folder.path().join(&entry.path);
        let sound = fs::read(&path).unwrap();
        if !sound.is_empty() {
            fs::write(&path, &sound[..sound.len() - 1]).unwrap();
            let findings = check(folder.path()).findings;
            assert!(
                findings
                    .iter()
                    .any(|f| f.path == entry.path && f.what.contains("bytes"))
            );
        }
        fs::remove_file(&path).unwrap();
        let findings = check(folder.path()).findings;
        assert!(
            findings
                .iter()
                .any(|f| f.path == entry.path && f.what.contains("no such file"))
        );
        fs::write(&path, &sound).unwrap();
    }
    let stray = folder.path().join("samples/000000/raw.png.tmp-12");
    fs::write(&stray, b"x").unwrap();
    let findings = check(folder.path()).findings;
    assert!(findings[0].what.contains("interrupted"), "{findings:?}");
    fs::remove_file(stray).unwrap();
    let full = fs::read(folder.path().join("dataset.json")).unwrap();
    for length in (0..full.len()).step_by(97) {
        fs::write(folder.path().join("dataset.json"), &full[..length]).unwrap();
        assert_eq!(check(folder.path()).findings[0].path, "dataset.json");
    }
    assert_eq!(
        check(&folder.path().join("none")).findings[0].path,
        "dataset.json"
    );
}

/// Replaces a file and its hash, as a faulty writer would have written it.
fn rewrite(root: &Path, manifest: &DatasetManifest, path: &str, bytes: &[u8]) {
    fs::write(root.join(path), bytes).unwrap();
    let mut manifest = manifest.clone();
    let entry = manifest
        .files
        .iter_mut()
        .find(|entry| entry.path == path)
        .unwrap();
    *entry = quadpixel_datasets::FileEntry::new(path, bytes);
    fs::write(
        root.join("dataset.json"),
        serde_json::to_vec(&manifest).unwrap(),
    )
    .unwrap();
}

#[test]
fn garbage_with_a_right_hash_is_a_finding_and_never_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = write(folder.path(), 1, [2, 2]);
    for entry in manifest
        .files
        .iter()
        .filter(|entry| entry.path.contains("000000"))
    {
        let sound = fs::read(folder.path().join(&entry.path)).unwrap();
        rewrite(folder.path(), &manifest, &entry.path, b"garbage");
        let findings = check(folder.path()).findings;
        assert!(
            findings.iter().any(|f| f.path == entry.path),
            "{}: {findings:?}",
            entry.path
        );
        // Bytes changed within: whatever the decoder makes of it, the check comes back.
        for place in (0..sound.len()).step_by((sound.len() / 12).max(1)) {
            let mut broken = sound.clone();
            broken[place] ^= 0x5a;
            rewrite(folder.path(), &manifest, &entry.path, &broken);
            check(folder.path());
        }
        rewrite(folder.path(), &manifest, &entry.path, &sound);
    }
    assert_eq!(check(folder.path()).findings, []);
}

#[test]
fn a_manifest_that_leads_out_of_the_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("set");
    let mut manifest = write(&root, 1, [2, 1]);
    fs::write(folder.path().join("secret"), b"x").unwrap();
    manifest
        .files
        .push(quadpixel_datasets::FileEntry::new("../secret", b"x"));
    manifest.samples[0].id = "../..".into();
    fs::write(
        root.join("dataset.json"),
        serde_json::to_vec(&manifest).unwrap(),
    )
    .unwrap();
    let findings = check(&root).findings;
    assert!(
        findings.iter().any(|f| f.what.contains("../secret")),
        "{findings:?}"
    );
    assert!(
        findings.iter().any(|f| f.what.contains("six digits")),
        "{findings:?}"
    );
}

#[test]
fn a_scene_in_two_splits_and_a_wrong_list_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut manifest = write(folder.path(), 3, [2, 1]);
    for sample in &mut manifest.samples {
        sample.scene = "the same".into();
    }
    manifest.samples[0].split = quadpixel_datasets::Split::Train;
    manifest.samples[1].split = quadpixel_datasets::Split::Test;
    fs::write(
        folder.path().join("dataset.json"),
        serde_json::to_vec(&manifest).unwrap(),
    )
    .unwrap();
    let findings = check(folder.path()).findings;
    assert!(
        findings.iter().any(|f| f.what.contains("two splits")),
        "{findings:?}"
    );
    assert!(
        findings.iter().any(|f| f.path.starts_with("splits/")),
        "{findings:?}"
    );
}

#[test]
fn an_interrupted_run_goes_on_and_another_configuration_is_kept_out() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let whole = write(root, 3, [2, 2]);
    let other = tempfile::tempdir().unwrap();
    let first = write_sample(other.path(), &synthetic(0, SIZE, [2, 2]).files()).unwrap();
    fs::create_dir_all(other.path().join("samples/.tmp-000001")).unwrap();
    fs::write(other.path().join("samples/.tmp-000001/raw.png"), b"half").unwrap();
    let hash = &first.configuration_blake3;
    for index in 0..3 {
        let found = earlier_sample(other.path(), index, hash).unwrap();
        assert_eq!(found == EarlierSample::Whole, index == 0, "{found:?}");
        if found != EarlierSample::Whole {
            write_sample(other.path(), &synthetic(index, SIZE, [2, 2]).files()).unwrap();
        }
    }
    for half_made in [
        "dataset.json.tmp-7",
        "run.json.tmp-8",
        "splits/val.txt.tmp-9",
    ] {
        fs::create_dir_all(other.path().join("splits")).unwrap();
        fs::write(other.path().join(half_made), b"half").unwrap();
    }
    assert_eq!(finish(other.path(), 3), whole);
    assert!(files(root) == files(other.path()));
    let changed = quadpixel::hash::json_hash(&serde_json::json!({"lens": "thick"}));
    let error = earlier_sample(root, 0, &changed).unwrap_err();
    assert!(matches!(error, WriteError::Occupied { .. }), "{error}");
    let again = write_sample(root, &synthetic(0, SIZE, [2, 2]).files()).unwrap_err();
    assert!(matches!(again, WriteError::Occupied { .. }), "{again}");
}

#[test]
fn a_damaged_sample_is_taken_away_and_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let meta = write_sample(root, &synthetic(0, SIZE, [2, 2]).files()).unwrap();
    let (sample, hash) = (root.join("samples/000000"), &meta.configuration_blake3);
    type Damage = fn(&Path);
    let damages: [Damage; 4] = [
        |sample| fs::write(sample.join("raw.png"), b"short").unwrap(),
        |sample| fs::remove_file(sample.join("depth.exr")).unwrap(),
        |sample| fs::write(sample.join("meta.json"), b"{}").unwrap(),
        |sample| fs::remove_file(sample.join("meta.json")).unwrap(),
    ];
    for damage in damages {
        damage(&sample);
        let found = earlier_sample(root, 0, hash).unwrap();
        assert!(matches!(found, EarlierSample::Broken(_)), "{found:?}");
        assert_eq!(fs::read_dir(root.join("samples")).unwrap().count(), 0);
        write_sample(root, &synthetic(0, SIZE, [2, 2]).files()).unwrap();
        assert_eq!(earlier_sample(root, 0, hash).unwrap(), EarlierSample::Whole);
    }
}

#[test]
fn light_above_half_precision_is_kept_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    for raw in [None, Some(RawEncoding::Exr)] {
        let root = folder.path().join(format!("{}", raw.is_some()));
        let mut bright = synthetic(0, SIZE, [2, 2]);
        bright.raw_encoding = raw.unwrap_or(bright.raw_encoding);
        // The sun of an ordinary panorama.
        bright.target.data_mut()[0] = 5.4321e5;
        bright.raw.data_mut()[10] = 5e5;
        write_sample(&root, &bright.files()).unwrap();
        finish(&root, 1);
        assert_eq!(check(&root).findings, []);
        let target = root.join("samples/000000/target.exr");
        let target = quadpixel::image::exr::read_layers(&target).unwrap();
        assert_eq!(target[0].image.data()[0], 5.4321e5);
    }
}

#[test]
fn light_that_is_no_light_and_wrong_sizes_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut dark = synthetic(0, SIZE, [2, 2]);
    dark.raw.data_mut()[10] = -0.5;
    let text = write_sample(folder.path(), &dark.files())
        .unwrap_err()
        .to_string();
    assert!(text.contains("raw is -0.5 at column 3, row 0"), "{text}");
    let mut endless = synthetic(0, SIZE, [2, 2]);
    endless.target.data_mut()[0] = f32::INFINITY;
    assert!(write_sample(folder.path(), &endless.files()).is_err());
    let mut short = synthetic(0, SIZE, [2, 2]);
    short.valid.pop();
    assert!(write_sample(folder.path(), &short.files()).is_err());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    // A file where the folder should be: named, and no panic.
    let blocked = folder.path().join("file");
    fs::write(&blocked, b"x").unwrap();
    let text = write_sample(&blocked, &synthetic(0, SIZE, [2, 2]).files())
        .unwrap_err()
        .to_string();
    assert!(text.contains("file"), "{text}");
}
