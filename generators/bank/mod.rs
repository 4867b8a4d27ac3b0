//! A bank of kernels as files: numbers (`.npz`), pictures of them as linear floats (EXR), and a contact sheet (PNG).

mod arrays;
mod request;
mod sheet;
mod tiles;

use std::path::{Path, PathBuf};

use quadpixel::file::{self, FileError};
use quadpixel::image::{ImageError, raster};
use quadpixel::memory::{self, MemoryError};
use quadpixel::render::Camera;
use quadpixel::render::kernels::{BankPlan, KernelBank, KernelError};
use quadpixel::render::truth::{DisparityField, SightRays};

use crate::field_error::FieldError;

pub use arrays::BankArrays;
pub use request::BankRequest;

/// Bytes per value of a kernel while a bank is written.
const BYTES_PER_VALUE: u64 = 20;
/// Most rays per field node and channel.
const MOST_RAYS: usize = 1 << 22;

/// Why a bank cannot be made or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BankError {
    /// A number out of its range.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// It would take more memory than is allowed.
    #[error("{0}; fewer fields, depths or sub-pixels take less")]
    Memory(#[from] MemoryError),
    /// Part of the window gets no light.
    #[error(
        "sensor window: a field of it is dark; allowed: a window inside the image circle of the lens"
    )]
    Dark,
    /// The disk.
    #[error(transparent)]
    File(#[from] FileError),
    /// A picture that cannot be stored.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Arrays that cannot be stored.
    #[error("{}: {why}", path.display())]
    Arrays {
        /// The file.
        path: PathBuf,
        /// Why.
        why: String,
    },
}

impl From<KernelError> for BankError {
    fn from(error: KernelError) -> Self {
        match error {
            KernelError::Memory(error) => Self::Memory(error),
            KernelError::Dark => Self::Dark,
        }
    }
}

impl BankError {
    /// Whether the caller can mend it.
    pub fn is_input(&self) -> bool {
        matches!(self, Self::Field(_) | Self::Memory(_) | Self::Dark)
    }
}

/// A bank, and what was asked for.
pub struct Bank<'a> {
    /// The kernels.
    pub kernels: &'a KernelBank,
    /// Depths from the first lens vertex, m (+∞ allowed).
    pub depths_m: &'a [f64],
    /// What else a reader needs to know: JSON.
    pub about: serde_json::Value,
}

/// Traces the bank of a camera; the picture's places are where the sum of the sub-pixels shows them.
///
/// # Errors
/// Fields, depths or rays that are none; more memory than is allowed; a window with a dark corner.
pub fn trace(camera: &Camera, plan: &BankPlan) -> Result<KernelBank, BankError> {
    let (nx, ny) = plan.nodes;
    let field = |what: String, allowed: &str| {
        BankError::Field(FieldError::new("fields", what, allowed.to_owned()))
    };
    if !(1..=64).contains(&nx) || !(1..=64).contains(&ny) {
        return Err(field(format!("{nx}x{ny}"), "1x1 to 64x64"));
    }
    if !(16..=MOST_RAYS).contains(&plan.rays) {
        let allowed = format!("16 to {MOST_RAYS}");
        return Err(FieldError::new("rays", plan.rays, allowed).into());
    }
    let fields = DisparityField::of_channels(camera).ok_or(BankError::Dark)?;
    let sight = SightRays::centroids(&fields);
    let kernels = KernelBank::new(camera, &sight, &fields, plan)?;
    // The arrays have the support that holds all.
    let support = kernels.support();
    let pixels = support.map_or(0, |s| s.width as u64 * s.height as u64);
    let depths = plan.inverse_depths_per_mm.len() as u64;
    let values = (nx * ny * kernels.lanes()) as u64 * depths;
    memory::check(
        "arrays of kernels",
        pixels.saturating_mul(values * BYTES_PER_VALUE),
    )?;
    Ok(kernels)
}

/// Writes the numbers to `path` (`.npz`), and beside it the pictures (`.exr`) and the contact sheet (`.png`). Returns
/// the three paths.
///
/// # Errors
/// The disk.
pub fn write(path: &Path, bank: &Bank<'_>) -> Result<[PathBuf; 3], BankError> {
    let [exr, png] = ["exr", "png"].map(|ending| path.with_extension(ending));
    file::write_aside(path, &arrays::npz(path, bank)?)?;
    tiles::write(&exr, bank.kernels)?;
    let sheet = sheet::contact_sheet(bank);
    raster::write_png8(&png, &sheet.rgb, sheet.width, sheet.height, 3)?;
    Ok([path.to_owned(), exr, png])
}
