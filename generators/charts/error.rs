//! Why a chart was refused.

use quadpixel::memory::{self, MemoryError};
use quadpixel::scene::texture::{Texture, TextureError};
use std::path::PathBuf;
use thiserror::Error;

/// Why a chart, mask or preview could not be made.
#[derive(Debug, Error)]
pub enum ChartError {
    /// No such chart.
    #[error("unknown chart `{kind}`; known: {known}")]
    UnknownChart {
        /// The name asked for.
        kind: String,
        /// The names there are.
        known: String,
    },
    /// No such mask.
    #[error("unknown mask `{kind}`; known: {known}")]
    UnknownMask {
        /// The name asked for.
        kind: String,
        /// The names there are.
        known: String,
    },
    /// An `image` chart cannot be drawn at random.
    #[error("chart `image` needs the path of an image file; it has no random form")]
    NeedsFile,
    /// A parameter out of its range.
    #[error("chart `{chart}`: {field} = {value} is not {allowed}")]
    Parameter {
        /// Name of the chart or mask.
        chart: &'static str,
        /// Name of the parameter.
        field: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: String,
    },
    /// A raster side out of range.
    #[error("chart: size {size_px} px is not within 1..={max}", max = Texture::MAX_SIDE_PX)]
    Size {
        /// The side asked for.
        size_px: usize,
    },
    /// A file that cannot be read or written.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// More memory than is allowed.
    #[error("chart: {0}")]
    Memory(#[from] MemoryError),
    /// A raster that the core refuses.
    #[error(transparent)]
    Texture(#[from] TextureError),
}

/// Fails unless `low ≤ value ≤ high` (so NaN fails).
pub(super) fn within(
    chart: &'static str,
    field: &'static str,
    value: f64,
    low: f64,
    high: f64,
) -> Result<(), ChartError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ChartError::Parameter {
        chart,
        field,
        value,
        allowed: format!("within {low}..={high}"),
    })
}

/// Fails unless dark and light are reflectances and dark < light.
pub(super) fn tones(chart: &'static str, dark: f64, light: f64) -> Result<(), ChartError> {
    within(chart, "light", light, 0.0, 1.0)?;
    within(chart, "dark", dark, 0.0, 1.0)?;
    if dark < light {
        return Ok(());
    }
    Err(ChartError::Parameter {
        chart,
        field: "dark",
        value: dark,
        allowed: format!("less than light = {light}"),
    })
}

/// What a texel of a chart takes while it is painted and made coarser: floats of three colours, twice and a third.
const BYTES_PER_TEXEL: u64 = 28;

/// Fails unless `size_px` is a raster side, and there is memory for it.
pub(super) fn side(size_px: usize) -> Result<(), ChartError> {
    if !(1..=Texture::MAX_SIDE_PX).contains(&size_px) {
        return Err(ChartError::Size { size_px });
    }
    let what = format!("a chart of {size_px} × {size_px} texels");
    Ok(memory::check(
        what,
        (size_px as u64).pow(2) * BYTES_PER_TEXEL,
    )?)
}
