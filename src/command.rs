//! How a command ends badly, by its input (exit code 2), by the machine (1) or because nobody reads on, and the threads that it runs on:
//! what the workspace's binaries share. Without their `main` asking it prints nothing and ends nothing.

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

/// Sets the number of threads of the whole process, once, before any work; 0: all cores.
pub fn use_threads(count: usize) -> Result<(), CommandError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build_global()
        .map_err(|e| CommandError::failed(format!("--threads {count}: {e}")))
}

/// What a process exits with whose reader has gone away (`| head`): 128 and the signal's number, as a shell says of other programs.
#[cfg(unix)]
pub const NOBODY_READS: i32 = 128 + signal_hook::consts::SIGPIPE;

/// From now on the process ends without a word, by [`NOBODY_READS`], once it writes to a pipe that nobody reads any more; by Rust's own
/// ways it would panic. Elsewhere than on Unix it does nothing.
pub fn end_with_the_reader() -> Result<(), CommandError> {
    #[cfg(unix)]
    {
        use signal_hook::{consts::SIGPIPE, flag};
        let always = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
        flag::register_conditional_shutdown(SIGPIPE, NOBODY_READS, always)
            .map_err(|e| CommandError::failed(format!("signal {SIGPIPE}: {e}")))?;
    }
    Ok(())
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
