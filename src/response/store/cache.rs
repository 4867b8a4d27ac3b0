//! Tables that were simulated once are kept in a folder, one file per key; beside them the journals of those not
//! finished.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::cache_warning::CacheWarning;
use crate::journal::JournalError;
use crate::progress::Progress;
use crate::response::tabulate::RunJournal;
use crate::response::{AngularResponse, BuildReport, BuiltTable, ResponseError, TablePlan};

/// A folder of tables.
#[derive(Clone, Debug)]
pub struct ResponseCache {
    pub(super) dir: PathBuf,
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

/// The tables of all colours of a plan (in its order), from the cache or made for it.
#[derive(Debug)]
pub struct CachedTables {
    /// Each, and how it came about, if it was made now.
    pub tables: Vec<TableOfColour>,
    /// What is wrong with the cache.
    pub warnings: Vec<CacheWarning>,
}

/// What one of several tables tells, as a part of all: a wavelength has as many directions as any other.
struct OneOf<'a> {
    progress: &'a dyn Progress,
    number: usize,
    count: usize,
}

impl Progress for OneOf<'_> {
    fn waiting(&self, path: &Path, waited: Duration) {
        self.progress.waiting(path, waited);
    }

    fn stop_asked(&self) -> bool {
        self.progress.stop_asked()
    }

    fn incidences(&self, done: usize, total: usize) {
        (self.progress).incidences(self.number * total + done, self.count * total);
    }
}

impl ResponseCache {
    /// A cache in `dir`, which is made when the first table is kept.
    pub fn open(dir: impl Into<PathBuf>) -> Self {
        Self { dir: dir.into() }
    }

    /// `$QUADPIXEL_CACHE`, else `$XDG_CACHE_HOME/quadpixel`, else `~/.cache/quadpixel`, else a folder for temporary
    /// files.
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

    /// The table of a key, if it was kept.
    ///
    /// # Errors
    /// A file under its name that is something else.
    pub fn get(&self, key: &str) -> Result<Option<AngularResponse>, CacheWarning> {
        let path = self.path(key);
        if !path.exists() {
            return Ok(None);
        }
        match read(&path, key) {
            Ok(table) => Ok(Some(table)),
            Err(why) => Err(CacheWarning::Rebuilt { path, why }),
        }
    }

    /// The table of a plan, if it was kept.
    ///
    /// # Errors
    /// A file under its name that is something else.
    pub fn find(&self, plan: &TablePlan) -> Result<Option<AngularResponse>, CacheWarning> {
        let wrong = |e: ResponseError| CacheWarning::Rebuilt {
            path: self.dir.clone(),
            why: e.to_string(),
        };
        let Some((reference_nm, plans)) = plan.parted() else {
            return self.get(&plan.key().map_err(wrong)?);
        };
        let mut tables = Vec::with_capacity(plans.len());
        for one in &plans {
            match self.get(&one.key().map_err(wrong)?)? {
                Some(table) => tables.push(table),
                None => return Ok(None),
            }
        }
        joined(tables, reference_nm).map(Some).map_err(wrong)
    }

    /// The table of a plan: from the cache, else simulated and kept. A build that was stopped goes on where it was, and
    /// parts of it made by [`Self::make_part`] are used. Trouble with the cache is no failure; it comes back as
    /// warnings.
    ///
    /// # Errors
    /// A pixel that the model has no answer for.
    pub fn table(
        &self,
        plan: &TablePlan,
        progress: &dyn Progress,
    ) -> Result<CachedTable, ResponseError> {
        let CachedTables { tables, warnings } = self.tables(plan, progress)?;
        let (table, report) = plan.of_colour(tables)?;
        Ok(CachedTable {
            table,
            report,
            warnings,
        })
    }

    /// [`Self::table`] of each colour of the plan: those of a mosaic are simulated and kept together.
    ///
    /// # Errors
    /// As there.
    pub fn tables(
        &self,
        plan: &TablePlan,
        progress: &dyn Progress,
    ) -> Result<CachedTables, ResponseError> {
        let Some((reference_nm, plans)) = plan.parted() else {
            return self.together(plan, progress);
        };
        let mut warnings = Vec::new();
        let mut by_colour = vec![Vec::with_capacity(plans.len()); plan.colours().len()];
        for (i, one) in plans.iter().enumerate() {
            let part = OneOf {
                progress,
                number: i,
                count: plans.len(),
            };
            let made = self.together(one, &part)?;
            warnings.extend(made.warnings);
            for (tables, (table, _)) in by_colour.iter_mut().zip(made.tables) {
                tables.push(table);
            }
        }
        let join = |tables| Ok((joined(tables, reference_nm)?, None));
        let tables = by_colour.into_iter().map(join);
        Ok(CachedTables {
            tables: tables.collect::<Result<_, ResponseError>>()?,
            warnings,
        })
    }

    /// The tables of a plan whose wavelengths are kept in one file.
    fn together(
        &self,
        plan: &TablePlan,
        progress: &dyn Progress,
    ) -> Result<CachedTables, ResponseError> {
        let mut warnings = Vec::new();
        if let Some(tables) = self.all_colours(plan, &mut warnings)? {
            return Ok(CachedTables { tables, warnings });
        }
        let key = plan.simulation_key()?;
        let folder = std::fs::create_dir_all(&self.dir);
        let path = self.dir.join(format!("{key}.journal"));
        let opened = (folder.is_ok()).then(|| RunJournal::open(&path, &key, progress));
        let (mut journal, no_journal) = match opened.transpose() {
            Ok(journal) => (journal, None),
            Err(JournalError::Stopped { path }) => return Err(ResponseError::Stopped { path }),
            Err(e) => (None, Some(e.to_string())),
        };
        if let Some(open) = &mut journal {
            // Another process may have made the tables while this one waited for the journal.
            if let Some(tables) = self.all_colours(plan, &mut Vec::new())? {
                let trouble = journal.and_then(RunJournal::remove);
                warnings.extend(trouble.map(CacheWarning::NoJournal));
                return Ok(CachedTables { tables, warnings });
            }
            for part in self.parts(&key) {
                open.join(&part, &key);
            }
            let damaged = open
                .damaged()
                .map(|(path, count)| CacheWarning::DamagedResults {
                    path: path.to_owned(),
                    count,
                });
            warnings.extend(damaged);
        }
        let mut built = plan.build_with(journal.as_ref(), progress)?;
        for BuiltTable { table, .. } in &built {
            let path = self.path(&table.meta().key);
            let made = folder.as_ref().map_err(ToString::to_string);
            let written = made.and_then(|()| table.write_npz(&path).map_err(|e| e.to_string()));
            if let Err(why) = written {
                warnings.push(CacheWarning::NotKept { path, why });
            }
        }
        // Only now: a process that waits for the journal finds the tables.
        let trouble = no_journal.or(journal.and_then(RunJournal::remove));
        for built in &mut built {
            built.report.journal_trouble.clone_from(&trouble);
        }
        warnings.extend(trouble.map(CacheWarning::NoJournal));
        let tables = built.into_iter().map(|b| (b.table, Some(b.report)));
        Ok(CachedTables {
            tables: tables.collect(),
            warnings,
        })
    }

    /// The kept tables of all colours, if none is missing.
    fn all_colours(
        &self,
        plan: &TablePlan,
        warnings: &mut Vec<CacheWarning>,
    ) -> Result<Option<Vec<TableOfColour>>, ResponseError> {
        let mut tables = Vec::new();
        for colour in plan.colours() {
            match self.get(&plan.with_colour(colour).key()?) {
                Ok(table) => tables.extend(table.map(|table| (table, None))),
                Err(warning) => {
                    if let CacheWarning::Rebuilt { path, .. } = &warning {
                        // Set aside, for who wants to know; one that stays is replaced.
                        let _ = std::fs::rename(path, path.with_extension("npz.damaged"));
                    }
                    warnings.push(warning);
                }
            }
        }
        Ok((tables.len() == plan.colours().len()).then_some(tables))
    }
}

/// A table and, if it was made just now, the report of its making.
type TableOfColour = (AngularResponse, Option<BuildReport>);

/// The table of all wavelengths of these.
fn joined(
    mut tables: Vec<AngularResponse>,
    reference_nm: f64,
) -> Result<AngularResponse, ResponseError> {
    match tables.len() {
        1 => Ok(tables.swap_remove(0)),
        _ => AngularResponse::from_wavelengths(&tables, reference_nm),
    }
}

fn read(path: &Path, key: &str) -> Result<AngularResponse, String> {
    let table = AngularResponse::read_kept(path).map_err(|e| e.to_string())?;
    if table.meta().key == key {
        Ok(table)
    } else {
        Err(format!("its key is {}", table.meta().key))
    }
}
