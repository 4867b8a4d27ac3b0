//! `qpgen`: randomised charts and scenes, rendered into training data.
//!
//! ```text
//! config ─ draw ─▶ recipe ─ assemble ─▶ camera, scene ─ sample ─▶ images and truths ─ writer ─▶ dataset (datasets_spec)
//! ```

pub mod assemble;
pub mod card;
pub mod charts;
pub mod config;
pub mod dataset;
pub mod describe;
pub mod draw;
pub mod error;
pub mod estimate;
pub mod export;
pub mod field_of_view;
pub mod folder_error;
pub mod gallery;
pub mod identity;
pub mod made_table;
pub mod merge;
pub mod noisy;
pub mod observer;
pub mod pixel_model;
pub mod planned;
pub mod plot;
pub mod preset;
pub mod preview;
pub mod recipe;
pub mod recipes;
pub mod run_folder;
pub mod sample;
pub mod scenes;
pub mod shifted_table;
pub mod stages;
pub mod writer;
