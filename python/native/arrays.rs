//! Pictures between NumPy and the libraries. The Python code has checked dtype, order and finiteness.

use std::ops::Range;

use numpy::ndarray::{Array1, ArrayD, IxDyn};
use numpy::{Element, IntoPyArray, PyArrayDyn, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use quadpixel::image::Image;
use quadpixel::sensor::Subpixels;
use quadpixel_algorithms::sai::Views;
use rayon::prelude::*;

use crate::call::on_threads;
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
    channels: Range<usize>,
) -> PyResult<Array<'py, f32>> {
    let (height, width) = images
        .first()
        .map_or((0, 0), |first| (first.height(), first.width()));
    let each = height * width * channels.len();
    let mut data = vec![0.0; images.len() * each];
    on_threads(py, || {
        let parts = data.par_chunks_mut(each.max(1)).zip(images);
        parts.for_each(|(to, image)| copy(image, channels.clone(), to));
    })?;
    shaped(py, data, &[images.len(), height, width, channels.len()])
}

/// Copies some channels of an image.
fn copy(image: &Image, channels: Range<usize>, to: &mut [f32]) {
    let (from, first, count) = (image.data(), channels.start, channels.len());
    // The usual ones go by lanes.
    if count == image.channels() {
        to.copy_from_slice(from);
    } else if (count, image.channels()) == (2, 4) {
        let pixels = from.as_chunks::<4>().0.iter();
        let pairs = to.as_chunks_mut::<2>().0.iter_mut();
        pairs
            .zip(pixels)
            .for_each(|(pair, pixel)| *pair = [pixel[first], pixel[first + 1]]);
    } else if count > 0 {
        let pixels = from.chunks_exact(image.channels());
        (to.chunks_exact_mut(count).zip(pixels))
            .for_each(|(to, pixel)| to.copy_from_slice(&pixel[channels.clone()]));
    }
}
