#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod materials;
mod rays;
