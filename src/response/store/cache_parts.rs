//! Tables made in parts, each by a process of its own.

use std::path::PathBuf;

use super::cache::ResponseCache;
use crate::progress::Progress;
use crate::response::tabulate::RunJournal;
use crate::response::{ResponseError, TablePlan};
use crate::shard::Shard;

/// What was done for a part of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartOfTable {
    /// The journal that holds it.
    pub path: PathBuf,
    /// Plane waves in it.
    pub runs: usize,
    /// Those of them that an earlier, interrupted call had done.
    pub reused: usize,
}

impl ResponseCache {
    /// Simulates one part of the directions of a plan, each under all its lens shifts, into a journal beside the
    /// tables. When all parts have, [`Self::table`] in the same folder makes the table of them, with the bytes of one
    /// made in one go; what a part did not do, it does itself.
    ///
    /// # Errors
    /// A pixel that the model has no answer for, or a folder that the journal cannot be kept in.
    pub fn make_part(
        &self,
        plan: &TablePlan,
        shard: Shard,
        progress: &dyn Progress,
    ) -> Result<PartOfTable, ResponseError> {
        let key = plan.simulation_key()?;
        let name = format!("{key}.{}-of-{}.journal", shard.number(), shard.count());
        let journal = RunJournal::open(&self.dir.join(name), &key, progress)?;
        let (runs, reused) = plan.build_part(shard, &journal, progress)?;
        let path = journal.path().to_owned();
        match journal.trouble() {
            None => Ok(PartOfTable { path, runs, reused }),
            Some(trouble) => Err(ResponseError::Io {
                path,
                source: std::io::Error::other(trouble),
            }),
        }
    }

    /// The journals of parts of a table, in the order of their names.
    pub(super) fn parts(&self, key: &str) -> Vec<PathBuf> {
        let Ok(entries) = std::fs::read_dir(&self.dir) else {
            return Vec::new();
        };
        let of_key = |path: &PathBuf| {
            let name = path.file_name().and_then(|n| n.to_str());
            let part = name.and_then(|n| n.strip_prefix(key)?.strip_suffix(".journal"));
            part.is_some_and(|part| part.contains("-of-"))
        };
        let mut parts: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(of_key).collect();
        parts.sort();
        parts
    }
}
