//! Scenes from files: where things land, what is left out and counted, and that no bytes make the importer panic.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod broken;
#[path = "../fuzz/damage.rs"]
mod damage;
mod glb;
mod gltf;
mod mutations;
mod obj;
mod posed;
