//! The committed JSON Schemas are those of the types, and a description validates against them.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use std::path::Path;

use quadpixel_datasets::{
    CameraDescription, DatasetManifest, FileKind, Optional, SampleMeta, camera_schema,
    dataset_schema, sample_files, sample_schema,
};
use serde_json::{Value, json};

/// Rewrites the files when QUADPIXEL_WRITE_SCHEMA is set; otherwise compares.
fn is_current(name: &str, schema: &Value) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("schema")
        .join(name);
    let text = serde_json::to_string_pretty(schema).unwrap() + "\n";
    if std::env::var_os("QUADPIXEL_WRITE_SCHEMA").is_some() {
        std::fs::write(&path, &text).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    assert_eq!(
        committed, text,
        "schema/{name} is out of date: QUADPIXEL_WRITE_SCHEMA=1 cargo test -p quadpixel-datasets --release --test schema"
    );
}

#[test]
fn committed_schemas_are_those_of_the_types() {
    is_current("dataset.schema.json", &dataset_schema());
    is_current("meta.schema.json", &sample_schema());
    is_current("camera.schema.json", &camera_schema());
}

#[test]
fn the_examples_validate_and_come_back_unchanged() {
    let dataset: Value =
        serde_json::from_str(include_str!("../schema/dataset.example.json")).unwrap();
    let meta: Value = serde_json::from_str(include_str!("../schema/meta.example.json")).unwrap();
    let camera: Value =
        serde_json::from_str(include_str!("../schema/camera.example.json")).unwrap();
    for (schema, example) in [
        (dataset_schema(), &dataset),
        (sample_schema(), &meta),
        (camera_schema(), &camera),
    ] {
        let validator = jsonschema::validator_for(&schema).unwrap();
        let errors: Vec<String> = validator
            .iter_errors(example)
            .map(|e| e.to_string())
            .collect();
        assert!(errors.is_empty(), "{errors:?}");
    }
    let read: DatasetManifest = serde_json::from_value(dataset.clone()).unwrap();
    assert_eq!(serde_json::to_value(read).unwrap(), dataset);
    let read: SampleMeta = serde_json::from_value(meta.clone()).unwrap();
    assert_eq!(serde_json::to_value(&read).unwrap(), meta);
    // One example: what the camera says of itself is what the sample says of the camera.
    let described: CameraDescription = serde_json::from_value(camera.clone()).unwrap();
    assert_eq!(described, read.camera(described.curves()));
    assert_eq!(serde_json::to_value(described).unwrap(), camera);
}

#[test]
fn schema_and_reader_refuse_the_same_faults() {
    let meta: Value = serde_json::from_str(include_str!("../schema/meta.example.json")).unwrap();
    let validator = jsonschema::validator_for(&sample_schema()).unwrap();
    let faults: [(&str, Value); 5] = [
        ("/new_field", json!(1)),
        ("/sensor/pitch_um", json!("3.5")),
        ("/sensor/width_px", json!(-1)),
        ("/raw/format", json!("tiff")),
        ("/lens/unknown", json!(null)),
    ];
    for (pointer, value) in faults {
        let mut broken = meta.clone();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = broken.pointer_mut(parent).unwrap();
        parent
            .as_object_mut()
            .unwrap()
            .insert(key.to_string(), value);
        assert!(!validator.is_valid(&broken), "{pointer}");
        assert!(
            serde_json::from_value::<SampleMeta>(broken).is_err(),
            "{pointer}"
        );
    }
    let mut missing = meta.clone();
    missing.as_object_mut().unwrap().remove("seed");
    assert!(!validator.is_valid(&missing));
    assert!(serde_json::from_value::<SampleMeta>(missing).is_err());
}

#[test]
fn every_sample_has_the_map_of_distance() {
    let meta: SampleMeta =
        serde_json::from_str(include_str!("../schema/meta.example.json")).unwrap();
    let (raw, optional) = (meta.raw.format, Optional::default());
    let files = sample_files(&meta.sensor, &meta.channels, raw, optional, [1, 1]);
    let has = |kind| files.iter().any(|file| file.kind == kind);
    assert!(has(FileKind::Depth) && has(FileKind::Distance) && !has(FileKind::Noisy));
}
