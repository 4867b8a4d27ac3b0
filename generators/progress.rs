//! Progress on stderr: samples, rays per second, time left. A bar on a terminal; one line a sample elsewhere, and for programs.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::log::{Level, Log};

/// A progress bar over rays.
pub struct Progress {
    log: Log,
    bar: ProgressBar,
    /// Whether the bar tells it all.
    drawn: bool,
    samples: AtomicU64,
    of: AtomicU64,
    /// Samples that were there already: no part of the pace.
    reused: AtomicU64,
    began: Instant,
    angles: Mutex<Option<Angles>>,
    /// When a simulation was last told of.
    simulation: Mutex<Instant>,
}

/// Pace of a response table.
struct Angles {
    began: Instant,
    from: usize,
    told: Instant,
}

/// How often angles and simulations are told of where no bar is drawn.
const TOLD_EVERY: Duration = Duration::from_secs(30);

impl Progress {
    /// Tells on stderr what `log` says of it.
    pub fn new(log: Log) -> Self {
        let drawn = log.says(Level::Info) && !log.json && std::io::stderr().is_terminal();
        let target = if drawn {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(0), target);
        let style =
            ProgressStyle::with_template("{msg} {wide_bar} {percent}% · {per_sec} · {eta} left");
        if let Ok(style) = style {
            bar.set_style(style.with_key(
                "per_sec",
                |state: &indicatif::ProgressState, w: &mut dyn std::fmt::Write| {
                    // A bar that cannot be drawn loses nothing.
                    let _ = write!(w, "{:.2} M rays/s", state.per_sec() * 1e-6);
                },
            ));
        }
        Self {
            log,
            bar,
            drawn,
            samples: AtomicU64::new(0),
            of: AtomicU64::new(0),
            reused: AtomicU64::new(0),
            began: Instant::now(),
            angles: Mutex::new(None),
            simulation: Mutex::new(Instant::now()),
        }
    }

    /// Says everything, for people.
    pub fn stderr() -> Self {
        Self::new(Log::default())
    }

    /// Says nothing but errors.
    pub fn hidden() -> Self {
        Self::new(Log {
            level: Level::Error,
            json: false,
        })
    }

    /// Begins a run.
    pub fn start(&self, samples: usize, rays: u64) {
        self.of.store(samples as u64, Ordering::Relaxed);
        self.bar.set_length(rays);
        self.show();
    }

    /// Counts rays done.
    pub fn rays(&self, n: u64) {
        self.bar.inc(n);
    }

    /// Counts angles of a response table and tells the time left, by the pace since it was first called. Where no bar is drawn, a line
    /// every half minute.
    pub fn angles(&self, done: usize, total: usize) {
        // A poisoned lock only means that another thread stopped.
        let mut angles = self.angles.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let angles = angles.get_or_insert(Angles {
            began: now,
            from: done,
            told: now,
        });
        let fresh = done.saturating_sub(angles.from);
        let left = if fresh > 0 {
            let pace = (now - angles.began).as_secs_f64() / fresh as f64;
            format!(
                " · {} left",
                HumanDuration(Duration::from_secs_f64(pace * (total - done) as f64))
            )
        } else {
            String::new()
        };
        let text = format!("angular response {done}/{total}");
        self.bar.set_message(format!("{text}{left}"));
        if self.drawn {
            return;
        }
        let seconds = (now - angles.began).as_secs_f64();
        let fields = [
            ("event", "angles".into()),
            ("done", done.into()),
            ("of", total.into()),
            ("seconds", seconds.into()),
        ];
        if done == total {
            let text = format!("angular response: {total} angles, {seconds:.1} s");
            self.log.line(Level::Info, &text, &fields);
        } else if now - angles.told > TOLD_EVERY {
            angles.told = now;
            self.log
                .line(Level::Info, &format!("{text}{left}"), &fields);
        }
    }

    /// Tells how far one long simulation has come. Where no bar is drawn, a line every half minute.
    pub fn simulation(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        let mut told = self
            .simulation
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if !self.drawn && told.elapsed() > TOLD_EVERY {
            *told = Instant::now();
            self.log
                .line(Level::Info, text, &[("event", "simulation".into())]);
        }
    }

    /// Counts a sample of an earlier run, which asked for `rays` rays.
    pub fn sample_reused(&self, rays: u64) {
        self.bar.inc(rays);
        self.samples.fetch_add(1, Ordering::Relaxed);
        self.reused.fetch_add(1, Ordering::Relaxed);
        self.show();
    }

    /// Counts a finished sample.
    pub fn sample_done(&self) {
        let done = self.samples.fetch_add(1, Ordering::Relaxed) + 1;
        self.show();
        if self.drawn {
            return;
        }
        let of = self.of.load(Ordering::Relaxed);
        let seconds = self.began.elapsed().as_secs_f64();
        let made = done - self.reused.load(Ordering::Relaxed).min(done);
        let left = seconds / made.max(1) as f64 * of.saturating_sub(done) as f64;
        let text = format!("sample {done}/{of} · {seconds:.1} s · {left:.0} s left");
        let fields = [
            ("event", "sample".into()),
            ("done", done.into()),
            ("of", of.into()),
            ("seconds", seconds.into()),
            ("seconds_left", left.into()),
        ];
        self.log.line(Level::Info, &text, &fields);
    }

    /// Tells of something that did not stop the run.
    pub fn warn(&self, text: &str) {
        self.tell(Level::Warn, text);
    }

    /// Tells what is done.
    pub fn info(&self, text: &str) {
        self.tell(Level::Info, text);
    }

    /// Tells a detail.
    pub fn debug(&self, text: &str) {
        self.tell(Level::Debug, text);
    }

    /// Tells something of a level.
    pub fn tell(&self, level: Level, text: &str) {
        self.bar.suspend(|| self.log.line(level, text, &[]));
    }

    /// Ends the run.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn show(&self) {
        let (done, of) = (
            self.samples.load(Ordering::Relaxed),
            self.of.load(Ordering::Relaxed),
        );
        self.bar.set_message(format!("sample {done}/{of}"));
    }
}
