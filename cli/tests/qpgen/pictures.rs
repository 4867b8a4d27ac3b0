//! A picture with depth in files of every kind, for the tests that convert it.

use std::fs;
use std::path::Path;

use ndarray::Array2;
use ndarray_npy::WriteNpyExt;
use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};

use crate::common::small::{SMALL, with_values};

pub const WIDTH: usize = 56;
pub const HEIGHT: usize = 44;

/// Depth, m: a near square before a slanted wall.
pub fn depth_m(x: usize, y: usize) -> f32 {
    match (18..34).contains(&x) && (12..30).contains(&y) {
        true => 0.22,
        false => 0.5 + 0.004 * x as f32,
    }
}

fn code(i: usize) -> u8 {
    let (x, y, c) = (i / 3 % WIDTH, i / 3 / WIDTH, i % 3);
    (128.0 + 90.0 * (0.7 * x as f64 + 0.4 * y as f64 + c as f64).sin()) as u8
}

pub fn codes() -> Vec<u8> {
    (0..WIDTH * HEIGHT * 3).map(code).collect()
}

pub fn map(value: impl Fn(usize, usize) -> f32) -> Image {
    let data = (0..WIDTH * HEIGHT)
        .map(|i| value(i % WIDTH, i / WIDTH))
        .collect();
    Image::from_vec(WIDTH, HEIGHT, 1, data).unwrap()
}

pub fn write_depth_exr(path: &Path, image: &Image) {
    let layer = Layer {
        name: "",
        channels: &["Z"],
        image,
        sample: Sample::Float,
    };
    write_layers(path, &[layer], Compression::Zip).unwrap();
}

pub fn write_npy(path: &Path, image: &Image) {
    let array = Array2::from_shape_vec((HEIGHT, WIDTH), image.data().to_vec()).unwrap();
    array.write_npy(fs::File::create(path).unwrap()).unwrap();
}

pub fn write_pfm(path: &Path, image: &Image) {
    let mut bytes = format!("Pf\n{WIDTH} {HEIGHT}\n-1.0\n").into_bytes();
    for y in (0..HEIGHT).rev() {
        let row = (0..WIDTH).flat_map(|x| image.pixel(x, y)[0].to_le_bytes());
        bytes.extend(row);
    }
    fs::write(path, bytes).unwrap();
}

pub fn config(folder: &Path) -> String {
    let values = [
        ("lens.focus_mm", "300"),
        ("sensor.window", "{ at = \"centre\" }"),
    ];
    let path = folder.join("c.toml");
    fs::write(&path, with_values(SMALL, &values)).unwrap();
    path.to_str().unwrap().to_owned()
}
