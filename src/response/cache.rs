//! Tables that were simulated once are kept in a folder, one file a key.

use std::path::{Path, PathBuf};

use super::{AngularResponse, ResponseError, WaveTable, wave_response};
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
    /// The table could not be kept.
    NotKept {
        /// The file.
        path: PathBuf,
        /// Why not.
        why: String,
    },
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
        self.dir.join(format!("wave-{key}.npz"))
    }

    /// The table of a pixel: from the cache, else simulated and kept. Trouble with the cache is no failure; it comes back
    /// as warnings.
    pub fn get_or_build(
        &self,
        stack: &PixelStack,
        table: &WaveTable,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<(AngularResponse, Vec<CacheWarning>), ResponseError> {
        let key = table.key(stack);
        let path = self.path(&key);
        let mut warnings = Vec::new();
        if path.exists() {
            match read(&path, &key) {
                Ok(found) => return Ok((found, warnings)),
                Err(why) => warnings.push(CacheWarning::Rebuilt {
                    path: path.clone(),
                    why,
                }),
            }
        }
        let made = wave_response(stack, table, progress)?;
        let kept = std::fs::create_dir_all(&self.dir)
            .map_err(|e| e.to_string())
            .and_then(|()| made.write_npz(&path).map_err(|e| e.to_string()));
        if let Err(why) = kept {
            warnings.push(CacheWarning::NotKept { path, why });
        }
        Ok((made, warnings))
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
