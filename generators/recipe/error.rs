//! Why a recipe cannot be read or drawn, or describes no camera and scene.

use std::path::PathBuf;

use quadpixel::em::StackError;
use quadpixel::lens::LensError;
use quadpixel::range::OutOfRange;
use quadpixel::render::CameraError;
use quadpixel::response::ResponseError;

use crate::charts::ChartError;
use crate::field_error::FieldError;
use crate::rgbd::PictureError;
use crate::scenes::SceneError;
use crate::scenes::field_of_view::ViewError;

/// Why a recipe cannot be read or drawn, or describes no camera and scene.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// A file that cannot be read.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// A text that is no recipe.
    #[error("{name}: {cause}")]
    Toml {
        /// What the text is called.
        name: String,
        /// The place and what is wrong there.
        cause: Box<toml::de::Error>,
    },
    /// A `meta.json` that holds no recipe.
    #[error("{name}: {cause}")]
    Json {
        /// The file.
        name: String,
        /// The place and what is wrong there.
        cause: serde_json::Error,
    },
    /// A part of the recipe.
    #[error("{place}: {cause}")]
    In {
        /// Which part.
        place: String,
        /// What is wrong with it.
        cause: Box<Self>,
    },
    /// A field out of its range.
    #[error(transparent)]
    Field(#[from] FieldError),
    /// A value that a part of the camera refuses.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// Something is absent, or there are two that exclude each other.
    #[error("{0}")]
    Incomplete(&'static str),
    /// A tolerance that is none: its field, its value and what is allowed.
    #[error("{0}")]
    Tolerance(String),
    /// The main lens.
    #[error(transparent)]
    Lens(#[from] LensError),
    /// The pixel.
    #[error(transparent)]
    Pixel(#[from] StackError),
    /// The pixel's response.
    #[error(transparent)]
    Response(#[from] ResponseError),
    /// A response table that takes long and was not made before.
    #[error("response: no {table}; {time}: {command}")]
    NoTable {
        /// Which table, and where it was looked for.
        table: String,
        /// How long it takes to make it.
        time: String,
        /// The command that makes it.
        command: String,
    },
    /// A response that comes with the program and cannot be read.
    #[error(transparent)]
    Shipped(ResponseError),
    /// A recipe, or its lens, that cannot be written as JSON.
    #[error("{what}: {cause}")]
    Written {
        /// What it is.
        what: &'static str,
        /// Why.
        cause: serde_json::Error,
    },
    /// Lens, sensor and response that do not go together.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// A chart.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A chart of a configuration's list.
    #[error("scene.charts: {0}")]
    ListedChart(ChartError),
    /// A picture with depth.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A generated world, or a scene file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A window that does not see what it should.
    #[error(transparent)]
    View(#[from] ViewError),
    /// A place of the sensor that no light reaches.
    #[error("no light reaches the sensor at ({x_mm:.3}, {y_mm:.3}) mm")]
    Dark {
        /// The place, mm, sensor frame.
        x_mm: f64,
        /// The place, mm, sensor frame.
        y_mm: f64,
    },
}

impl RecipeError {
    /// The same error, said to be in `place` (a file, a field).
    pub fn within(self, place: impl Into<String>) -> Self {
        Self::In {
            place: place.into(),
            cause: Box::new(self),
        }
    }

    /// The error of `what`, which cannot be written as JSON.
    pub(crate) fn unwritten(what: &'static str) -> impl Fn(serde_json::Error) -> Self {
        move |cause| Self::Written { what, cause }
    }

    /// Whether the caller can mend it. Otherwise something that comes with the program is broken.
    pub fn is_input(&self) -> bool {
        match self {
            Self::In { cause, .. } => cause.is_input(),
            Self::Shipped(_)
            | Self::Written { .. }
            | Self::Response(ResponseError::Stopped { .. }) => false,
            _ => true,
        }
    }
}
