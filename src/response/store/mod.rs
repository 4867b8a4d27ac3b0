//! Tables on disk: the cache of those simulated, their file format, those that come with the program, and those of
//! other programs.

mod cache;
mod cache_parts;
mod cache_warning;
mod file;
mod import;
mod shipped;

pub use cache::{CachedTable, CachedTables, ResponseCache};
pub use cache_parts::PartOfTable;
pub use cache_warning::CacheWarning;
pub use import::ImportSettings;
