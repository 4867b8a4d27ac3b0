//! How a command of `qpalgo` ends badly: by its input (exit 2), or by the machine (exit 1).

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
    pub fn input(text: String) -> Self {
        Self::Input(text)
    }

    /// A failure.
    pub fn failed(text: String) -> Self {
        Self::Failed(text)
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
