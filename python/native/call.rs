//! How a call from Python runs: on threads of its own, without Python's lock, stopped by Ctrl-C, heard by a callback.
//!
//! The calling thread waits, and every [`WAIT`] asks Python for signals and tells the callback how far the work is. A
//! call that is stopped leaves at its next event; what cannot hear (an algorithm) ends in the background, and its
//! result is dropped.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::{PyOSError, PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use quadpixel_cli::exit::CommandError;
use quadpixel_generators::observer::{Event, Observer};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::json::raised;

/// Between two looks at signals and progress.
const WAIT: Duration = Duration::from_millis(25);
/// How long stopped work is waited for.
const PATIENCE: Duration = Duration::from_millis(500);
/// Most threads per core, and most on few cores, as on the command line.
const THREADS_PER_CORE: usize = 16;
const MOST_ON_FEW_CORES: usize = 256;
/// Stack of a thread, as large as a program's first one.
const STACK_BYTES: usize = 8 << 20;

/// The threads of a process. A forked one has none of its parent's, and makes its own.
struct Threads {
    process: u32,
    count: usize,
    pool: Option<Arc<ThreadPool>>,
}

/// Locked only with Python's lock held, so that no fork finds it locked.
static THREADS: Mutex<Threads> = Mutex::new(Threads {
    process: 0,
    count: 0,
    pool: None,
});

fn pool(_: Python<'_>) -> PyResult<Arc<ThreadPool>> {
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    if threads.process != std::process::id() {
        // A parent's pool has no threads here, and waiting for their end would never end.
        std::mem::forget(threads.pool.take());
        threads.process = std::process::id();
    }
    if let Some(pool) = &threads.pool {
        return Ok(pool.clone());
    }
    let built = ThreadPoolBuilder::new()
        .num_threads(threads.count)
        .stack_size(STACK_BYTES)
        .thread_name(|i| format!("quadpixel-{i}"))
        .build();
    let pool = Arc::new(built.map_err(|e| PyOSError::new_err(format!("threads: {e}")))?);
    threads.pool = Some(pool.clone());
    Ok(pool)
}

/// Does what takes milliseconds on the process's threads, without hearing signals meanwhile. Rayon's own pool is no
/// place for it: a forked process has none of its threads, and would wait for them.
///
/// # Errors
/// Threads that cannot be had.
pub fn on_threads<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(pool(py)?.install(work))
}

/// Sets the number of threads of this process and of those forked from it; 0: one per core.
#[pyfunction]
pub fn set_threads(py: Python<'_>, count: usize) -> PyResult<()> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = (THREADS_PER_CORE * cores).max(MOST_ON_FEW_CORES);
    if count > most {
        let text = format!("threads is {count}; allowed: 0 to {most} on this machine");
        return Err(PyValueError::new_err(text));
    }
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    let old = threads.pool.take();
    threads.count = count;
    if threads.process != std::process::id() {
        std::mem::forget(old);
    }
    drop(threads);
    pool(py).map(drop)
}

/// Number of threads that calls run on.
#[pyfunction]
pub fn threads(py: Python<'_>) -> PyResult<usize> {
    Ok(pool(py)?.current_num_threads())
}

/// What work tells of itself, and whether it is to stop.
#[derive(Default)]
pub struct Watch {
    stop: AtomicBool,
    done: AtomicU64,
    total: AtomicU64,
    warnings: Mutex<Vec<String>>,
}

/// With what stopped work unwinds.
struct Stopped;

impl Watch {
    /// Keeps a warning for the caller.
    pub fn warn(&self, text: &str) {
        let mut warnings = self.warnings.lock().unwrap_or_else(PoisonError::into_inner);
        warnings.push(text.to_owned());
    }

    fn leave_if_stopped(&self) {
        if self.stop.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Stopped));
        }
    }
}

impl Observer for Watch {
    fn event(&self, event: Event<'_>) {
        match event {
            Event::Start { rays, .. } => self.total.store(rays, Ordering::Relaxed),
            Event::Rays(rays) => {
                self.done.fetch_add(rays, Ordering::Relaxed);
                self.leave_if_stopped();
            }
            Event::Table { .. } => self.leave_if_stopped(),
            Event::Warning(text) => self.warn(text),
            _ => {}
        }
    }

    fn stop_asked(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

type Outcome<T> = Result<Result<T, CommandError>, Box<dyn Any + Send>>;

/// Runs `work` on the process's threads. `progress` is called with (done, total) rays, in the calling thread.
///
/// # Errors
/// The work's own; what a signal handler or the callback raises.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Watch) -> Result<T, CommandError> + Send + 'static,
) -> PyResult<T> {
    let watch = Arc::new(Watch::default());
    let (sender, mut receiver) = channel::<Outcome<T>>();
    let heard = watch.clone();
    pool(py)?.spawn(move || {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&heard)));
        // Nobody waits for work that was stopped.
        let _ = sender.send(outcome);
    });
    let mut told = u64::MAX;
    let outcome = loop {
        let waited;
        (receiver, waited) = wait(py, receiver, WAIT);
        let heard = match waited {
            Ok(outcome) => break Some(outcome),
            Err(RecvTimeoutError::Disconnected) => break None,
            Err(RecvTimeoutError::Timeout) => py
                .check_signals()
                .and_then(|()| tell(&watch, progress, &mut told)),
        };
        if let Err(stopped) = heard {
            watch.stop.store(true, Ordering::Relaxed);
            let _ = wait(py, receiver, PATIENCE);
            return Err(stopped);
        }
    };
    let Some(Ok(result)) = outcome else {
        return Err(PyRuntimeError::new_err(
            "a fault of the program, which is said above; please report it",
        ));
    };
    warn(py, &watch)?;
    let result = result.map_err(raised)?;
    tell(&watch, progress, &mut told)?;
    Ok(result)
}

type Waited<T> = (Receiver<Outcome<T>>, Result<Outcome<T>, RecvTimeoutError>);

fn wait<T: Send + 'static>(
    py: Python<'_>,
    receiver: Receiver<Outcome<T>>,
    time: Duration,
) -> Waited<T> {
    py.detach(move || {
        let waited = receiver.recv_timeout(time);
        (receiver, waited)
    })
}

fn tell(watch: &Watch, progress: Option<&Bound<'_, PyAny>>, told: &mut u64) -> PyResult<()> {
    let done = watch.done.load(Ordering::Relaxed);
    let total = watch.total.load(Ordering::Relaxed);
    if let Some(progress) = progress
        && done != *told
    {
        *told = done;
        // Rays that are traced a second time, to measure the spread, count too.
        progress.call1((done.min(total), total))?;
    }
    Ok(())
}

fn warn(py: Python<'_>, watch: &Watch) -> PyResult<()> {
    let texts = std::mem::take(
        &mut *watch
            .warnings
            .lock()
            .unwrap_or_else(PoisonError::into_inner),
    );
    let warnings = py.import("warnings")?;
    let category = py.get_type::<PyUserWarning>();
    for text in texts {
        warnings.call_method1("warn", (text, &category))?;
    }
    Ok(())
}
