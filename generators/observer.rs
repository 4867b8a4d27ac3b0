//! Progress of long work, told to whoever calls it, and the caller's wish to stop it. The library itself prints
//! nothing.
//!
//! ```
//! use quadpixel_generators::observer::{Event, Observer};
//!
//! struct Printed;
//! impl Observer for Printed {
//!     fn event(&self, event: Event<'_>) {
//!         if let Event::Warning(text) = event {
//!             println!("{text}");
//!         }
//!     }
//! }
//! Printed.event(Event::Warning("the cache cannot be written to"));
//! ```

use std::path::Path;
use std::time::Duration;

use quadpixel::effects::Decision;
use quadpixel::progress::Progress;

/// What happens during long work.
#[non_exhaustive]
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A run of so many samples and rays begins.
    Start {
        /// Samples, those of an earlier run included.
        samples: usize,
        /// Rays of all of them.
        rays: u64,
    },
    /// So many more rays are done; comes from many threads.
    Rays(u64),
    /// Directions of a response table; comes from many threads.
    Table {
        /// Those that are done.
        done: usize,
        /// All of them.
        total: usize,
    },
    /// How far one long simulation has come, in words.
    Simulation(&'a str),
    /// A sample was there already from an earlier run.
    SampleReused {
        /// The rays that it would have taken.
        rays: u64,
    },
    /// A sample is written.
    SampleDone,
    /// An effect of a sample was simulated or left out.
    Decision {
        /// Which sample.
        sample: &'a str,
        /// The effect, the verdict and its estimate.
        decision: &'a Decision,
    },
    /// Something went wrong that does not stop the work.
    Warning(&'a str),
    /// What is done now.
    Info(&'a str),
    /// A detail of it.
    Detail(&'a str),
    /// The run is over, at its end or before.
    End,
}

/// Hears how long work goes. Events may come from several threads at once.
pub trait Observer: Sync {
    /// Something happened. It should return at once: the work waits for it.
    fn event(&self, event: Event<'_>);

    /// Whether the work is to stop early, asked before each sample; what was written until then stays valid.
    fn stop_asked(&self) -> bool {
        false
    }
}

/// An observer hears of the rays of a render and of the table of a response.
impl Progress for &dyn Observer {
    fn rays(&self, rays: u64) {
        self.event(Event::Rays(rays));
    }

    fn incidences(&self, done: usize, total: usize) {
        self.event(Event::Table { done, total });
    }

    fn waiting(&self, path: &Path, waited: Duration) {
        let seconds = waited.as_secs();
        let file = path.display();
        let text =
            format!("waiting for another process that makes this table, for {seconds} s: {file}");
        self.event(Event::Info(&text));
    }

    fn stop_asked(&self) -> bool {
        Observer::stop_asked(*self)
    }
}

/// Hears nothing and never stops.
impl Observer for () {
    fn event(&self, _: Event<'_>) {}
}
