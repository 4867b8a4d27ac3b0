//! The programs `qpgen` and `qpalgo`, and what both share: how a process starts and ends, and what it says while it
//! works. The binaries call them, and so does the Python module, so that a wheel holds the library once.

pub mod exit;
pub mod log;
pub mod memory;
pub mod number;
pub mod print;
pub mod process;
pub mod progress;
pub mod qpalgo;
pub mod qpgen;
pub mod shard_env;
pub mod stop;
