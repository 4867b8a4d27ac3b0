//! Answers of a pixel that are kept from run to run: those of a wide pixel take minutes, and whoever adds a plane to a
//! capture asks for the same ones again. A fit that was killed goes on where it stopped.

use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::hash::settings_hash;
use quadpixel::journal::{Journal, JournalError};
use quadpixel::progress::Progress;
use quadpixel::response::ResponseCache;
use serde::Serialize;

use super::error::FitError;

/// Where answers are kept, and who hears of them.
#[derive(Clone, Copy)]
pub struct Keeping<'a> {
    /// Among the response tables.
    pub cache: &'a ResponseCache,
    /// Hears of finished directions, and may stop.
    pub progress: &'a dyn Progress,
}

/// What a direction gives both halves under each lens shift.
type Answer = Vec<[f64; 2]>;

/// The answers of one table.
pub(super) struct Answers<'a> {
    /// `None` where nothing can be kept, which costs no more than the time of the next run.
    journal: Option<Journal<usize, Answer>>,
    progress: &'a dyn Progress,
    done: AtomicUsize,
    total: usize,
}

impl<'a> Keeping<'a> {
    /// Those of a table of so many directions that is `made_of` this.
    ///
    /// # Errors
    /// A stop while another process makes the same.
    pub(super) fn answers(
        &self,
        made_of: &impl Serialize,
        total: usize,
    ) -> Result<Answers<'a>, FitError> {
        let open = |key: String| {
            let path = self.cache.path(&format!("fit-{key}"));
            match Journal::open(&path.with_extension("jsonl"), &key, self.progress) {
                Err(JournalError::Stopped { .. }) => Err(FitError::Stopped),
                journal => Ok(journal.ok()),
            }
        };
        Ok(Answers {
            journal: settings_hash(made_of).ok().map(open).transpose()?.flatten(),
            progress: self.progress,
            done: AtomicUsize::new(0),
            total,
        })
    }
}

impl Answers<'_> {
    /// The answer of a direction that was kept.
    pub fn answer(&self, direction: usize) -> Option<Answer> {
        let answer = self.journal.as_ref()?.outcome(&direction)?.clone();
        self.one_more();
        Some(answer)
    }

    /// Keeps an answer, and hands it back.
    ///
    /// # Errors
    /// A stop that was asked for.
    pub fn keep(&self, direction: usize, answer: Answer) -> Result<Answer, FitError> {
        if let Some(journal) = &self.journal {
            journal.keep(direction, &answer);
        }
        self.one_more();
        match self.progress.stop_asked() {
            true => Err(FitError::Stopped),
            false => Ok(answer),
        }
    }

    fn one_more(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.progress.incidences(done, self.total);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use quadpixel::em::PixelStack;

    use super::super::camera_model::Fineness;
    use super::super::pixel_table::{PixelTable, TableFineness};
    use super::*;

    /// Stops after so many directions.
    struct Patient(usize, AtomicUsize);

    impl Progress for Patient {
        fn incidences(&self, done: usize, _: usize) {
            self.1.fetch_max(done, Ordering::Relaxed);
        }
        fn stop_asked(&self) -> bool {
            self.1.load(Ordering::Relaxed) >= self.0
        }
    }

    #[test]
    fn a_table_goes_on_where_it_stopped_and_is_made_once() {
        let folder = tempfile::tempdir().unwrap();
        let cache = ResponseCache::open(folder.path());
        let stack = PixelStack::builtin("1.4um-dual").unwrap();
        let fineness = TableFineness {
            steps: 2,
            shifts: 4,
            ..Fineness::draft().table
        };
        let table = |progress: Option<&dyn Progress>| {
            let cache = &cache;
            let keeping = progress.map(|progress| Keeping { cache, progress });
            PixelTable::new(&stack, 550.0, [0.3, 0.2], &fineness, keeping.as_ref())
        };
        let halves = |table: PixelTable| {
            let silicon = stack.silicon_at(550.0).unwrap();
            let anywhere = quadpixel::sensor::CollectedAt::Anywhere;
            let wandering = quadpixel::sensor::Wandering::new(anywhere, &silicon);
            let halves = table.shifted(0.1, 0.0, 0.0, &wandering);
            [0.0, 0.1, -0.2].map(|u| halves.at(u, 0.05))
        };
        let plain = halves(table(None).unwrap());
        let patient = Patient(3, AtomicUsize::new(0));
        assert!(matches!(table(Some(&patient)), Err(FitError::Stopped)));
        let lines = || {
            let file = std::fs::read_dir(folder.path()).unwrap().next().unwrap();
            std::fs::read_to_string(file.unwrap().path())
                .unwrap()
                .lines()
                .count()
        };
        let stopped = lines();
        assert!((4..10).contains(&stopped), "{stopped} lines");
        assert_eq!(halves(table(Some(&())).unwrap()), plain);
        // A head and 4 x 3 directions.
        assert_eq!(lines(), 13);
        assert_eq!(halves(table(Some(&())).unwrap()), plain);
        assert_eq!(lines(), 13);
    }
}
