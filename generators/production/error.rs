//! Why something could not be made. Each error knows whether it is the input's fault or the machine's, by its method
//! `is_input`.

use quadpixel::file::FileError;

use crate::config::ConfigError;
use crate::production::folder_error::FolderError;
use crate::production::identity::IdentityError;
use crate::recipe::RecipeError;
use crate::sample::SampleError;
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
    /// A trial sample that could not be rendered.
    #[error(transparent)]
    Trial(#[from] SampleError),
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
        cause: Box<SampleError>,
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
    /// The observer asked an estimate to stop.
    #[error("stopped by a signal; nothing is left of the estimate")]
    EstimateStopped,
    /// A file that the configuration names.
    #[error(transparent)]
    Identity(#[from] IdentityError),
}

impl GenerateError {
    /// Whether the caller can mend it: another configuration, recipe or folder. Otherwise the machine failed, or the
    /// run was stopped.
    pub fn is_input(&self) -> bool {
        match self {
            Self::Config(_) | Self::Identity(IdentityError::Input { .. }) => true,
            Self::Recipe(e) => e.is_input(),
            Self::Folder(e) => e.is_input(),
            Self::Write(e) => e.is_input(),
            Self::Sample { cause, .. } => cause.is_input(),
            Self::Trial(e) => e.is_input(),
            Self::File(_)
            | Self::Identity(IdentityError::Json(_))
            | Self::Stopped { .. }
            | Self::EstimateStopped => false,
        }
    }
}
