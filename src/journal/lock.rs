//! One process at a time has a journal.

use std::fs::{File, TryLockError};
use std::path::Path;
use std::time::{Duration, Instant};

use super::JournalError;
use crate::progress::Progress;

/// How often a journal that is open elsewhere is tried, and how often that is told.
const TRY_EVERY: Duration = Duration::from_millis(50);
const TELL_EVERY: Duration = Duration::from_secs(10);

/// Waits until no other process has it open.
pub(super) fn lock(file: &File, path: &Path, progress: &dyn Progress) -> Result<(), JournalError> {
    let began = Instant::now();
    let mut told: Option<Instant> = None;
    // A file system without locks: two processes may then do the same work; lines are written whole.
    while matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        if progress.stop_asked() {
            return Err(JournalError::Stopped {
                path: path.to_owned(),
            });
        }
        if told.is_none_or(|at| at.elapsed() > TELL_EVERY) {
            told = Some(Instant::now());
            progress.waiting(path, began.elapsed());
        }
        std::thread::sleep(TRY_EVERY);
    }
    Ok(())
}
