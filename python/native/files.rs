//! EXR, PNG and JPEG files as arrays.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, ImageReader};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadpixel::image::channel;
use quadpixel::image::exr::decode_layers;
use quadpixel::image::raster::decoded;

use crate::arrays::{of_plane, shaped};
use crate::json::refused;

/// Channels of an EXR file's bytes by their full names: (H, W) float32 each.
#[pyfunction]
pub fn read_exr<'py>(py: Python<'py>, content: &[u8], name: &str) -> PyResult<Bound<'py, PyDict>> {
    let layers = py
        .detach(|| decode_layers(Path::new(name), content))
        .map_err(refused)?;
    let channels = PyDict::new(py);
    for layer in layers {
        for (index, colour) in layer.channels.iter().enumerate() {
            let full = match layer.name.as_str() {
                "" => colour.clone(),
                layer => format!("{layer}.{colour}"),
            };
            channels.set_item(full, of_plane(py, &channel(&layer.image, index))?)?;
        }
    }
    Ok(channels)
}

/// Codes of a PNG file's bytes: (H, W) or (H, W, 3), uint8 or uint16 as stored.
#[pyfunction]
pub fn read_png<'py>(py: Python<'py>, content: &[u8], name: &str) -> PyResult<Bound<'py, PyAny>> {
    read_codes(py, content, (name, "PNG"), ImageFormat::Png)
}

/// Codes of a JPEG file's bytes: (H, W, 3) or (H, W), uint8.
#[pyfunction]
pub fn read_jpeg<'py>(py: Python<'py>, content: &[u8], name: &str) -> PyResult<Bound<'py, PyAny>> {
    read_codes(py, content, (name, "JPEG"), ImageFormat::Jpeg)
}

fn read_codes<'py>(
    py: Python<'py>,
    content: &[u8],
    (name, kind): (&str, &str),
    format: ImageFormat,
) -> PyResult<Bound<'py, PyAny>> {
    let read = || decoded(ImageReader::with_format(Cursor::new(content), format), 0);
    let picture = py
        .detach(read)
        .map_err(|e| refused(format!("{name}: not a readable {kind}: {e}")))?
        .0;
    let (height, width) = (picture.height() as usize, picture.width() as usize);
    Ok(match picture {
        DynamicImage::ImageLuma8(codes) => {
            shaped(py, codes.into_raw(), &[height, width])?.into_any()
        }
        DynamicImage::ImageLuma16(codes) => {
            shaped(py, codes.into_raw(), &[height, width])?.into_any()
        }
        DynamicImage::ImageRgb16(_) | DynamicImage::ImageRgba16(_) => {
            shaped(py, picture.into_rgb16().into_raw(), &[height, width, 3])?.into_any()
        }
        _ => shaped(py, picture.into_rgb8().into_raw(), &[height, width, 3])?.into_any(),
    })
}
