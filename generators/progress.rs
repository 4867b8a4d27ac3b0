//! Progress on the terminal: samples, rays per second, time left. On stderr; one line a sample where stderr is no terminal.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar over rays.
pub struct Progress {
    bar: ProgressBar,
    terminal: bool,
    samples: AtomicU64,
    of: AtomicU64,
    began: Instant,
    angles: Mutex<Option<Angles>>,
}

/// Pace of a response table.
struct Angles {
    began: Instant,
    from: usize,
    told: Instant,
}

/// How often the angles are told of where stderr is no terminal.
const ANGLES_TOLD_EVERY: Duration = Duration::from_secs(30);

impl Progress {
    /// Draws on stderr.
    pub fn stderr() -> Self {
        Self::with(
            ProgressDrawTarget::stderr(),
            std::io::stderr().is_terminal(),
        )
    }

    /// Draws nothing.
    pub fn hidden() -> Self {
        Self::with(ProgressDrawTarget::hidden(), true)
    }

    fn with(target: ProgressDrawTarget, terminal: bool) -> Self {
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
            bar,
            terminal,
            samples: AtomicU64::new(0),
            of: AtomicU64::new(0),
            began: Instant::now(),
            angles: Mutex::new(None),
        }
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

    /// Counts angles of a response table and tells the time left, by the pace since it was first called. Where stderr is no terminal,
    /// a line every half minute.
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
        if self.terminal {
            return;
        }
        if done == total {
            let seconds = (now - angles.began).as_secs_f64();
            eprintln!("angular response: {total} angles, {seconds:.1} s");
        } else if now - angles.told > ANGLES_TOLD_EVERY {
            angles.told = now;
            eprintln!("{text}{left}");
        }
    }

    /// Counts a finished sample.
    pub fn sample_done(&self) {
        let done = self.samples.fetch_add(1, Ordering::Relaxed) + 1;
        self.show();
        if !self.terminal {
            let (of, seconds) = (
                self.of.load(Ordering::Relaxed),
                self.began.elapsed().as_secs_f64(),
            );
            let rate = self.bar.position() as f64 / seconds * 1e-6;
            eprintln!("sample {done}/{of} · {seconds:.1} s · {rate:.2} M rays/s");
        }
    }

    /// Tells of something that is there already.
    pub fn tell(&self, text: &str) {
        self.bar.suspend(|| eprintln!("{text}"));
    }

    /// Tells of something that did not stop the run.
    pub fn warn(&self, text: &str) {
        self.bar.suspend(|| eprintln!("warning: {text}"));
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
