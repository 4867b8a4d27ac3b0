//! The process around a command: its arguments and threads, and its end when nobody reads what it prints.

use std::ffi::OsString;
use std::io::Write;

use crate::exit::CommandError;
use crate::print::say;

/// Most threads per core, and most on few cores: more only take memory and time to begin.
const THREADS_PER_CORE: usize = 16;
const MOST_ON_FEW_CORES: usize = 256;

/// The arguments, of which the first is the program's name; else the exit code of a process that has said its help, its
/// version, or what is wrong with them.
///
/// # Errors
/// The exit code: 0, 2 for bad arguments, 1 where nothing can be printed.
pub fn parse<Arguments: clap::Parser>(
    args: impl IntoIterator<Item = OsString>,
) -> Result<Arguments, u8> {
    Arguments::try_parse_from(args).map_err(|error| {
        let printed = error.print().and_then(|()| std::io::stdout().flush());
        match printed {
            Err(cause) if !error.use_stderr() => {
                say(&format!("stdout: cannot write: {cause}"));
                1
            }
            _ => u8::try_from(error.exit_code()).unwrap_or(2),
        }
    })
}

/// Sets the number of threads of the whole process, once, before any work; 0: all cores.
///
/// # Errors
/// More than 16 per core and 256 (2); called twice, or the system refuses the threads (1).
pub fn use_threads(count: usize) -> Result<(), CommandError> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = (THREADS_PER_CORE * cores).max(MOST_ON_FEW_CORES);
    if count > most {
        return Err(CommandError::input(format!(
            "--threads is {count}; allowed: 0 to {most} on this machine"
        )));
    }
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

/// From now on a limit on the size of files (`ulimit -f`) is an error of the write, with its reason, and not the end of
/// the process without a word. Does nothing except on Unix.
///
/// # Errors
/// The signal cannot be registered.
pub fn fail_on_file_size_limit() -> Result<(), CommandError> {
    #[cfg(unix)]
    {
        use signal_hook::consts::signal::SIGXFSZ;
        // A handler that does nothing of note: the write then fails.
        signal_hook::flag::register(SIGXFSZ, std::sync::Arc::default())
            .map_err(|e| CommandError::failed(format!("signal {SIGXFSZ}: {e}")))?;
    }
    Ok(())
}
