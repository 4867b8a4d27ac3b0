//! Randomised charts and scenes, rendered into training data.
//!
//! ```text
//! config ─ draw ─▶ recipe ─ assemble ─▶ camera, scene ─ sample ─▶ images, truths ─ writer ─▶ dataset (datasets_spec)
//!                          ▲                     ▲                         │
//!                   charts, scenes        production: runs, parts    card, preview, plot
//! ```
//!
//! A dataset is made by [`production::dataset::make`], from a configuration whose every field has a default. The
//! library prints nothing: an [`observer`] hears how far it is, and may ask it to stop. Each error tells by `is_input`
//! whether the caller can mend it.
//!
//! ```
//! use quadpixel::effects::Choice;
//! use quadpixel_generators::config::{DEFAULT_TOML, DatasetConfig, Draw, ResponseConfig};
//! use quadpixel_generators::production::dataset::make;
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
//! config.response = ResponseConfig::Ideal;
//! config.scene.texture_px = 64;
//! config.rays_per_pixel = Some(4);
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
pub mod bank;
pub mod camera_file;
pub mod card;
pub mod charts;
pub mod config;
pub mod describe;
pub mod draw;
pub mod export;
pub mod field_error;
pub mod ledger;
mod lens_tracing;
pub mod observer;
pub mod plot;
pub mod preview;
pub mod production;
pub mod recipe;
pub mod rgbd;
pub mod sample;
pub mod scenes;
pub mod writer;
