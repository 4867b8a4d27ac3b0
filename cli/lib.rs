//! What the two binaries `qpgen` and `qpalgo` share: how a process starts and ends.

pub mod process;
