//! Why something could not be made. Each error knows whether it is the input's fault or the machine's, by its method
//! `is_input`.

use quadpixel::command::CommandError;
use quadpixel::file::FileError;

use crate::config::ConfigError;
use crate::export::ExportError;
use crate::production::folder_error::FolderError;
use crate::recipe::RecipeError;
use crate::scenes::SceneError;
use crate::writer::WriteError;

/// Why a dataset or a sample could not be made.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum GenerateError {
    /// The configuration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A recipe, or what it describes.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// The folder that is written to.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A sample that cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The disk.
    #[error(transparent)]
    File(#[from] FileError),
    /// One of the samples.
    #[error("sample {index}: {cause}")]
    Sample {
        /// Its number.
        index: u32,
        /// Why.
        cause: Box<Self>,
    },
    /// The observer asked to stop.
    #[error(
        "stopped by a signal; {done} of {samples} samples are there, and the same command goes on with them"
    )]
    Stopped {
        /// Samples that are there.
        done: usize,
        /// Samples of the run.
        samples: usize,
    },
    /// Anything else.
    #[error(transparent)]
    Other(#[from] CommandError),
}

impl GenerateError {
    /// Whether the caller can mend it: another configuration, recipe or folder. Otherwise the machine failed, or the
    /// run was stopped.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Config(_) => true,
            Self::Recipe(e) => e.is_input(),
            Self::Folder(e) => e.is_input(),
            Self::Write(e) => e.is_input(),
            Self::Sample { cause, .. } => cause.is_input(),
            Self::File(_) | Self::Stopped { .. } => false,
            Self::Other(e) => e.exit_code() == 2,
        }
    }
}

macro_rules! ends_a_command {
    ($($error:ty),*) => {$(
        impl From<$error> for CommandError {
            fn from(error: $error) -> Self {
                match error.is_input() {
                    true => Self::input(error),
                    false => Self::failed(error),
                }
            }
        }
    )*};
}
ends_a_command!(
    ConfigError,
    RecipeError,
    SceneError,
    FolderError,
    WriteError,
    ExportError,
    GenerateError
);
