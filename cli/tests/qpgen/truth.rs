//! What a sample says of itself holds: no layout clips, errors are those between two seeds, depth comes back from
//! disparity.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use std::fs;

use quadpixel::image::exr::read_layers;
use quadpixel_datasets::{CameraDescription, DisparityCurves, check_dataset, parse};

use crate::common::small::{SMALL, dataset, with_values};
use crate::common::{findings_with, layer, meta, render};

#[test]
fn no_layout_of_sub_pixels_clips_the_mosaic() {
    let folder = tempfile::tempdir().unwrap();
    for layout in ["1x1", "2x1", "2x2", "3x3", "4x4"] {
        let quoted = format!("\"{layout}\"");
        let text = with_values(
            SMALL,
            &[
                ("sensor.subpixels", &quoted),
                ("readout.photons_um2", "1000"),
                ("exposure_ev", "-1"),
            ],
        );
        let made = dataset(folder.path(), layout, &text, &[]);
        let said = String::from_utf8_lossy(&made.stderr).into_owned();
        assert!(!said.contains("saturated"), "{layout}: {said}");
        let root = folder.path().join(layout);
        assert_eq!(check_dataset(&root, &mut |_| {}).findings, [], "{layout}");
        for sample in 0..2 {
            assert_eq!(meta(&root, sample).raw.clipped, 0, "{layout}");
        }
    }
}

#[test]
fn a_mosaic_whose_saturation_is_told_wrong_is_found() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "plain", SMALL, &[]);
    let root = folder.path().join("plain");
    let text = fs::read_to_string(root.join("samples/000000/meta.json")).unwrap();
    let mut described: serde_json::Value = serde_json::from_str(&text).unwrap();
    described["raw"]["clipped"] = 7.into();
    let findings = findings_with(&root, "meta.json", described.to_string().as_bytes());
    let found = findings
        .iter()
        .any(|f| f.contains("says that 7 were clipped"));
    assert!(found, "{findings:?}");
}

#[test]
fn stated_errors_are_those_between_two_seeds() {
    let folder = tempfile::tempdir().unwrap();
    let text = with_values(
        SMALL,
        &[
            ("sensor.width", "96"),
            ("sensor.height", "96"),
            ("count", "1"),
        ],
    );
    dataset(folder.path(), "one", &text, &[]);
    let sample = folder.path().join("one/samples/000000");
    let text = fs::read_to_string(sample.join("meta.json")).unwrap();
    let mut described: serde_json::Value = serde_json::from_str(&text).unwrap();
    described["scene"]["parameters"]["render"]["seed"] = 77.into();
    let other = folder.path().join("other.json");
    fs::write(&other, described.to_string()).unwrap();
    let out = folder.path().join("again");
    render(&other, &out);
    let views = |folder: &std::path::Path| -> Vec<f64> {
        let layers = read_layers(&folder.join("views.exr")).unwrap();
        let names = ["B", "A", "D", "C"];
        let parts = names.map(|name| layer(&layers, name).data().to_vec());
        parts.concat().into_iter().map(f64::from).collect()
    };
    let (a, b) = (views(&sample), views(&out));
    let mean = a.iter().sum::<f64>() / a.len() as f64;
    let squares: f64 = a.iter().zip(&b).map(|(a, b)| (a - b) * (a - b)).sum();
    let rms = (squares / (2.0 * a.len() as f64)).sqrt() / mean;
    let mut relative: Vec<f64> = (a.iter().zip(&b).filter(|(a, b)| *a + *b > 0.0))
        .map(|(a, b)| (a - b).abs() / (0.5 * (a + b)))
        .collect();
    relative.sort_by(f64::total_cmp);
    let median = relative[relative.len() / 2] / 2f64.sqrt();
    let speckles = relative.iter().filter(|d| **d > 0.5).count() as f64 / relative.len() as f64;
    let told = meta(&folder.path().join("one"), 0).statistics;
    let ratios = [
        told.rms_error_over_mean.unwrap() / rms,
        told.median_relative_error.unwrap() / median,
    ];
    println!(
        "told over two seeds: RMS {:.3}, median {:.3}; speckles {:?} {speckles}",
        ratios[0], ratios[1], told.speckle_share
    );
    // One pixel in 64 is rendered twice: some 1700 values, alike in neighbours.
    assert!(ratios.iter().all(|r| (0.8..1.25).contains(r)), "{ratios:?}");
    assert!((told.speckle_share.unwrap() - speckles).abs() < 0.02);
}

#[test]
fn the_cameras_curve_gives_the_depth_of_the_traced_disparity_to_a_thousandth() {
    let folder = tempfile::tempdir().unwrap();
    let text = with_values(SMALL, &[("sensor.width", "256"), ("sensor.height", "192")]);
    dataset(folder.path(), "data", &text, &[]);
    for sample in 0..2 {
        let place = folder.path().join(format!("data/samples/{sample:06}"));
        let camera: CameraDescription =
            parse(&fs::read(place.join("camera.json")).unwrap()).unwrap();
        let curve = DisparityCurves::of_channel(&camera.disparity.left_right, "G").unwrap();
        assert!(curve.fit_error_px < 0.01, "{}", curve.fit_error_px);
        let maps = read_layers(&place.join("disparity.exr")).unwrap();
        let depth = read_layers(&place.join("depth.exr")).unwrap();
        let depth = &depth[0].image;
        let behind = camera.intrinsics.pinhole_behind_vertex_m;
        for y in (0..192).step_by(7) {
            for x in (0..256).step_by(7) {
                let z = f64::from(depth.pixel(x, y)[0]);
                if !z.is_finite() {
                    continue;
                }
                // Left: B and D; right: A and C. Channels are sorted: dx first.
                let dx = |name: &str| f64::from(layer(&maps, name).pixel(x, y)[0]);
                let shift = 0.5 * (dx("B") + dx("D") - dx("A") - dx("C"));
                let [c0, c1, c2] = curve.at([x as f64, y as f64], [256, 192]).unwrap();
                let t = 1.0 / (z + behind);
                let told = c0 + c1 * t + c2 * t * t;
                // As a part of t, by the curve's slope.
                let error = (shift - told) / (c1 * t);
                assert!(
                    error.abs() < 1e-3,
                    "{sample} ({x}, {y}): {shift} {told} {error}"
                );
            }
        }
    }
}
