//! Pictures that decode and have the right hash but break a rule of SPEC.md: each is found, by file and by place.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use crate::fixture;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use fixture::synthetic;
use quadpixel::image::exr::{Compression, Layer, NamedLayer, Sample, encode_layers, read_layers};
use quadpixel::image::{Image, raster};
use quadpixel_datasets::{DatasetManifest, FileEntry, SampleMeta, check_dataset};
use quadpixel_generators::writer::{Dataset, Foreign, finish_dataset, write_sample};

const SIZE: [u32; 2] = [40, 30];
const FOLDER: &str = "samples/000000";

fn dataset(root: &Path) -> DatasetManifest {
    write_sample(root, &synthetic(0, SIZE, [2, 2]).files()).unwrap();
    let dataset = Dataset {
        seed: 1,
        configuration: serde_json::Value::Null,
        inputs: BTreeMap::new(),
        licence: "CC0-1.0",
        count: 1,
    };
    finish_dataset(root, &dataset, Foreign::Refuse).unwrap()
}

/// Puts `bytes` in the place of a file as a faulty writer would have: with its hash.
fn replace(root: &Path, manifest: &mut DatasetManifest, name: &str, bytes: &[u8]) {
    let mut put = |name: &str, bytes: &[u8]| {
        let path = format!("{FOLDER}/{name}");
        fs::write(root.join(&path), bytes).unwrap();
        let entry = manifest.files.iter_mut().find(|entry| entry.path == path);
        *entry.unwrap() = FileEntry::new(&path, bytes);
    };
    put(name, bytes);
    if name != "meta.json" {
        let meta = fs::read(root.join(FOLDER).join("meta.json")).unwrap();
        let mut meta: SampleMeta = serde_json::from_slice(&meta).unwrap();
        let own = meta.contents.iter_mut().find(|own| own.path == name);
        *own.unwrap() = FileEntry::new(name, bytes);
        put("meta.json", &serde_json::to_vec(&meta).unwrap());
    }
    let text = serde_json::to_vec(&manifest).unwrap();
    fs::write(root.join("dataset.json"), text).unwrap();
}

/// What the check says of `name` after `change` was made to its layers.
fn after(name: &str, sample: Sample, change: impl Fn(&mut Vec<NamedLayer>)) -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    let mut manifest = dataset(folder.path());
    let path = folder.path().join(FOLDER).join(name);
    let mut layers = read_layers(&path).unwrap();
    change(&mut layers);
    let names: Vec<Vec<&str>> = layers
        .iter()
        .map(|layer| layer.channels.iter().map(String::as_str).collect())
        .collect();
    let written: Vec<Layer<'_>> = layers
        .iter()
        .zip(&names)
        .map(|(layer, channels)| Layer {
            name: &layer.name,
            channels,
            image: &layer.image,
            sample,
        })
        .collect();
    let bytes = encode_layers(&path, &written, Compression::Zip).unwrap();
    replace(folder.path(), &mut manifest, name, &bytes);
    findings(folder.path())
}

fn findings(root: &Path) -> Vec<String> {
    let report = check_dataset(root, &mut |_| {});
    report.findings.iter().map(ToString::to_string).collect()
}

fn assert_finds(findings: &[String], file: &str, parts: &[&str]) {
    let found = findings
        .iter()
        .any(|text| text.contains(file) && parts.iter().all(|part| text.contains(part)));
    assert!(found, "{file} {parts:?} not in {findings:#?}");
}

fn set(layers: &mut [NamedLayer], x: usize, y: usize, value: f32) {
    layers[0].image.pixel_mut(x, y)[0] = value;
}

#[test]
fn truth_filled_with_zero_where_it_is_invalid_is_found() {
    // The fixture marks the first three pixels of row 0 invalid.
    for (file, channel) in [
        ("depth.exr", "Z"),
        ("coc.exr", "coc"),
        ("disparity.exr", "A.dx"),
    ] {
        let found = after(file, Sample::Float, |layers| set(layers, 1, 0, 0.0));
        let what = [channel, "column 1, row 0", "valid.png is 0"];
        assert_finds(&found, file, &what);
    }
}

#[test]
fn nan_where_truth_is_valid_is_found() {
    for file in ["depth.exr", "distance.exr", "coc.exr", "disparity.exr"] {
        let found = after(file, Sample::Float, |layers| set(layers, 7, 9, f32::NAN));
        assert_finds(
            &found,
            file,
            &["column 7, row 9", "NaN where valid.png is 255"],
        );
    }
}

#[test]
fn impossible_depths_and_shifts_are_found() {
    let found = after("depth.exr", Sample::Float, |layers| set(layers, 7, 9, -2.0));
    assert_finds(&found, "depth.exr", &["column 7, row 9", "not above 0"]);
    let found = after("distance.exr", Sample::Float, |layers| {
        set(layers, 0, 29, 0.1)
    });
    assert_finds(
        &found,
        "distance.exr",
        &["column 0, row 29", "less than the depth"],
    );
    let found = after("coc.exr", Sample::Float, |layers| {
        set(layers, 7, 9, f32::INFINITY)
    });
    assert_finds(&found, "coc.exr", &["infinite"]);
}

#[test]
fn light_below_zero_and_views_that_do_not_add_up_are_found() {
    let found = after("target.exr", Sample::Half, |layers| {
        set(layers, 3, 4, -0.25)
    });
    assert_finds(&found, "target.exr", &["column 3, row 4", "negative"]);
    // One part in 200 more light in one view: above what rounding allows in the sum and in the mosaic.
    let found = after("views.exr", Sample::Half, |layers| {
        let value = layers[0].image.pixel(20, 15)[0];
        set(layers, 20, 15, value * 1.005 + 0.001);
    });
    assert_finds(
        &found,
        "views.exr",
        &["sum.R", "column 20, row 15", "not the sum"],
    );
    // A is stored above on the right: mosaic column 2·20 + 1, row 2·15.
    assert_finds(&found, "raw.png", &["channel R", "column 41, row 30"]);
}

#[test]
fn views_stored_under_the_wrong_names_are_found_in_the_mosaic() {
    let found = after("views.exr", Sample::Half, |layers| {
        let (left, right) = layers.split_at_mut(1);
        std::mem::swap(&mut left[0].image, &mut right[0].image);
    });
    assert_finds(&found, "raw.png", &["not the views' values"]);
}

#[test]
fn wrong_number_formats_sizes_and_channels_are_found() {
    let found = after("depth.exr", Sample::Half, |_| {});
    assert_finds(&found, "depth.exr", &["Half", "Float"]);
    let found = after("coc.exr", Sample::Float, |layers| {
        layers[0].channels[0] = "blur".into()
    });
    assert_finds(&found, "coc.exr", &["blur", "coc"]);
    let found = after("coc.exr", Sample::Float, |layers| {
        layers[0].image = Image::zeros(8, 8, 1)
    });
    assert_finds(&found, "coc.exr", &["8 × 8", "40 × 30"]);
}

#[test]
fn a_mask_with_other_codes_and_a_wrong_count_are_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut manifest = dataset(folder.path());
    let codes = vec![128; (SIZE[0] * SIZE[1]) as usize];
    let bytes = raster::encode_png8(Path::new("valid.png"), &codes, 40, 30, 1).unwrap();
    replace(folder.path(), &mut manifest, "valid.png", &bytes);
    let found = findings(folder.path());
    assert_finds(&found, "valid.png", &["neither 0 nor 255"]);
    assert_finds(&found, "valid.png", &["0 pixels at 0", "meta.json says 4"]);
}

#[test]
fn a_description_that_does_not_fit_its_pictures_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut manifest = dataset(folder.path());
    let sound = fs::read_to_string(folder.path().join(FOLDER).join("meta.json")).unwrap();
    let faults = [
        (
            "\"subpixels\": \"2x2\"",
            "\"subpixels\": \"3x2\"",
            "not the files",
        ),
        (
            "\"subpixels\": \"2x2\"",
            "\"subpixels\": \"4000000000x2\"",
            "two numbers from 1 to 64",
        ),
        ("\"id\": \"000000\"", "\"id\": \"000001\"", "is of sample"),
        (
            "\"id\": \"scene-0\"",
            "\"id\": \"elsewhere\"",
            "shows scene",
        ),
        (
            "\"schema_version\": 3",
            "\"schema_version\": 9",
            "later release",
        ),
        (
            "\"schema_version\": 3",
            "\"schema_version\": 1",
            "make it again with `qpgen render`",
        ),
        ("\"pitch_um\": 3.5", "\"pitch_um\": 0.0", "sensor.pitch_um"),
        (
            "\"white_level\": 65535",
            "\"white_level\": null",
            "black level < white level",
        ),
        ("\"seed\": 100", "\"seed\": 100, \"extra\": 1", "extra"),
        (
            "\"name\": \"coc.exr\"",
            "\"name\": \"../coc.exr\"",
            "not the files",
        ),
    ];
    for (from, to, what) in faults {
        assert!(sound.contains(from), "{from}");
        let broken = sound.replacen(from, to, 1);
        replace(folder.path(), &mut manifest, "meta.json", broken.as_bytes());
        assert_finds(&findings(folder.path()), "meta.json", &[what]);
    }
    // Above 0, and no length that there is.
    let mut tiny: serde_json::Value = serde_json::from_str(&sound).unwrap();
    tiny["intrinsics"]["fx_px"] = 1e-300.into();
    let tiny = serde_json::to_vec(&tiny).unwrap();
    replace(folder.path(), &mut manifest, "meta.json", &tiny);
    let what = ["intrinsics.fx_px is 1e-300"];
    assert_finds(&findings(folder.path()), "meta.json", &what);
    replace(folder.path(), &mut manifest, "meta.json", sound.as_bytes());
    assert!(findings(folder.path()).is_empty());
}

#[test]
fn a_camera_that_is_not_the_samples_or_breaks_its_schema_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let mut manifest = dataset(folder.path());
    let sound = fs::read_to_string(folder.path().join(FOLDER).join("camera.json")).unwrap();
    let faults = [
        (
            "\"pitch_um\": 3.5",
            "\"pitch_um\": 3.6",
            "differs from meta.json",
        ),
        (
            "\"columns\": 2,\n      \"rows\"",
            "\"columns\": 3,\n      \"rows\"",
            "one value per node",
        ),
        (
            "\"lens\": \"thin-lens\"",
            "\"scene\": 1",
            "does not follow the schema",
        ),
        (
            "\"schema_version\": 3",
            "\"schema_version\": 1",
            "earlier release",
        ),
    ];
    for (from, to, what) in faults {
        assert!(sound.contains(from), "{from}");
        let broken = sound.replacen(from, to, 1);
        replace(
            folder.path(),
            &mut manifest,
            "camera.json",
            broken.as_bytes(),
        );
        assert_finds(&findings(folder.path()), "camera.json", &[what]);
    }
    replace(
        folder.path(),
        &mut manifest,
        "camera.json",
        sound.as_bytes(),
    );
    assert!(findings(folder.path()).is_empty());
}
