//! Tables that were simulated once are kept in a folder, one file a key; beside them the journals of those not finished.

use std::path::{Path, PathBuf};

use super::{
    AngularResponse, BuildReport, BuiltTable, ResponseError, ShiftedSettings, TableSettings,
    build_shifted_table, build_table,
};
use crate::em::PixelStack;

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
        let build = |journal: Option<&Path>| build_table(stack, settings, journal, progress);
        self.get_or(&settings.key(stack), build)
    }

    /// [`Self::get_or_build`] of a table of all lens shifts.
    pub fn get_or_build_shifted(
        &self,
        stack: &PixelStack,
        settings: &ShiftedSettings,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<CachedTable, ResponseError> {
        let build =
            |journal: Option<&Path>| build_shifted_table(stack, settings, journal, progress);
        self.get_or(&settings.key(stack), build)
    }

    /// The table of a key, or what `build` makes with the journal that it is given.
    fn get_or(
        &self,
        key: &str,
        build: impl FnOnce(Option<&Path>) -> Result<BuiltTable, ResponseError>,
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
        let journal = folder.is_ok().then(|| path.with_extension("journal"));
        let BuiltTable { table, report } = build(journal.as_deref())?;
        let trouble = report.journal_trouble.clone();
        warnings.extend(trouble.map(CacheWarning::NoJournal));
        let kept = folder
            .map_err(|e| e.to_string())
            .and_then(|()| table.write_npz(&path).map_err(|e| e.to_string()));
        if let Err(why) = kept {
            warnings.push(CacheWarning::NotKept { path, why });
        }
        Ok(CachedTable {
            table,
            report: Some(report),
            warnings,
        })
    }
}

fn read(path: &Path, key: &str) -> Result<AngularResponse, String> {
    let found = AngularResponse::read_npz(path).map_err(|e| e.to_string())?;
    if found.meta().key == key {
        Ok(found)
    } else {
        Err(format!("its key is {}", found.meta().key))
    }
}
