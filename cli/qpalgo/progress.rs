//! Signs of life on stderr from commands that take longer than two seconds: the stage and the seconds since the start,
//! on a terminal in one line that goes away, elsewhere one line a stage.

use std::io::{IsTerminal, Write};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Before this nothing is shown.
const PATIENCE: Duration = Duration::from_secs(2);

/// Time from line to line on a terminal.
const STEP: Duration = Duration::from_millis(500);

/// Shows stages until it is dropped.
pub struct Progress {
    stages: Option<Sender<String>>,
    thread: Option<JoinHandle<()>>,
}

impl Progress {
    /// Shows nothing.
    pub fn silent() -> Self {
        Self {
            stages: None,
            thread: None,
        }
    }

    /// Shows on stderr.
    pub fn stderr() -> Self {
        let (stages, told) = channel::<String>();
        let terminal = std::io::stderr().is_terminal();
        let began = Instant::now();
        let show = move || {
            let mut stage: Option<String> = None;
            let mut wait = PATIENCE;
            loop {
                match told.recv_timeout(wait) {
                    Ok(next) => stage = Some(next),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => break,
                }
                let since = began.elapsed();
                wait = PATIENCE.saturating_sub(since).max(STEP);
                if since < PATIENCE {
                    continue;
                }
                let Some(text) = &stage else { continue };
                if terminal {
                    eprint!("\r\x1b[K{text} · {:.0} s", since.as_secs_f64());
                    // A line that cannot be shown loses nothing.
                    let _ = std::io::stderr().flush();
                } else {
                    eprintln!("{text} · {:.1} s", since.as_secs_f64());
                    stage = None;
                }
            }
            if terminal && began.elapsed() >= PATIENCE {
                eprint!("\r\x1b[K");
            }
        };
        Self {
            stages: Some(stages),
            thread: Some(std::thread::spawn(show)),
        }
    }

    /// Tells what is done now.
    pub fn stage(&self, text: impl Into<String>) {
        if let Some(stages) = &self.stages {
            // The thread ends only with this value, and nothing is lost if it did.
            let _ = stages.send(text.into());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.stages = None;
        if let Some(thread) = self.thread.take() {
            // It does nothing that could fail.
            let _ = thread.join();
        }
    }
}
