//! Real-ray tracing against closed forms, and the packet tracer against the plain one.
#![allow(clippy::unwrap_used)] // tests fail by panicking

mod closed_forms;
mod packets;
mod support;
