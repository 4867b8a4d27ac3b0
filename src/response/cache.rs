//! Tables that were simulated once are kept in a folder, one file a key; beside them the journals of those not finished.

use std::path::{Path, PathBuf};

use super::build::{build_part, build_with};
use super::build_shifted::{build_shifted_part, build_shifted_with};
use super::journal::Journal;
use super::{
    AngularResponse, BuildReport, BuiltTable, ResponseError, ShiftedSettings, TableSettings,
};
use crate::em::PixelStack;
use crate::shard::Shard;

/// A folder of tables.
#[derive(Clone, Debug)]
pub struct ResponseCache {
    dir: PathBuf,
}

/// The table is right, but the cache is not.
#[derive(Debug)]
pub enum CacheWarning {
    /// A file was there and was no such table; it was simulated anew.
    Rebuilt {
        /// The file.
        path: PathBuf,
        /// What was wrong with it.
        why: String,
    },
    /// Runs could not be kept while it was made.
    NoJournal(String),
    /// The table could not be kept.
    NotKept {
        /// The file.
        path: PathBuf,
        /// Why not.
        why: String,
    },
}

/// A table from the cache or made for it.
#[derive(Debug)]
pub struct CachedTable {
    /// The table.
    pub table: AngularResponse,
    /// How it came about, if it was made now.
    pub report: Option<BuildReport>,
    /// What is wrong with the cache.
    pub warnings: Vec<CacheWarning>,
}

impl std::fmt::Display for CacheWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Rebuilt { path, why } => {
                write!(
                    f,
                    "{}: not the table it should be ({why}); made anew",
                    path.display()
                )
            }
            Self::NoJournal(why) => {
                write!(f, "{why}: a build that stops would begin anew")
            }
            Self::NotKept { path, why } => {
                write!(f, "{}: the table could not be kept ({why})", path.display())
            }
        }
    }
}

impl ResponseCache {
    /// A cache in `dir`, which is made when the first table is kept.
    pub fn open(dir: impl Into<PathBuf>) -> Self {
        Self { dir: dir.into() }
    }

    /// `$QUADPIXEL_CACHE`, else `$XDG_CACHE_HOME/quadpixel`, else `~/.cache/quadpixel`, else a folder for temporary files.
    pub fn default_dir() -> PathBuf {
        let set = |name| {
            std::env::var_os(name)
                .filter(|v| !v.is_empty())
                .map(PathBuf::from)
        };
        set("QUADPIXEL_CACHE")
            .or_else(|| set("XDG_CACHE_HOME").map(|d| d.join("quadpixel")))
            .or_else(|| set("HOME").map(|d| d.join(".cache").join("quadpixel")))
            .unwrap_or_else(|| std::env::temp_dir().join("quadpixel"))
    }

    /// The file of a key.
    pub fn path(&self, key: &str) -> PathBuf {
        self.dir.join(format!("{key}.npz"))
    }

    /// The table of a key, if it was kept; a file that is something else is a warning.
    pub fn get(&self, key: &str) -> Result<Option<AngularResponse>, CacheWarning> {
        let path = self.path(key);
        if !path.exists() {
            return Ok(None);
        }
        match read(&path, key) {
            Ok(found) => Ok(Some(found)),
            Err(why) => Err(CacheWarning::Rebuilt { path, why }),
        }
    }

    /// The table of a pixel: from the cache, else simulated and kept. A build that was stopped goes on where it was. Trouble with the
    /// cache is no failure; it comes back as warnings.
    pub fn get_or_build(
        &self,
        stack: &PixelStack,
        settings: &TableSettings,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<CachedTable, ResponseError> {
        settings.check()?;
        stack.check()?;
        let build = |journal: Option<&Journal>| build_with(stack, settings, journal, progress);
        self.get_or(&settings.key(stack), build)
    }

    /// [`Self::get_or_build`] of a table of all lens shifts.
    pub fn get_or_build_shifted(
        &self,
        stack: &PixelStack,
        settings: &ShiftedSettings,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<CachedTable, ResponseError> {
        settings.check()?;
        stack.check()?;
        let build =
            |journal: Option<&Journal>| build_shifted_with(stack, settings, journal, progress);
        self.get_or(&settings.key(stack), build)
    }

    /// The table of a key, or what `build` makes with the journal that it is given.
    fn get_or(
        &self,
        key: &str,
        build: impl FnOnce(Option<&Journal>) -> Result<BuiltTable, ResponseError>,
    ) -> Result<CachedTable, ResponseError> {
        let path = self.path(key);
        let mut warnings = Vec::new();
        match self.get(key) {
            Ok(Some(table)) => {
                return Ok(CachedTable {
                    table,
                    report: None,
                    warnings,
                });
            }
            Ok(None) => {}
            Err(warning) => warnings.push(warning),
        }
        let folder = std::fs::create_dir_all(&self.dir);
        let path_of_journal = path.with_extension("journal");
        let opened = (folder.is_ok()).then(|| Journal::open(&path_of_journal, key));
        let (mut journal, no_journal) = match opened.transpose() {
            Ok(journal) => (journal, None),
            Err(e) => (None, Some(e.to_string())),
        };
        if let Some(open) = &mut journal {
            // Another process may have made the table while this one waited for the journal.
            if let Ok(Some(table)) = self.get(key) {
                let trouble = journal.and_then(Journal::remove);
                warnings.extend(trouble.map(CacheWarning::NoJournal));
                return Ok(CachedTable {
                    table,
                    report: None,
                    warnings,
                });
            }
            for part in self.parts(key) {
                open.join(&part, key);
            }
        }
        let BuiltTable { table, mut report } = build(journal.as_ref())?;
        let kept = folder
            .map_err(|e| e.to_string())
            .and_then(|()| table.write_npz(&path).map_err(|e| e.to_string()));
        if let Err(why) = kept {
            warnings.push(CacheWarning::NotKept { path, why });
        }
        // Only now: a process that waits for the journal finds the table.
        report.journal_trouble = no_journal.or(journal.and_then(Journal::remove));
        let trouble = report.journal_trouble.clone();
        warnings.extend(trouble.map(CacheWarning::NoJournal));
        Ok(CachedTable {
            table,
            report: Some(report),
            warnings,
        })
    }

    /// Simulates one part of the directions of a table into a journal beside it. When all parts have, [`Self::get_or_build`] in the
    /// same folder makes the table of them, with the bytes of one made in one go; what a part did not do, it does itself.
    ///
    /// # Errors
    /// Bad settings, or a folder that the journal cannot be kept in.
    pub fn build_part(
        &self,
        stack: &PixelStack,
        settings: &TableSettings,
        shard: Shard,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<PartOfTable, ResponseError> {
        settings.check()?;
        stack.check()?;
        self.part(&settings.key(stack), shard, |journal| {
            build_part(stack, settings, journal, shard, progress)
        })
    }

    /// [`Self::build_part`] of a table of all lens shifts: part of the directions, each under all shifts.
    ///
    /// # Errors
    /// As there.
    pub fn build_shifted_part(
        &self,
        stack: &PixelStack,
        settings: &ShiftedSettings,
        shard: Shard,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<PartOfTable, ResponseError> {
        settings.check()?;
        stack.check()?;
        self.part(&settings.key(stack), shard, |journal| {
            build_shifted_part(stack, settings, journal, shard, progress)
        })
    }

    /// What `build` keeps in the journal of a part of the table `key`.
    fn part(
        &self,
        key: &str,
        shard: Shard,
        build: impl FnOnce(&Journal) -> Result<(usize, usize), ResponseError>,
    ) -> Result<PartOfTable, ResponseError> {
        let name = format!("{key}.{}-of-{}.journal", shard.number(), shard.count());
        let journal = Journal::open(&self.dir.join(name), key)?;
        let (runs, reused) = build(&journal)?;
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
    fn parts(&self, key: &str) -> Vec<PathBuf> {
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

/// What was done for a part of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartOfTable {
    /// The journal that holds it.
    pub path: PathBuf,
    /// Runs of the pixel model in it.
    pub runs: usize,
    /// Those of them that an earlier, interrupted call had done.
    pub reused: usize,
}

fn read(path: &Path, key: &str) -> Result<AngularResponse, String> {
    let found = AngularResponse::read_npz(path).map_err(|e| e.to_string())?;
    if found.meta().key == key {
        Ok(found)
    } else {
        Err(format!("its key is {}", found.meta().key))
    }
}
