//! Depth of two analytic planes, by the dataset's relation of disparity and depth.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;

use common::{json, mosaic, qpalgo, refused, write_exr, write_meta};
use quadpixel::image::Image;
use quadpixel_algorithms::maps;

const SIDE: usize = 120;
const DEPTHS_M: [f64; 2] = [0.5, 1.2];
const FOCUS_M: f64 = 0.75;
const KAPPA: f64 = 0.3;

/// The specification's example, with this camera's numbers. Returns fx A, px·m, and p, m.
fn meta(folder: &Path, side: usize) -> (f64, f64) {
    write_meta(folder, side, |meta| {
        meta["focus"]["distance_m"] = FOCUS_M.into();
        meta["raw"]["format"] = "exr".into();
        for level in ["black_level", "white_level", "linear_at_white"] {
            meta["raw"][level] = serde_json::Value::Null;
        }
        meta["coc_disparity"] = serde_json::Value::Null;
    });
    let meta = std::fs::read(folder.join("meta.json")).unwrap();
    let meta: serde_json::Value = serde_json::from_slice(&meta).unwrap();
    let number = |name: &str| meta["intrinsics"][name].as_f64().unwrap();
    (
        number("fx_px") * number("entrance_pupil_diameter_m"),
        number("pinhole_behind_vertex_m"),
    )
}

/// A camera's disparity of a depth, px: D = κ fx A (1/d − 1/d_f).
fn disparity_px((fx_a, p): (f64, f64), z_m: f64) -> f64 {
    KAPPA * fx_a * (1.0 / (z_m + p) - 1.0 / (FOCUS_M + p))
}

/// The upper half is the near plane.
fn plane_m(y: usize) -> f64 {
    DEPTHS_M[usize::from(y >= SIDE / 2)]
}

/// Worst error in px of the disparity over the pixels that have a depth, and their number. Windows across the edge
/// between the planes see both and do not count.
fn worst_px(camera: (f64, f64), depth: &Image) -> (f64, usize) {
    let (mut worst, mut count) = (0.0f64, 0);
    for y in (0..SIDE).filter(|y| y.abs_diff(SIDE / 2) > 20) {
        for x in 0..SIDE {
            let z = f64::from(depth.pixel(x, y)[0]);
            if z.is_finite() {
                let apart = disparity_px(camera, z) - disparity_px(camera, plane_m(y));
                worst = worst.max(apart.abs());
                count += 1;
            }
        }
    }
    (worst, count)
}

#[test]
fn two_planes_come_out_at_their_depths_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let camera = meta(here, SIDE);
    let raw = mosaic(SIDE, |_, y| disparity_px(camera, plane_m(y)), 1.0);
    write_exr(&here.join("raw.exr"), &raw);
    let mut depth = Image::zeros(SIDE, SIDE, 1);
    for y in 0..SIDE {
        (0..SIDE).for_each(|x| depth.pixel_mut(x, y)[0] = plane_m(y) as f32);
    }
    write_exr(&here.join("depth.exr"), &depth);
    // Shifted copies, which windows match: dense matching expects blurs.
    let common = ["depth", ".", "-o", "out", "--sparse", "--search", "4"];
    refused(&qpalgo(&common, here), "--kappa");
    assert!(!here.join("out").exists());

    let kappa = KAPPA.to_string();
    let asked = [&common[..], &["--kappa", &kappa, "--score"]].concat();
    let printed = json(&asked, here);
    assert!(
        printed["measured_share"].as_f64().unwrap() > 0.4,
        "{printed}"
    );
    assert!(printed["score"]["count"].as_u64().unwrap() > 0);
    let read = |name: &str| maps::read(&here.join("out").join(name)).unwrap().remove(0);
    let found = read("depth.exr").image;
    let (worst, count) = worst_px(camera, &found);
    assert!(
        worst < 0.02 && count > SIDE * SIDE / 8,
        "{worst} of {count}"
    );

    // What is sure is near the truth by its own deviation, and the other formats hold the same numbers.
    let trust = read("confidence.exr");
    assert_eq!(trust.channels, ["confidence", "disparity_px", "sigma_m"]);
    for format in ["npy", "pfm"] {
        json(&[&asked[..], &["--format", format]].concat(), here);
        let bits =
            |image: &Image| -> Vec<u32> { image.data().iter().map(|v| v.to_bits()).collect() };
        let other = read(&format!("depth.{format}")).image;
        assert_eq!(bits(&other), bits(&found), "{format}");
        let other = read(&format!("confidence.{format}")).image;
        for (a, b) in (trust.image.data().chunks(3)).zip(other.data().chunks(3)) {
            // An EXR's channels stand in the order of their names.
            assert_eq!(
                [a[0].to_bits(), a[2].to_bits(), a[1].to_bits()],
                [b[0], b[1], b[2]].map(f32::to_bits),
                "{format}"
            );
        }
    }
    let picture = quadpixel::image::raster::read(&here.join("out/depth.png")).unwrap();
    // Viridis: the near plane is yellow, the far one violet; nothing is black but what was not measured.
    let [near, far] = [[60, 30], [60, 90]].map(|[x, y]: [usize; 2]| picture.pixel(x, y));
    assert!(near[0] > 0.9 && near[2] < 0.2, "{near:?}");
    assert!(far[0] < 0.35 && far[2] > 0.3, "{far:?}");
    assert_eq!(picture.pixel(0, 0), [0.0; 3]);
}

#[test]
fn a_calibration_takes_the_aberrations_own_disparity_out() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    // A smooth aberration of 0.5 to 0.7 px that looks like defocus, and a chart in focus that shows it.
    let aberration = |x: usize| 0.5 + 0.2 * x as f64 / SIDE as f64;
    for (name, side) in [("chart", SIDE), ("scene", SIDE), ("other", SIDE - 10)] {
        std::fs::create_dir(here.join(name)).unwrap();
        meta(&here.join(name), side);
    }
    let camera = meta(&here.join("scene"), SIDE);
    let chart = mosaic(SIDE, |x, _| aberration(x), 1.0);
    write_exr(&here.join("chart/raw.exr"), &chart);
    let seen = |x, y| disparity_px(camera, plane_m(y)) + aberration(x);
    write_exr(&here.join("scene/raw.exr"), &mosaic(SIDE, seen, 1.0));
    json(
        &[
            "correct-aberrations",
            "--calibration",
            "chart",
            "-o",
            "camera.json",
        ],
        here,
    );
    let kappa = KAPPA.to_string();
    let depth = |more: &[&str]| {
        let common = ["depth", "scene", "-o", "out", "--sparse", "--kappa", &kappa];
        json(&[&common[..], more].concat(), here);
        let map = maps::read(&here.join("out/depth.exr")).unwrap();
        worst_px(camera, &map[0].image).0
    };
    let without = depth(&[]);
    assert!(without > 0.4, "{without}");
    // 0.02 px of the matching, as without aberration, and twice the 0.03 px that a calibration may leave in a view.
    let with = depth(&["--calibration", "camera.json"]);
    assert!(with < 0.08, "{with}");

    write_exr(
        &here.join("other/raw.exr"),
        &mosaic(SIDE - 10, |_, _| 0.0, 1.0),
    );
    std::fs::remove_dir_all(here.join("out")).unwrap();
    let other = ["depth", "other", "-o", "out", "--sparse", "--kappa", &kappa];
    let other = [&other[..], &["--calibration", "camera.json"]].concat();
    refused(&qpalgo(&other, here), "another camera: size");
    assert!(!here.join("out").exists());
}
