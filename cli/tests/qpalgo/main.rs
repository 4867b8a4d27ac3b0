//! `qpalgo` as a process: its files, messages and exit codes.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod autofocus;
mod bad_input;
mod calibrate_depth;
mod commands;
mod common;
mod correction;
mod dense;
mod depth;
mod disparity_cli;
mod formats;
mod no_truth;
mod on_a_sample;
mod quiet;
mod score;
