//! Arguments of `qpgen response`, and the table that they mean.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use quadpixel::em::PixelStack;
use quadpixel::response::{ShiftSettings, TableSettings};
use quadpixel::sensor::Subpixels;

use crate::number::number;
use crate::qpgen::pixel_model::PixelModelArgs;
use crate::shard_env::ShardArgs;

/// Arguments of `qpgen response`.
#[derive(Args)]
pub struct ResponseArgs {
    /// Pixel: a built-in name, such as 1.6um, or a TOML file (see --print-pixel).
    #[arg(long, default_value = "2.8um")]
    pub pixel: String,
    /// Sub-pixels, columns x rows, such as 2x1; absent: as the pixel says.
    #[arg(long)]
    pub subpixels: Option<Subpixels>,
    /// Which microlens of a pixel with a mosaic of colour filters (such as 1.6um-bayer; wave, rcwa, fdtd): that of a
    /// colour; all: one table per colour, from one simulation; absent: as the pixel says.
    #[arg(long, value_enum)]
    pub colour: Option<ColourArg>,
    /// With --colour bands: number of wavelengths per channel.
    #[arg(long, default_value_t = 4, value_name = "N")]
    pub band_wavelengths: usize,
    #[command(flatten)]
    pub model: PixelModelArgs,
    /// Wavelengths, nm, separated by commas, such as 450,550,650.
    #[arg(
        value_parser = number,
        long,
        alias = "wavelength",
        value_delimiter = ',',
        default_value = "550"
    )]
    pub wavelength_nm: Vec<f64>,
    /// Number of steps between simulated directions, from the normal to the table's end, along u and along v; absent:
    /// as the preset says.
    #[arg(long, conflicts_with = "theta_deg")]
    pub grid: Option<usize>,
    /// The table's end: largest direction cosines |u| and |v|, such as 0.8; absent: as the preset says.
    #[arg(value_parser = number, long, conflicts_with = "theta_deg")]
    pub cosine_max: Option<f64>,
    /// Makes a table of all microlens shifts (5D), for sensors whose microlenses follow the chief ray: N shifts per
    /// pitch along x and along y, even, 4 to 32. Exact from 4 n pitch / λ on, n of the layer above the silicon: 18 at
    /// 1.6 µm, 30 at 2.8 µm and 550 nm.
    #[arg(long, value_name = "N", conflicts_with = "theta_deg")]
    pub shifts: Option<usize>,
    /// With --shifts: F-number of the cone of light that the sub-pixels share equally.
    #[arg(value_parser = number, long, default_value_t = 2.0, requires = "shifts")]
    pub cone_f_number: f64,
    /// Prints P at these angles of incidence (deg, separated by commas) and makes no table.
    #[arg(value_parser = number, long, value_delimiter = ',', allow_negative_numbers = true)]
    pub theta_deg: Vec<f64>,
    /// With --theta-deg: azimuths, deg, separated by commas.
    #[arg(
        value_parser = number,
        long,
        value_delimiter = ',',
        default_value = "0",
        allow_negative_numbers = true
    )]
    pub phi_deg: Vec<f64>,
    /// Makes the table of a CSV file of another tool, with the columns theta_deg, phi_deg, subpixel, P (and
    /// wavelength_nm, if there are several).
    #[arg(
        long,
        value_name = "CSV",
        conflicts_with_all = [
            "theta_deg", "shifts", "grid", "cosine_max", "band_wavelengths", "model", "preset", "exact", "exact_preset",
            "exact_runs", "focal_length_um", "shard"
        ]
    )]
    pub import: Option<PathBuf>,
    /// With --import: the file holds a part of the directions; the pixel's symmetry gives the others.
    #[arg(long, requires = "import")]
    pub symmetric: bool,
    #[command(flatten)]
    pub shard: ShardArgs,
    /// Table to write, an .npz that NumPy reads; absent: NAME-MODEL.npz.
    #[arg(long, short, conflicts_with = "theta_deg")]
    pub output: Option<PathBuf>,
    /// Prints the pixel as a TOML file with comments, to start from, and stops.
    #[arg(long)]
    pub print_pixel: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Whose response.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ColourArg {
    Red,
    /// The mean of both greens.
    Green,
    Blue,
    All,
    /// One table for a dataset whose channels are bands (`[spectrum]`): each wavelength of a band under the filter of
    /// its colour.
    Bands,
}

impl ResponseArgs {
    /// The settings of a preset as the arguments change them.
    fn changed(&self, preset: TableSettings) -> TableSettings {
        TableSettings {
            wavelengths_nm: self.wavelength_nm.clone(),
            steps: self.grid.unwrap_or(preset.steps),
            cosine_max: self.cosine_max.unwrap_or(preset.cosine_max),
            ..preset
        }
    }

    /// What is tabulated: of the pixel's own lens shift, or of all.
    pub fn settings(&self, stack: &PixelStack) -> TableSettings {
        let Some(per_pitch) = self.shifts else {
            return self.changed(self.model.table(stack));
        };
        let shifts = ShiftSettings {
            per_pitch,
            cone_f_number: self.cone_f_number,
        };
        TableSettings {
            shifts: Some(shifts),
            ..self.changed(self.model.shifted(stack, per_pitch))
        }
    }
}
