//! Why an experiment could not be made.

use quadpixel::em::light::SolverError;
use quadpixel::em::{Level, StackError};
use quadpixel::file::FileError;
use quadpixel::image::ImageError;
use quadpixel::journal::JournalError;
use quadpixel::lens::LensError;
use quadpixel::range::OutOfRange;
use quadpixel::render::CameraError;
use quadpixel::response::ResponseError;
use quadpixel::scene::coverage::CoverageError;
use quadpixel::scene::texture::TextureError;
use quadpixel::sensor::Subpixels;
use quadpixel_generators::charts::ChartError;
use quadpixel_generators::recipe::RecipeError;
use quadpixel_generators::scenes::field_of_view::ViewError;

/// Why an experiment could not be made. [`Self::is_input`] tells whose fault it is.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum LaboratoryError {
    /// A setting out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A pixel without a left and a right half.
    #[error(
        "{pixel}: subpixels is {subpixels}; allowed: at least two columns, or there is nothing to part"
    )]
    OneColumn {
        /// Its name.
        pixel: String,
        /// Its sub-pixels.
        subpixels: Subpixels,
    },
    /// A pixel without a mosaic, or without a left and a right half.
    #[error(
        "{pixel}: allowed in the mosaic study: a pixel with [mosaic] and at least two columns of sub-pixels"
    )]
    NoMosaic {
        /// Its name.
        pixel: String,
    },
    /// A pixel model that gives no fields.
    #[error("model is {model}; allowed: rcwa in the coherent study, whose sums need fields")]
    NoFields {
        /// The model.
        model: Level,
    },
    /// What would take more memory than there should be.
    #[error(
        "{what} take {gb:.1} GB; allowed: {most_gb} GB (a smaller pixel, or a coarser --preset)"
    )]
    Memory {
        /// What.
        what: String,
        /// How much, GB.
        gb: f64,
        /// The limit, GB.
        most_gb: f64,
    },
    /// A pixel model that cannot answer for one pixel of several.
    #[error("{pixel}: {cause}")]
    Pixel {
        /// The pixel, as the study calls it.
        pixel: String,
        /// Why.
        cause: Box<ResponseError>,
    },
    /// A pixel model or its table.
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// A pixel's layers.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// The main lens.
    #[error(transparent)]
    Lens(#[from] LensError),
    /// A camera that cannot be made of its parts.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A chart.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A texture.
    #[error(transparent)]
    Texture(#[from] TextureError),
    /// A card's outline.
    #[error(transparent)]
    Coverage(#[from] CoverageError),
    /// What the generators make of a name or a camera.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// A window that does not see a card, or a lens without a chief ray.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A file that cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// Points that are done cannot be kept on disk.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A picture that cannot be written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A camera that sees nothing.
    #[error("no light reaches the middle of the sensor")]
    Dark,
    /// A table whose lens shifts cannot be thinned out.
    #[error("the table has no such part of its shifts")]
    NoSuchShifts,
    /// A built-in pixel without a table that comes with the program.
    #[error("no response of {0} comes with the program")]
    NoShippedTable(&'static str),
    /// The threads of the system.
    #[error("a thread stopped")]
    Thread,
}

impl From<SolverError> for LaboratoryError {
    fn from(error: SolverError) -> Self {
        Self::Response(error.into())
    }
}

impl LaboratoryError {
    /// Whether other settings mend it. Otherwise the machine failed, or data that come with the program.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Range(_)
            | Self::OneColumn { .. }
            | Self::NoMosaic { .. }
            | Self::NoFields { .. }
            | Self::Memory { .. }
            | Self::Pixel { .. }
            | Self::Response(_)
            | Self::Stack(_)
            | Self::Lens(_)
            | Self::Camera(_)
            | Self::Chart(_)
            | Self::View(_) => true,
            Self::Recipe(error) => error.is_input(),
            Self::File(error) => error.is_of_others(),
            Self::Texture(_)
            | Self::Coverage(_)
            | Self::Image(_)
            | Self::Journal(_)
            | Self::Dark
            | Self::NoSuchShifts
            | Self::NoShippedTable(_)
            | Self::Thread => false,
        }
    }
}
