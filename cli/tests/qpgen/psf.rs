//! `qpgen psf`: the numbers, the pictures, and what is refused.

use std::io::Cursor;

use ndarray::{ArrayD, Ix1};
use ndarray_npy::NpzReader;
use quadpixel::image::raster;

use std::path::Path;
use std::process::{Command, Output};

use crate::common::refused;

fn qpgen(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    command
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

const RECIPE: &str = r#"
[lens]
name = "wide_US20120327520A1_emb3"
focus_mm = 500
[sensor]
pitch_um = 2.8
subpixels = "2x1"
width = 60
height = 40
[response]
model = "geometric"
[[planes]]
chart = "constant"
distance_mm = 500
[render]
rays_per_pixel = 1
seed = 1
"#;

fn array(bytes: &[u8], name: &str) -> ArrayD<f64> {
    let mut npz = NpzReader::new(Cursor::new(bytes)).unwrap();
    let name = format!("{name}.npy");
    match npz.by_name::<ndarray::OwnedRepr<f64>, ndarray::IxDyn>(&name) {
        Ok(array) => array,
        Err(_) => {
            let single: ArrayD<f32> = npz.by_name(&name).unwrap();
            single.mapv(f64::from)
        }
    }
}

#[test]
fn a_bank_holds_kernels_with_their_energy_and_centroid() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.toml"), RECIPE).unwrap();
    let run = |out: &str, more: &[&str]| {
        let args = [
            "psf",
            "r.toml",
            "--depths-m",
            "0.25,0.5,inf",
            "--fields",
            "3x2",
            "--rays",
            "512",
            "-o",
            out,
        ];
        qpgen(folder.path(), &[&args[..], more].concat())
    };
    let output = run("a.npz", &["--threads", "1"]);
    assert!(output.status.success(), "{output:?}");
    let bytes = std::fs::read(folder.path().join("a.npz")).unwrap();
    let kernel = array(&bytes, "kernel");
    let shape = kernel.shape().to_vec();
    assert_eq!(shape[..5], [3, 2, 3, 3, 2]);
    let (beyond, centroid) = (array(&bytes, "beyond"), array(&bytes, "centroid_px"));
    assert_eq!(
        array(&bytes, "depth_m").as_slice().unwrap()[..2],
        [0.25, 0.5]
    );
    let mut npz = NpzReader::new(Cursor::new(&bytes)).unwrap();
    let origin: ndarray::Array<i64, Ix1> = npz.by_name("origin.npy").unwrap();
    let pixels = shape[5] * shape[6];
    let planes = kernel.as_slice().unwrap().chunks_exact(pixels);
    for ((plane, beyond), centroid) in planes
        .zip(&beyond)
        .zip(centroid.as_slice().unwrap().chunks_exact(2))
    {
        let sum: f64 = plane.iter().sum();
        assert!((sum - (1.0 - beyond)).abs() < 1e-5, "{sum} {beyond}");
        let column = |i: usize| (i % shape[6]) as f64 - origin[1] as f64;
        let x: f64 = plane.iter().enumerate().map(|(i, v)| v * column(i)).sum();
        assert!(
            (x / sum - centroid[0]).abs() < 1e-4,
            "{} {}",
            x / sum,
            centroid[0]
        );
    }
    // Nearer than the focus the left view's centroid lies to the right of the right one's.
    assert!(centroid[[0, 0, 1, 1, 0, 0]] > centroid[[0, 0, 1, 1, 1, 0]] + 1.0);
    assert!(array(&bytes, "energy_sr").iter().all(|sr| *sr > 0.0));
    assert!(raster::read(&folder.path().join("a.exr")).is_ok());
    assert!(raster::read(&folder.path().join("a.png")).is_ok());
    // The same bytes at another number of threads.
    assert!(run("b.npz", &["--threads", "3"]).status.success());
    assert_eq!(bytes, std::fs::read(folder.path().join("b.npz")).unwrap());
    refused(&run("a.npz", &[]), "is there already");
    refused(&run("a.txt", &[]), "ends in .npz");
    let none = qpgen(folder.path(), &["psf", "r.toml", "--fields", "0x2"]);
    refused(&none, "fields is 0x2");
}

#[test]
fn a_depth_that_is_none_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    refused(
        &qpgen(folder.path(), &["psf", "--depths-m", "0,1"]),
        "depths_m is 0; allowed",
    );
    refused(
        &qpgen(folder.path(), &["psf", "--depths-m", "NaN"]),
        "NaN is not a number",
    );
    refused(
        &qpgen(folder.path(), &["psf", "--fields", "5"]),
        "--fields is 5",
    );
}

#[test]
fn kernels_and_rays_beyond_what_memory_may_be_taken_are_refused_before_they_are_made() {
    let folder = tempfile::tempdir().unwrap();
    let within = |more: &[&str]| {
        let arguments = [&["psf", "--max-memory", "300M"][..], more].concat();
        qpgen(folder.path(), &arguments)
    };
    let near = within(&["--depths-m", "0.001", "--rays", "64"]);
    refused(&near, "kernels of all depths takes");
    let rays = within(&["--fields", "64x64", "--rays", "4000000"]);
    refused(&rays, "rays of kernels takes");
}
