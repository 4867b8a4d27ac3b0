//! `qpgen` as a process, and what the tests of its files share.

#![allow(dead_code)] // because each test binary uses its own part

pub mod generator;
pub mod small;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use quadpixel::image::Image;
use quadpixel::image::exr::NamedLayer;
use quadpixel_datasets::{DatasetManifest, FileEntry, SampleMeta, check_dataset};

pub fn qpgen(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    command.args(arguments).output().unwrap()
}

/// Runs `qpgen` and expects success.
pub fn done(arguments: &[&str]) -> Output {
    let output = qpgen(arguments);
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    output
}

/// What a process said on stderr.
pub fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a successful process printed.
pub fn json(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Expects a refusal of what was asked for, and its reason.
pub fn refused(output: &Output, why: &str) {
    let said = said(output);
    assert_eq!(output.status.code(), Some(2), "{why}: {said}");
    assert!(
        said.contains(why) && !said.contains("panicked"),
        "{why}: {said}"
    );
}

/// Renders a scene file, or a sample's `meta.json`, into `out`.
pub fn render(scene: &Path, out: &Path) {
    let [scene, out] = [scene, out].map(|path| path.to_str().unwrap());
    done(&["render", scene, "--out", out]);
}

/// Every file and link below a folder, by its relative path; a link that leads nowhere is empty.
pub fn files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![root.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let kind = path.symlink_metadata().unwrap().file_type();
            if kind.is_dir() {
                folders.push(path);
                continue;
            }
            let bytes = match fs::read(&path) {
                Err(_) if kind.is_symlink() => Vec::new(),
                bytes => bytes.unwrap(),
            };
            let name = path.strip_prefix(root).unwrap().display().to_string();
            found.insert(name, bytes);
        }
    }
    found
}

/// Two folders of a sample hold the same files. The sample's number is in its `meta.json`, and heads the contact sheet.
pub fn assert_same_sample(a: &Path, b: &Path) {
    let [mut a, mut b] = [a, b].map(files);
    for all in [&mut a, &mut b] {
        all.retain(|name, _| name != "meta.json" && name != "preview.jpg");
    }
    assert!(a.keys().eq(b.keys()), "{:?}, {:?}", a.keys(), b.keys());
    for (name, bytes) in &a {
        assert!(bytes == &b[name], "{name}");
    }
}

/// Every file of a dataset's samples, but for their `meta.json`, is in another dataset to the byte.
pub fn assert_samples_kept(before: &Path, after: &Path) {
    let [before, after] = [before, after].map(|root| files(&root.join("samples")));
    for (name, bytes) in &before {
        assert!(
            name.ends_with("meta.json") || bytes == &after[name],
            "{name}"
        );
    }
}

/// What a dataset says of a sample.
pub fn meta(root: &Path, sample: usize) -> SampleMeta {
    let path = root.join(format!("samples/{sample:06}/meta.json"));
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// What the check says where `bytes` are in the place of a file of sample 0 as a faulty writer would have put them:
/// with their hash.
pub fn findings_with(root: &Path, name: &str, bytes: &[u8]) -> Vec<String> {
    let path = format!("samples/000000/{name}");
    let places = [root.join(&path), root.join("dataset.json")];
    let sound = [0, 1].map(|i| fs::read(&places[i]).unwrap());
    let mut manifest: DatasetManifest = serde_json::from_slice(&sound[1]).unwrap();
    let entry = manifest.files.iter_mut().find(|entry| entry.path == path);
    *entry.unwrap() = FileEntry::new(&path, bytes);
    fs::write(&places[0], bytes).unwrap();
    fs::write(&places[1], serde_json::to_vec(&manifest).unwrap()).unwrap();
    let report = check_dataset(root, &mut |_| {});
    for (place, bytes) in places.iter().zip(sound) {
        fs::write(place, bytes).unwrap();
    }
    report.findings.iter().map(ToString::to_string).collect()
}

/// The image of a layer.
pub fn layer<'a>(layers: &'a [NamedLayer], name: &str) -> &'a Image {
    &layers.iter().find(|l| l.name == name).unwrap().image
}

/// What the journal of an unfinished table holds.
pub fn journal_in(cache: &Path) -> Option<String> {
    let files = fs::read_dir(cache).ok()?;
    let path = files
        .filter_map(|f| Some(f.ok()?.path()))
        .find(|p| p.extension().is_some_and(|e| e == "journal"))?;
    fs::read_to_string(path).ok()
}
