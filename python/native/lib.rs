//! quadpixel in Python: `quadpixel._native`, which the package's own Python code wraps.
//!
//! Descriptions (configurations, recipes, cameras, calibrations) come and go as JSON, in the words of the files of
//! `qpgen` and `qpalgo`; pictures as NumPy arrays that the Python code has checked. Errors are those of the command
//! line: what the caller can mend is a `ValueError`, what the machine did an `OSError`.

mod algorithms;
mod arrays;
mod call;
mod files;
mod json;
mod lens;
mod picture;
mod programs;
mod response;
mod sample;

use pyo3::prelude::*;
use quadpixel_cli::memory::Guarded;

/// As in the programs.
#[global_allocator]
static MEMORY: Guarded = Guarded;

/// The part of the package that is Rust.
#[pymodule]
#[pyo3(name = "_native")]
mod native {
    #[pymodule_export]
    use super::algorithms::{
        calibrate, correct, dense, depth, disparity, refocus, sharpness, views,
    };
    #[pymodule_export]
    use super::call::{set_threads, threads};
    #[pymodule_export]
    use super::files::{read_exr, read_jpeg, read_png};
    #[pymodule_export]
    use super::lens::{lens_info, lens_layout, lens_names, lens_spots};
    #[pymodule_export]
    use super::picture::{convert, kernels, picture};
    #[pymodule_export]
    use super::programs::{qpalgo, qpgen};
    #[pymodule_export]
    use super::response::{Responses, pixel_info, pixel_names};
    #[pymodule_export]
    use super::sample::{Rendered, configuration, default_configuration, draw, listed};
}
