//! Why a command failed: by its input (exit code 2) or by the machine (1).

use quadpixel::file::FileError;
use quadpixel::lens::LensError;
use quadpixel::response::ResponseError;
use quadpixel_algorithms::depth::CalibrateError;
use quadpixel_generators::bank::BankError;
use quadpixel_generators::config::ConfigError;
use quadpixel_generators::export::ExportError;
use quadpixel_generators::production::error::GenerateError;
use quadpixel_generators::production::folder_error::FolderError;
use quadpixel_generators::recipe::RecipeError;
use quadpixel_generators::rgbd::PictureError;
use quadpixel_generators::sample::SampleError;
use quadpixel_generators::scenes::SceneError;
use quadpixel_generators::writer::WriteError;
use quadpixel_laboratory::error::LaboratoryError;
use quadpixel_laboratory::fit::error::FitError;

/// Why a command stopped.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// Bad arguments, configuration or input file: exit code 2.
    #[error("{0}")]
    Input(String),
    /// The work itself failed (disk, check): exit code 1.
    #[error("{0}")]
    Failed(String),
}

impl CommandError {
    /// An input error.
    pub fn input(text: impl ToString) -> Self {
        Self::Input(text.to_string())
    }

    /// A failure.
    pub fn failed(text: impl ToString) -> Self {
        Self::Failed(text.to_string())
    }

    /// The same error, said to be in `place` (a file, a field).
    pub fn within(self, place: &str) -> Self {
        match self {
            Self::Input(text) => Self::Input(format!("{place}: {text}")),
            Self::Failed(text) => Self::Failed(format!("{place}: {text}")),
        }
    }

    /// Exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Failed(_) => 1,
        }
    }
}

/// Errors of the libraries know whose fault they are.
macro_rules! from_library_errors {
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
from_library_errors!(
    BankError,
    ConfigError,
    ExportError,
    FitError,
    FolderError,
    GenerateError,
    LaboratoryError,
    PictureError,
    RecipeError,
    SampleError,
    SceneError,
    WriteError
);

/// Planes are input.
impl From<CalibrateError> for CommandError {
    fn from(error: CalibrateError) -> Self {
        Self::input(error)
    }
}

/// A pixel or table that cannot be (2); a disk that fails, or a wait that ended (1).
impl From<ResponseError> for CommandError {
    fn from(error: ResponseError) -> Self {
        match error {
            ResponseError::Io { .. } | ResponseError::Stopped { .. } => Self::failed(error),
            other => Self::input(other),
        }
    }
}

/// The disk failed (1), or something of others is in the way (2).
impl From<FileError> for CommandError {
    fn from(error: FileError) -> Self {
        match error.is_of_others() {
            true => Self::input(error),
            false => Self::failed(error),
        }
    }
}

/// A lens that does not exist or cannot be.
impl From<LensError> for CommandError {
    fn from(error: LensError) -> Self {
        Self::input(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_named_in_front_and_the_exit_code_stays() {
        for (error, code) in [
            (CommandError::input("k = 7".to_owned()), 2),
            (CommandError::failed("k = 7".to_owned()), 1),
        ] {
            let within = error.within("a.toml");
            assert_eq!(
                (within.exit_code(), within.to_string()),
                (code, "a.toml: k = 7".to_owned())
            );
        }
    }
}
