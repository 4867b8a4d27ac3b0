//! `qpalgo disparity` as a process: files, exit codes, no partial output.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

#[path = "../../../algorithms/tests/matching/texture.rs"]
mod texture;

use crate::common;

use std::path::Path;
use std::process::Output;

use common::{json, mosaic, qpalgo, refused, write_exr, write_views};
use quadpixel::image::exr::read_layers;
use quadpixel::image::{Image, raster};
use quadpixel_algorithms::maps;
use texture::{Texture, picture};

const PAIR: [&str; 5] = ["disparity", "view.exr", "reference.exr", "-o", "out"];

fn disparity(folder: &Path, more: &[&str]) -> Output {
    qpalgo(&[&PAIR[..], more].concat(), folder)
}

fn shifted(shift: [f64; 2]) -> Image {
    let values = Texture::white(81, 71, 2).render(0.85, shift, None);
    picture(81, &values, 1.0, 0.0, 0.01, shift[0].to_bits())
}

#[test]
fn disparity_points_right_and_up_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(&folder.path().join("reference.exr"), &shifted([0.0, 0.0]));
    write_exr(&folder.path().join("view.exr"), &shifted([1.25, -0.5]));
    for format in ["exr", "npy", "pfm"] {
        let summary = json(
            &[&PAIR[..], &["--window", "15", "--format", format]].concat(),
            folder.path(),
        );
        let channel = &summary["channels"][0];
        assert!((channel["median_dx_px"].as_f64().unwrap() - 1.25).abs() < 0.01);
        assert!((channel["median_dy_px"].as_f64().unwrap() + 0.5).abs() < 0.01);
        for file in summary["files"].as_array().unwrap() {
            assert!(
                folder
                    .path()
                    .join("out")
                    .join(file.as_str().unwrap())
                    .is_file()
            );
        }
        let (columns, rows) = (15, 13);
        assert_eq!(summary["grid"]["columns"], columns);
        assert_eq!(summary["grid"]["rows"], rows);
    }
    let out = folder.path().join("out");
    let layer = &read_layers(&out.join("disparity.exr")).unwrap()[0];
    assert_eq!(layer.image.channels(), 4);
    assert_eq!((layer.image.width(), layer.image.height()), (15, 13));
    // 128 bytes of header, then 4 numbers per node.
    let npy = std::fs::read(out.join("disparity.npy")).unwrap();
    assert_eq!(
        (npy.len(), &npy[..6]),
        (128 + 15 * 13 * 16, &b"\x93NUMPY"[..])
    );
    // The first number of a PFM is that of the lowest row.
    let pfm = std::fs::read(out.join("disparity_Y.pfm")).unwrap();
    let header = b"PF\n15 13\n-1.0\n";
    assert_eq!(
        (pfm.len(), &pfm[..header.len()]),
        (header.len() + 15 * 13 * 12, &header[..])
    );
    let at = 128 + 12 * 15 * 16;
    assert_eq!(pfm[header.len()..header.len() + 12], npy[at..at + 12]);
}

#[test]
fn bad_input_ends_with_exit_code_2_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let a = shifted([0.0, 0.0]);
    write_exr(&folder.path().join("reference.exr"), &a);
    let mut bad = a.clone();
    bad.pixel_mut(7, 9)[0] = f32::NAN;
    for (view, more, wanted) in [
        (&bad, vec![], "x 7, y 9"),
        (&Image::zeros(80, 71, 1), vec![], "one size"),
        (&a, vec!["--window", "14"], "window"),
        (&a, vec!["--stride", "0"], "stride"),
        (&a, vec!["--search", "0"], "search"),
        (&a, vec!["--subpixels", "2x2"], "--subpixels"),
    ] {
        write_exr(&folder.path().join("view.exr"), view);
        refused(&disparity(folder.path(), &more), wanted);
        assert!(!folder.path().join("out").exists());
    }
}

#[test]
fn the_left_view_of_a_near_plane_lies_right_of_the_right_one_and_is_red() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    write_exr(&here.join("raw.exr"), &mosaic(64, |_, _| 1.5, 1.0));
    json(&["sai", "raw.exr", "--subpixels", "2x2", "-o", "v"], here);
    for (view, reference, wanted) in [("L", "R", 1.5), ("R", "L", -1.5)] {
        let [a, b] = [view, reference].map(|side| format!("v/sum_{side}.exr"));
        let asked = [
            "disparity",
            &a,
            &b,
            "-o",
            "out",
            "--one-dimensional",
            "horizontal",
        ];
        let found = json(&asked, here)["channels"][1].clone();
        // 0.02 px: what the pipeline leaves on noiseless texture is 0.002; the sums are equally blurred by the other
        // axis.
        let dx = found["median_dx_px"].as_f64().unwrap();
        assert!((dx - wanted).abs() < 0.02, "{view} − {reference}: {dx}");
        // On the signed scale positive is red and negative blue.
        let picture = raster::read(&here.join("out/disparity_G.png")).unwrap();
        let middle = picture.pixel(picture.width() / 2, picture.height() / 2);
        assert_eq!(middle[0] > middle[2], wanted > 0.0, "{middle:?}");
        // A square of the stride's side a node.
        assert_eq!(
            picture.width(),
            4 * found["nodes"].as_u64().unwrap().isqrt() as usize
        );
    }
}

#[test]
fn each_view_of_a_mosaic_or_an_exr_of_views_is_matched_against_the_sum() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let raw = mosaic(64, |_, _| 1.2, 1.0);
    write_exr(&here.join("raw.exr"), &raw);
    write_views(
        &here.join("views.exr"),
        &["B", "A", "D", "C"],
        &common::views(&raw),
    );
    let mosaic = json(
        &[
            "disparity",
            "raw.exr",
            "--subpixels",
            "2x2",
            "-o",
            "of_mosaic",
        ],
        here,
    );
    let views = json(&["disparity", "views.exr", "-o", "of_views"], here);
    assert_eq!(mosaic["channels"], views["channels"]);
    let layers = maps::read(&here.join("of_views/disparity.exr")).unwrap();
    assert_eq!(layers.len(), 12);
    for (view, [sx, sy]) in ["B", "A", "D", "C"].iter().zip(common::SIGNS) {
        let found = (views["channels"].as_array().unwrap().iter())
            .find(|c| c["channel"] == format!("{view}.G"))
            .unwrap();
        for (axis, sign) in [("median_dx_px", sx), ("median_dy_px", sy)] {
            let shift = found[axis].as_f64().unwrap();
            assert!((shift - 0.6 * sign).abs() < 0.02, "{view} {axis}: {shift}");
        }
        assert!(
            here.join(format!("of_views/disparity_{view}_G.png"))
                .is_file()
        );
    }
}
