//! Tables on disk: the cache of those simulated, their file format, those that come with the program, and those of
//! other programs.

mod cache;
mod file;
mod import;
mod shipped;

pub use cache::{CacheWarning, CachedTable, CachedTables, PartOfTable, ResponseCache};
pub use import::ImportSettings;
