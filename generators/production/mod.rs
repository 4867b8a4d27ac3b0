//! The making of whole datasets: estimated, started, continued, made in parts, merged.
//!
//! [`dataset`] draws, renders and writes sample after sample into a [`run_folder`], whose [`identity`] is the hash of
//! the configuration and of every file that it names. [`merge`] joins the parts of several runs.

pub mod dataset;
pub mod error;
pub mod estimate;
pub mod folder_error;
pub mod identity;
mod line;
pub mod merge;
mod out_folder;
pub mod recipes;
pub mod run_folder;
