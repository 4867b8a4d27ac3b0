//! `[camera_pictures]`: pictures as a camera writes them, and the way back.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::fs;
use std::path::Path;

use common::qpgen;
use common::small::{SMALL, dataset, refused_config, with_values};
use quadpixel::image::exr::read_layers;
use quadpixel::image::raster;
use quadpixel_datasets::{CameraPictures, SampleMeta};

const CAMERA: [(&str, &str); 4] = [
    ("count", "1"),
    ("camera_pictures.white_balance", "[1.1, 1.0, 0.9]"),
    (
        "camera_pictures.matrix",
        "[[1.3, -0.2, -0.1], [-0.1, 1.2, -0.1], [0.0, -0.3, 1.3]]",
    ),
    (
        "camera_pictures.tone_curve",
        "[[0, 0], [0.25, 0.2], [0.75, 0.82], [1, 1]]",
    ),
];

/// RMS and mean of |difference| of a camera-like picture, taken back, from the linear sum, over the sum's mean; where
/// no code was cut.
fn round_trip(sample: &Path, file: &str, how: &CameraPictures) -> (f64, f64) {
    let codes = raster::read(&sample.join(file)).unwrap();
    let layers = read_layers(&sample.join("views.exr")).unwrap();
    let sum = layers.iter().find(|layer| layer.name == "sum").unwrap();
    let order = ["R", "G", "B"].map(|c| sum.channels.iter().position(|n| n == c).unwrap());
    let (mut square, mut off, mut total, mut count) = (0.0, 0.0, 0.0, 0.0);
    for y in 0..codes.height() {
        for x in 0..codes.width() {
            let code: [f64; 3] = std::array::from_fn(|c| 255.0 * f64::from(codes.pixel(x, y)[c]));
            if code.iter().any(|c| !(0.5..254.5).contains(c)) {
                continue;
            }
            let back = how.development.linear(code).unwrap();
            for (c, back) in back.into_iter().enumerate() {
                let linear = f64::from(sum.image.pixel(x, y)[order[c]]);
                square += (back - linear).powi(2);
                off += (back - linear).abs();
                total += linear;
                count += 1.0;
            }
        }
    }
    ((square / count).sqrt() / (total / count), off / total)
}

#[test]
fn pictures_of_a_camera_come_back_to_linear_values() {
    let folder = tempfile::tempdir().unwrap();
    let plain = with_values(SMALL, &[("count", "1")]);
    dataset(folder.path(), "plain", &plain, &[]);
    for (name, quality, file, most) in [
        ("png", "", "camera.png", 0.01),
        ("jpeg95", "95", "camera.jpg", 0.08),
        ("jpeg75", "75", "camera.jpg", 0.2),
    ] {
        let mut text = with_values(SMALL, &CAMERA);
        if !quality.is_empty() {
            text = with_values(&text, &[("camera_pictures.jpeg_quality", quality)]);
        }
        dataset(folder.path(), name, &text, &[]);
        let root = folder.path().join(name);
        let checked = qpgen(&["check", root.to_str().unwrap()]);
        assert!(checked.status.success(), "{name}: {checked:?}");
        let sample = root.join("samples/000000");
        let meta = fs::read(sample.join("meta.json")).unwrap();
        let meta: SampleMeta = quadpixel_datasets::parse(&meta).unwrap();
        let how = meta.camera_pictures.unwrap();
        let (rms, mean) = round_trip(&sample, file, &how);
        println!("{name}: round trip {rms:.4} RMS, {mean:.4} mean, of the mean");
        assert!(rms < most, "{name}: {rms}");
        // The linear files are those without.
        for same in ["views.exr", "raw.png", "target.exr"] {
            let read = |name: &str| {
                fs::read(folder.path().join(name).join("samples/000000").join(same)).unwrap()
            };
            assert_eq!(read(name), read("plain"), "{same}");
        }
        // A picture that is not the views' is found.
        let path = sample.join(file);
        let (width, height) = (40, 32);
        let grey = vec![77; 3 * width * height];
        let other = match quality {
            "" => raster::encode_png8(&path, &grey, width, height, 3),
            _ => raster::encode_jpeg(&path, &grey, width, height, 95),
        };
        fs::write(&path, other.unwrap()).unwrap();
        let checked = qpgen(&["check", root.to_str().unwrap()]);
        assert!(!checked.status.success());
    }
}

#[test]
fn what_cannot_be_undone_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (place, value, why) in [
        (
            "camera_pictures.tone_curve",
            "[[0, 0], [0.5, 0.6], [0.7, 0.6], [1, 1]]",
            "tone_curve",
        ),
        (
            "camera_pictures.tone_curve",
            "[[0, 0], [1, 0.9]]",
            "tone_curve",
        ),
        (
            "camera_pictures.matrix",
            "[[1, 1, 1], [1, 1, 1], [0, 0, 1]]",
            "matrix",
        ),
        (
            "camera_pictures.white_balance",
            "[1, 0, 1]",
            "white_balance",
        ),
        ("camera_pictures.jpeg_quality", "0", "1 to 100"),
        ("camera_pictures.noisy", "true", "[readout]"),
        (
            "lens.reflections",
            "{ coating = 1.5 }",
            "reflections.coating",
        ),
        (
            "lens.reflections",
            "{ sensor = -0.1 }",
            "reflections.sensor",
        ),
    ] {
        refused_config(folder.path(), &with_values(SMALL, &[(place, value)]), why);
    }
}
