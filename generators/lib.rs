//! `qpgen`: randomised charts and scenes, rendered into training data.
//!
//! ```text
//! config ─ draw ─▶ recipe ─ assemble ─▶ camera, scene ─ sample ─▶ images and truths ─ writer ─▶ dataset (datasets_spec)
//! ```

pub mod assemble;
pub mod charts;
pub mod check_command;
mod coarse;
pub mod config;
pub mod dataset;
mod describe;
pub mod draw;
pub mod export;
pub mod field_of_view;
pub mod gallery;
pub mod lens_command;
mod noisy;
pub mod pixel_model;
pub mod preview;
pub mod progress;
pub mod recipe;
pub mod render_command;
pub mod response_command;
pub mod sample;
mod scene_args;
pub mod scenes;
pub mod stages;
pub mod study;
pub mod validate;
pub mod validate_command;
pub mod writer;
