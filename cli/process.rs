//! The process around a command: its threads, and its end when nobody reads what it prints.

use crate::exit::CommandError;

/// Sets the number of threads of the whole process, once, before any work; 0: all cores.
///
/// # Errors
/// Called twice, or the system refuses the threads.
pub fn use_threads(count: usize) -> Result<(), CommandError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(count)
        .build_global()
        .map_err(|e| CommandError::failed(format!("--threads {count}: {e}")))
}

/// Exit code of a process whose reader has gone away (`| head`): 128 and the signal's number, as a shell reports other
/// programs.
#[cfg(unix)]
pub const CLOSED_PIPE: i32 = 128 + signal_hook::consts::SIGPIPE;

/// From now on the process ends silently with [`CLOSED_PIPE`] once it writes to a pipe that nobody reads any more;
/// Rust's default is a panic. Does nothing except on Unix.
///
/// # Errors
/// The signal cannot be registered.
pub fn exit_on_closed_pipe() -> Result<(), CommandError> {
    #[cfg(unix)]
    {
        use signal_hook::{consts::SIGPIPE, flag};
        let always = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
        flag::register_conditional_shutdown(SIGPIPE, CLOSED_PIPE, always)
            .map_err(|e| CommandError::failed(format!("signal {SIGPIPE}: {e}")))?;
    }
    Ok(())
}
