//! Who hears how far long work is. The library prints nothing: a program that wants a bar or a log implements
//! [`Progress`].

use std::path::Path;
use std::time::Duration;

/// Hears of finished work, from any thread. What is not of interest need not be implemented; `()` hears nothing.
pub trait Progress: Sync {
    /// So many more rays of a render have been traced.
    fn rays(&self, rays: u64) {
        let _ = rays;
    }

    /// Another process makes what is wanted, and has this file open; it is waited for since `waited`.
    fn waiting(&self, path: &Path, waited: Duration) {
        let _ = (path, waited);
    }

    /// Whether to stop waiting.
    fn stop_asked(&self) -> bool {
        false
    }

    /// `done` of the `total` incidences of a table of responses have been solved.
    fn incidences(&self, done: usize, total: usize) {
        let _ = (done, total);
    }
}

impl Progress for () {}

/// A function of (done, total) hears of incidences.
impl<F: Fn(usize, usize) + Sync> Progress for F {
    fn incidences(&self, done: usize, total: usize) {
        self(done, total);
    }
}

/// A function that hears of rays.
pub struct OnRays<F>(pub F);

impl<F: Fn(u64) + Sync> Progress for OnRays<F> {
    fn rays(&self, rays: u64) {
        self.0(rays);
    }
}
