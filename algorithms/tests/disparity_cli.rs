//! `qpalgo disparity` as a process: files, exit codes, no partial output.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

#[path = "matching/texture.rs"]
mod texture;

use std::path::Path;
use std::process::{Command, Output};

use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, read_layers, write_layers};
use texture::{Texture, picture};

fn write(path: &Path, image: &Image) {
    let layer = Layer {
        name: "",
        channels: &["Y"],
        image,
        sample: Sample::Float,
    };
    write_layers(path, &[layer], Compression::Zip).unwrap();
}

fn disparity(folder: &Path, more: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_qpalgo"))
        .args(["disparity", "a.exr", "b.exr", "-o", "out", "--window", "15"])
        .args(more)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn shifted(shift: [f64; 2]) -> Image {
    let values = Texture::white(81, 71, 2).render(0.85, shift, None);
    picture(81, &values, 1.0, 0.0, 0.01, shift[0].to_bits())
}

#[test]
fn a_known_shift_comes_out_in_every_format() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("a.exr"), &shifted([0.0, 0.0]));
    write(&folder.path().join("b.exr"), &shifted([1.25, -0.5]));
    for format in ["exr", "npy", "pfm"] {
        let done = disparity(folder.path(), &["--json", "--format", format]);
        assert!(done.status.success(), "{done:?}");
        let summary: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
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
    // 128 bytes of header, then 4 numbers a node.
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
    write(&folder.path().join("a.exr"), &a);
    let mut bad = a.clone();
    bad.pixel_mut(7, 9)[0] = f32::NAN;
    for (b, more, wanted) in [
        (&bad, vec![], "x 7, y 9"),
        (&Image::zeros(80, 71, 1), vec![], "one size"),
        (&a, vec!["--window", "14"], ""),
        (&a, vec!["--stride", "0"], "stride"),
        (&a, vec!["--search", "0"], "search"),
    ] {
        write(&folder.path().join("b.exr"), b);
        let done = disparity(folder.path(), &more);
        let text = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{text}");
        assert!(text.contains(wanted), "{text}");
        assert!(!folder.path().join("out").exists());
    }
}
