//! Images to OpenCV's matrices and back, and its Lanczos warp on them.

use opencv::Result;
use opencv::core::{
    BORDER_CONSTANT, BORDER_REFLECT, BORDER_REFLECT_101, BORDER_REPLICATE, BORDER_WRAP, Mat, Scalar,
};
use opencv::imgproc::{self, INTER_LANCZOS4};
use opencv::prelude::*;

use quadpixel::image::Image;
use quadpixel_algorithms::warp::{Border, Map};

/// A copy as f32 with the image's channels.
pub fn to_mat(image: &Image) -> Result<Mat> {
    Mat::from_slice(image.data())?
        .reshape(image.channels() as i32, image.height() as i32)?
        .try_clone()
}

/// A copy of row-major values as f64, one channel.
pub fn to_mat_f64(height: usize, values: &[f64]) -> Result<Mat> {
    Mat::from_slice(values)?
        .reshape(1, height as i32)?
        .try_clone()
}

/// All samples of an f32 matrix, row-major, interleaved.
pub fn samples(mat: &Mat) -> Result<Vec<f32>> {
    Ok(mat.reshape(1, 0)?.data_typed::<f32>()?.to_vec())
}

/// One channel as 8 bits, `black..white` onto 0..255, rounded and clipped.
pub fn to_mat_u8(image: &Image, [black, white]: [f32; 2]) -> Result<Mat> {
    let bytes: Vec<u8> = image
        .data()
        .iter()
        .map(|v| (255.0 * (v - black) / (white - black)).round() as u8)
        .collect();
    Mat::from_slice(&bytes)?
        .reshape(1, image.height() as i32)?
        .try_clone()
}

/// Columns and rows of a map as OpenCV takes them, in f32.
pub fn to_map_mats(map: &Map) -> Result<[Mat; 2]> {
    let (mut x, mut y) = (Vec::new(), Vec::new());
    for row in 0..map.height() {
        let (row_x, row_y) = map.row(row);
        x.extend(row_x.iter().map(|v| *v as f32));
        y.extend(row_y.iter().map(|v| *v as f32));
    }
    let rows = map.height() as i32;
    Ok([
        Mat::from_slice(&x)?.reshape(1, rows)?.try_clone()?,
        Mat::from_slice(&y)?.reshape(1, rows)?.try_clone()?,
    ])
}

/// OpenCV's `remap` with INTER_LANCZOS4 into `to`.
pub fn remap(image: &Mat, [x, y]: &[Mat; 2], border: Border, to: &mut Mat) -> Result<()> {
    let (mode, value) = match border {
        Border::Replicate => (BORDER_REPLICATE, 0.0),
        Border::Reflect => (BORDER_REFLECT, 0.0),
        Border::Reflect101 => (BORDER_REFLECT_101, 0.0),
        Border::Wrap => (BORDER_WRAP, 0.0),
        Border::Constant(value) => (BORDER_CONSTANT, value),
    };
    let value = Scalar::all(value.into());
    imgproc::remap(image, to, x, y, INTER_LANCZOS4, mode, value)
}
