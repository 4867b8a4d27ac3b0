//! Lens maps against the plain tracer: hard lenses and fields, the edge of the pupil, bits.
#![allow(clippy::unwrap_used)] // tests fail by panicking

mod bits;
mod bounds;
mod support;
