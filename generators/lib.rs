//! Randomised charts and scenes, rendered into training data.
//!
//! ```text
//! config ─ draw ─▶ recipe ─ assemble ─▶ camera, scene ─ sample ─▶ images, truths ─ writer ─▶ dataset (datasets_spec)
//! ```
//!
//! A dataset is made by [`dataset::make`], from a configuration whose every field has a default. The library prints
//! nothing: an [`observer`] hears how far it is, and may ask it to stop. Each error tells by `is_input` whether the
//! caller can mend it.
//!
//! ```
//! use quadpixel::effects::Choice;
//! use quadpixel_generators::config::{DEFAULT_TOML, DatasetConfig, Draw, ResponseConfig};
//! use quadpixel_generators::dataset::make;
//! use quadpixel_generators::observer::{Event, Observer};
//!
//! struct Warnings;
//! impl Observer for Warnings {
//!     fn event(&self, event: Event<'_>) {
//!         if let Event::Warning(text) = event {
//!             println!("{text}");
//!         }
//!     }
//! }
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "default")?;
//! config.count = 1;
//! (config.sensor.width, config.sensor.height) = (12, 8);
//! config.sensor.pitch_um = Some(Draw::Fixed(8.0));
//! config.response = ResponseConfig::Geometric;
//! config.scene.texture_px = 64;
//! config.rays_per_pixel = 4;
//! config.effects = Choice::All;
//! # let folder = tempfile::tempdir()?;
//! # let out = folder.path().join("tiny");
//! let made = make(&config, &out, &Warnings)?;
//! assert_eq!(made.samples, 1);
//! assert!(out.join("samples/000000/views.exr").is_file());
//! # Ok(())
//! # }
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
pub mod field_error;
pub mod field_of_view;
pub mod folder_error;
pub mod gallery;
pub mod identity;
pub mod ledger;
pub mod made_table;
pub mod merge;
mod noisy;
pub mod observer;
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
