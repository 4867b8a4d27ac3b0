#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod light_tree;
mod materials;
mod paths;
mod rays;
