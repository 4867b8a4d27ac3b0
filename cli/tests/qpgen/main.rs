//! `qpgen` as a process: its files, messages and exit codes.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod camera_pictures;
mod closed_pipe;
mod colour;
mod commands;
mod common;
mod convert;
mod dataset_files;
mod dataset_rules;
mod disks;
mod effects;
mod ended;
mod export;
mod fit;
mod fixture;
mod kept_rays;
mod lens;
mod lens_folder;
mod mosaic;
mod noisy;
mod picture_folders;
mod pictures;
mod production;
mod psf;
mod randomised;
mod refusals;
mod response;
mod shared_cache;
mod truth;
mod user_data;
mod worlds;
