//! What the tests of the binary share: running it, what a refusal is, pictures with known content.
#![allow(dead_code)] // because each test binary uses its part

use std::path::Path;
use std::process::{Command, Output};

use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};

/// Runs `qpalgo` in `folder`.
pub fn qpalgo(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_qpalgo"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Runs it with `--json` and gives what it prints; anything but exit 0 fails.
pub fn json(arguments: &[&str], folder: &Path) -> serde_json::Value {
    let run = qpalgo(&[arguments, &["--json"]].concat(), folder);
    let error = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{arguments:?}: {error}");
    serde_json::from_slice(&run.stdout).unwrap()
}

/// Exit 2, one line on stderr that holds `text`, nothing on stdout.
pub fn refused(output: &Output, text: &str) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert_eq!(error.trim_end().lines().count(), 1, "{error}");
    assert!(error.contains(text), "{text:?} is not in: {error}");
    assert!(output.stdout.is_empty());
}

/// Writes an EXR of one unnamed layer of floats: Y, or R, G, B, or channels by number.
pub fn write_exr(path: &Path, image: &Image) {
    let numbers: Vec<String> = (0..image.channels()).map(|c| c.to_string()).collect();
    let channels = match image.channels() {
        1 => vec!["Y"],
        3 => vec!["R", "G", "B"],
        _ => numbers.iter().map(String::as_str).collect(),
    };
    let layer = Layer {
        name: "",
        channels: &channels,
        image,
        sample: Sample::Float,
    };
    write_layers(path, &[layer], Compression::Zip).unwrap();
}

/// Writes an EXR with a layer of R, G, B floats for each name.
pub fn write_views(path: &Path, names: &[&str], images: &[Image]) {
    let layers: Vec<Layer<'_>> = (names.iter().zip(images))
        .map(|(name, image)| Layer {
            name,
            channels: &["R", "G", "B"],
            image,
            sample: Sample::Float,
        })
        .collect();
    write_layers(path, &layers, Compression::Zip).unwrap();
}

/// Sum of waves of 5 to 15 px in many directions: an analytic texture.
pub fn texture(x: f64, y: f64) -> f64 {
    let waves = (0..40).map(|k| {
        let k = f64::from(k);
        let (angle, period) = (2.399_963 * k, 5.0 + 10.0 * (0.618_034 * k).fract());
        let along = x * angle.cos() + y * angle.sin();
        (std::f64::consts::TAU * along / period + 1.7 * k * k).cos()
    });
    0.5 + waves.sum::<f64>() / 60.0
}

/// A picture of the texture whose content is moved right and down by `shift_px`, times `gain`.
pub fn shifted(side: usize, shift_px: [f64; 2], gain: f64) -> Image {
    let mut image = Image::zeros(side, side, 1);
    for y in 0..side {
        for x in 0..side {
            let value = texture(x as f64 - shift_px[0], y as f64 - shift_px[1]);
            image.pixel_mut(x, y)[0] = (gain * value) as f32;
        }
    }
    image
}

/// Signs of the shift of the views B, A, D, C: L and T see a near point further right and lower.
pub const SIGNS: [[f64; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]];

/// A mosaic of 2 × 2 sub-pixels, R = G = B, of the texture, times `gain`: each view is moved by half of the disparity
/// `d_px(x, y)`.
pub fn mosaic(side: usize, d_px: impl Fn(usize, usize) -> f64, gain: f64) -> Image {
    let mut mosaic = Image::zeros(2 * side, 2 * side, 3);
    for y in 0..side {
        for x in 0..side {
            let half = 0.5 * d_px(x, y);
            for (view, [sx, sy]) in SIGNS.into_iter().enumerate() {
                let value = texture(x as f64 - sx * half, y as f64 - sy * half);
                let to = mosaic.pixel_mut(2 * x + view % 2, 2 * y + view / 2);
                to.fill((0.25 * gain * value) as f32);
            }
        }
    }
    mosaic
}

/// The views of a mosaic of 2 × 2 sub-pixels: B, A, D, C.
pub fn views(mosaic: &Image) -> Vec<Image> {
    quadpixel::image::views::split_views(mosaic, quadpixel::sensor::Subpixels::QUAD)
}

/// Writes the specification's example of a `meta.json`, for 2 × 2 sub-pixels of `side` × `side` pixels and with the
/// changes given, into `folder`.
pub fn write_meta(folder: &Path, side: usize, change: impl Fn(&mut serde_json::Value)) {
    let example = include_str!("../../../../datasets_spec/schema/meta.example.json");
    let mut meta: serde_json::Value = serde_json::from_str(example).unwrap();
    meta["sensor"]["width_px"] = side.into();
    meta["sensor"]["height_px"] = side.into();
    meta["sensor"]["subpixels"] = serde_json::json!("2x2");
    change(&mut meta);
    std::fs::write(folder.join("meta.json"), meta.to_string()).unwrap();
}
