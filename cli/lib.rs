//! What the two binaries `qpgen` and `qpalgo` share: how a process starts and ends, and what it says while it works.

pub mod exit;
pub mod log;
pub mod memory;
pub mod number;
pub mod print;
pub mod process;
pub mod progress;
pub mod shard_env;
pub mod stop;
