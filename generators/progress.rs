//! Progress on the terminal: samples, rays per second, time left. On stderr; one line a sample where stderr is no terminal.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar over rays.
pub struct Progress {
    bar: ProgressBar,
    terminal: bool,
    samples: AtomicU64,
    of: AtomicU64,
    began: Instant,
}

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

    /// Counts angles of a response table.
    pub fn angles(&self, done: usize, total: usize) {
        self.bar
            .set_message(format!("angular response {done}/{total}"));
        if !self.terminal && done == total {
            eprintln!(
                "angular response: {total} angles, {:.1} s",
                self.began.elapsed().as_secs_f64()
            );
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
