//! Ctrl-C and a scheduler's SIGTERM: the first asks the run to end after the sample in hand, a second one ends it at
//! once. Both are safe: a sample gets its name when it is whole.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit::CommandError;
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Whether the run was asked to end.
#[derive(Clone, Debug, Default)]
pub struct Stop {
    asked: Arc<AtomicBool>,
    reported: Arc<AtomicBool>,
}

impl Stop {
    /// Never asked.
    pub fn never() -> Self {
        Self::default()
    }

    /// Asked by SIGINT or SIGTERM from now on; the second signal ends the process with code 1.
    ///
    /// # Errors
    /// The system refuses the handlers.
    pub fn on_signals() -> Result<Self, CommandError> {
        let stop = Self::default();
        for signal in [SIGINT, SIGTERM] {
            // The order matters: the first signal finds the flag down, the second up.
            flag::register_conditional_shutdown(signal, 1, stop.asked.clone())
                .and_then(|_| flag::register(signal, stop.asked.clone()))
                .map_err(|e| CommandError::failed(format!("signal {signal}: {e}")))?;
        }
        Ok(stop)
    }

    /// Whether it was asked.
    pub fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// True once, after it was asked: the moment to report it.
    pub fn is_news(&self) -> bool {
        self.is_asked() && !self.reported.swap(true, Ordering::Relaxed)
    }
}
