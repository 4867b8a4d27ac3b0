//! Pictures between NumPy and the libraries. The Python code has checked dtype, order and finiteness.

use numpy::ndarray::{Array1, ArrayD, IxDyn};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use quadpixel::image::Image;
use quadpixel::sensor::Subpixels;
use quadpixel_algorithms::sai::Views;

use crate::json::refused;

/// An array of Python's.
pub type Array<'py, T> = Bound<'py, PyArrayDyn<T>>;

/// An array of f32 from Python.
pub type Given<'py> = PyReadonlyArrayDyn<'py, f32>;

/// (H, W) or (H, W, C) as an image; `name` is what the caller calls it.
pub fn image(array: &Given<'_>, name: &str) -> PyResult<Image> {
    let view = array.as_array();
    let (height, width, channels) = match *view.shape() {
        [height, width] => (height, width, 1),
        [height, width, channels] => (height, width, channels),
        ref other => {
            return Err(refused(format!(
                "{name}: shape is {other:?}; allowed: (H, W) or (H, W, C)"
            )));
        }
    };
    let data = view.iter().copied().collect();
    Image::from_vec(width, height, channels, data)
        .ok_or_else(|| refused(format!("{name}: no picture")))
}

/// (m·n, H, W, C) or (m·n, H, W) as views.
pub fn views(array: &Given<'_>, subpixels: &str) -> PyResult<Views> {
    let subpixels: Subpixels = subpixels.parse().map_err(refused)?;
    let view = array.as_array();
    let (height, width, channels) = match *view.shape() {
        [_, height, width] => (height, width, 1),
        [_, height, width, channels] => (height, width, channels),
        ref other => {
            let text = format!("views: shape is {other:?}; allowed: (m*n, H, W, C) or (m*n, H, W)");
            return Err(refused(text));
        }
    };
    let images = view
        .outer_iter()
        .filter_map(|one| Image::from_vec(width, height, channels, one.iter().copied().collect()));
    Views::new(subpixels, images.collect()).map_err(refused)
}

/// An array of a shape; fails only where data and shape do not fit, which is a fault of the program.
pub fn shaped<'py, T: Element>(
    py: Python<'py>,
    data: Vec<T>,
    shape: &[usize],
) -> PyResult<Array<'py, T>> {
    let flat = Array1::from_vec(data);
    let array: ArrayD<T> = flat.into_shape_with_order(IxDyn(shape)).map_err(refused)?;
    Ok(array.into_pyarray(py))
}

/// (H, W, C) of an image.
pub fn of_image<'py>(py: Python<'py>, image: &Image) -> PyResult<Array<'py, f32>> {
    shaped(
        py,
        image.data().to_vec(),
        &[image.height(), image.width(), image.channels()],
    )
}

/// (H, W) of an image of one channel.
pub fn of_plane<'py>(py: Python<'py>, image: &Image) -> PyResult<Array<'py, f32>> {
    shaped(py, image.data().to_vec(), &[image.height(), image.width()])
}

/// (N, H, W, C) of N images of one size, of which `channels` are taken.
pub fn of_images<'py>(
    py: Python<'py>,
    images: &[Image],
    channels: std::ops::Range<usize>,
) -> PyResult<Array<'py, f32>> {
    let (height, width) = images
        .first()
        .map_or((0, 0), |first| (first.height(), first.width()));
    let mut data = Vec::with_capacity(images.len() * height * width * channels.len());
    for image in images {
        // The usual ones, which are copied at once.
        match (image.channels(), channels.clone()) {
            (count, all) if all == (0..count) => data.extend_from_slice(image.data()),
            (4, std::ops::Range { start, end: _ }) if channels.len() == 2 => {
                let (begin, pixels) = (data.len(), image.data().as_chunks::<4>().0);
                data.resize(begin + 2 * pixels.len(), 0.0);
                let (pairs, _) = data[begin..].as_chunks_mut::<2>();
                for (pair, pixel) in pairs.iter_mut().zip(pixels) {
                    *pair = [pixel[start], pixel[start + 1]];
                }
            }
            (count, some) => (image.data().chunks_exact(count))
                .for_each(|pixel| data.extend_from_slice(&pixel[some.clone()])),
        }
    }
    shaped(py, data, &[images.len(), height, width, channels.len()])
}
