//! The on-disk contract.
