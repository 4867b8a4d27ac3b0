//! Cameras whose pixels see the pupil in parts: from the scene, through a real lens and the microlenses, into the
//! sub-pixels. Modules stand in the order in which light travels.
//!
//! ```text
//! scene ─ rays ─▶ lens ─ rays ─▶ sensor ─ (u,v) ─▶ response ─ weights ─▶ render ─▶ SubPixelImage
//!                                                    ▲
//!                                     em (pixel stack, wave propagation, RCWA, FDTD)
//! ```
//!
//! Units and frames are those of [`units`] and [`frames`]; every name at a boundary carries its unit. What cannot be is
//! refused by an error that names the field, its value and what is allowed ([`range`]). Results depend neither on the
//! number of threads nor on the processor.
//!
//! # A tour
//!
//! **Trace a lens.** [`lens`] has prescriptions of real lenses, reads yours from JSON or ZMX, and traces rays both
//! ways. A ray that is lost is a value, with its reason.
//!
//! ```
//! use glam::{DVec3, dvec3};
//! use quadpixel::lens::{FocusBy, Lens, Prescription, trace_forward};
//! use quadpixel::rays::Ray;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let lens = Lens::new(&Prescription::builtin("lib_dgauss_50mm")?)?;
//! let focused = lens.with_f_number(4.0)?.focused_at(2000.0, FocusBy::Sensor, 587.6)?;
//! // A point on the axis, 2 m in front of the first vertex, is imaged on the axis.
//! let point = dvec3(0.0, 0.0, -2000.0);
//! let to_the_pupil = (dvec3(0.0, 2.0, 0.0) - point).normalize();
//! let ray = Ray { origin_mm: point, direction: to_the_pupil };
//! let arrived = trace_forward(&focused.at(587.6)?, ray)?;
//! assert!(arrived.origin_mm.truncate().length() < 0.01);
//!
//! // This one is stopped: the error says at which surface.
//! let beside = Ray { direction: (dvec3(0.0, 60.0, 0.0) - point).normalize(), ..ray };
//! assert!(trace_forward(&focused.at(587.6)?, beside).is_err());
//! # Ok(())
//! # }
//! ```
//!
//! **Ask a pixel what it sees.** P(u, v) is the share of the light from direction (u, v) that each sub-pixel absorbs.
//! The geometric pixel is a box per sub-pixel; [`response`] makes tables of real pixels by scalar waves, RCWA or FDTD,
//! and reads them the same way.
//!
//! ```
//! use quadpixel::response::GeometricResponse;
//! use quadpixel::sensor::Subpixels;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let pixel = GeometricResponse::new(Subpixels::new(2, 2)?, 2.8, 7.0)?;
//! let mut absorbed = [0.0; 4];
//! // Light of u > 0 comes from the photographer's right and falls on one of the right sub-pixels;
//! // here, on the upper one.
//! pixel.weights(0.05, -0.05, &mut absorbed);
//! assert_eq!(absorbed, [0.0, 1.0, 0.0, 0.0]);
//! # Ok(())
//! # }
//! ```
//!
//! **Render a chart.** A camera is a focused lens, a sensor, a rule for the microlenses' shifts, a response and
//! wavelengths. [`render::render`] needs a camera, a scene and settings; the builder [`render::Render`] takes the rest.
//!
//! ```
//! use std::sync::Arc;
//!
//! use glam::{DVec2, dvec3};
//! use quadpixel::lens::{FocusBy, Lens, Prescription};
//! use quadpixel::render::{Camera, RenderSettings, render};
//! use quadpixel::response::{GeometricResponse, Response};
//! use quadpixel::scene::texture::Texture;
//! use quadpixel::scene::{Scene, TexturedPlane};
//! use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
//! use quadpixel::spectrum::ChannelWavelengths;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3")?)?;
//! let lens = lens.focused_at(750.0, FocusBy::Sensor, 550.0)?;
//! let pixel = Response::Geometric(GeometricResponse::new(Subpixels::new(2, 2)?, 2.8, 7.0)?);
//! let sensor = Sensor::new(2.8, pixel.subpixels(), (16, 12), DVec2::ZERO)?;
//! let colours = ChannelWavelengths::default();
//! let camera = Camera::new(&lens, sensor, ShiftRule::ChiefRay, &pixel, colours)?;
//!
//! // Vertical bars on a card half a metre away: nearer than the focus, so the views see them apart.
//! let bars = Texture::from_fn(64, 64, |x, _| [if x / 8 % 2 == 0 { 0.9 } else { 0.1 }])?;
//! let card = TexturedPlane::new(
//!     dvec3(0.0, 0.0, -500.0), (100.0, 100.0), (0.0, 0.0, 0.0), Arc::new(bars), None,
//! )?;
//! let scene = Scene::new(vec![card], [0.0; 3]);
//! let shot = render(&camera, &scene, &RenderSettings { rays_per_pixel: 32, seed: 1 });
//!
//! let views: Vec<_> = (0..4).map(|subpixel| shot.image.view(subpixel)).collect();
//! assert_eq!((views[0].width(), views[0].height(), views[0].channels()), (16, 12, 3));
//! assert_ne!(views[0], views[1]);
//! # Ok(())
//! # }
//! ```
//!
//! **Render a world.** Meshes, materials and lights, from glTF, OBJ ([`scene::import`]) or made in place; light is
//! followed from surface to surface.
//!
//! ```
//! use glam::DVec3;
//! use quadpixel::scene::world::{PathKey, PathSettings, World, WorldDescription};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let room = World::new(WorldDescription::cornell_box())?;
//! assert!(room.warnings().lines().is_empty());
//! let (origin, direction) = (DVec3::ZERO, DVec3::NEG_Z);
//! assert!(room.first_hit(origin, direction).is_some_and(|hit| hit.distance_mm > 0.0));
//! let key = |number| PathKey { key: 7, number, spread: 0.0 };
//! let paths = 64;
//! let green: f32 = (0..paths)
//!     .map(|i| room.radiance_along(origin, direction, &PathSettings::default(), &key(i))[1])
//!     .sum();
//! assert!(green / paths as f32 > 0.0);
//! # Ok(())
//! # }
//! ```
//!
//! `Scene::from_world` puts it before a camera. To read a dataset, see the crate `quadpixel-datasets`; to match views
//! and correct a lens's aberrations, `quadpixel-algorithms`; to draw whole datasets from a configuration,
//! `quadpixel-generators`.

pub mod effects;
pub mod em;
pub mod field;
pub mod file;
pub mod frames;
pub mod hash;
pub mod image;
pub mod journal;
pub mod lens;
pub use quadpixel_datasets::memory;
pub mod npy;
mod npz;
pub mod progress;
pub mod range;
pub mod rays;
pub mod render;
pub mod response;
pub mod rgbd;
pub mod sampling;
pub mod scene;
pub mod sensor;
pub mod shard;
pub mod simd;
pub mod spectrum;
pub mod units;

/// The README's example, compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct ReadmeExample;
