//! `qpgen`: randomised charts and scenes, rendered into training data.
//!
//! ```text
//! config ─ draw ─▶ recipe ─ assemble ─▶ camera, scene ─ sample ─▶ images and truths ─ writer ─▶ dataset (datasets_spec)
//! ```

pub mod accuracy;
pub mod assemble;
pub mod card;
pub mod charts;
pub mod check_command;
mod coarse;
pub mod config;
pub mod dataset;
pub mod dataset_command;
mod describe;
pub mod draw;
pub mod estimate;
pub mod export;
pub mod field_of_view;
pub mod gallery;
pub mod identity;
pub mod lens_command;
pub mod log;
pub mod merge;
mod noisy;
pub mod pixel_model;
mod planned;
pub mod plot;
pub mod preset;
pub mod preview;
pub mod preview_command;
pub mod progress;
pub mod recipe;
mod recipes;
pub mod render_command;
pub mod response_command;
pub mod run_folder;
pub mod sample;
mod scene_args;
pub mod scenes;
pub mod shard_args;
mod shifted_table;
pub mod stages;
pub mod stop;
pub mod study;
pub mod validate;
pub mod validate_command;
pub mod writer;
