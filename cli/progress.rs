//! Progress on stderr: samples, rays per second, time left; or the stage that a command is at, and the seconds since
//! its start. One line that goes away on a terminal; one line per sample or stage elsewhere, and for programs.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};
use quadpixel_generators::observer::{Event, Observer};

use crate::log::{Level, Log};
use crate::stop::Stop;

/// A progress bar over rays, or over stages.
pub struct Progress {
    log: Log,
    stop: Stop,
    bar: ProgressBar,
    /// Whether the bar shows it all, so that no lines are needed.
    drawn: bool,
    samples_done: AtomicU64,
    samples: AtomicU64,
    /// Samples that were there already: no part of the pace.
    reused: AtomicU64,
    began: Instant,
    table: Mutex<Option<TablePace>>,
    /// When a simulation was last reported.
    simulation: Mutex<Instant>,
    /// A stage that began too early to be shown yet.
    early: Arc<Mutex<Option<String>>>,
}

/// Pace of a response table.
struct TablePace {
    began: Instant,
    /// Directions that were done when it began.
    first: usize,
    reported: Instant,
}

/// How often tables and simulations are reported where no bar is drawn.
const REPORT_EVERY: Duration = Duration::from_secs(30);

/// Before this no stage is shown.
const PATIENCE: Duration = Duration::from_secs(2);

fn stage_line(log: Log, text: &str, since: Duration) {
    let text = format!("{text} · {:.1} s", since.as_secs_f64());
    log.line(Level::Info, &text, &[]);
}

impl Progress {
    /// Reports on stderr what `log` lets through.
    pub fn new(log: Log) -> Self {
        Self::stopped_by(log, Stop::never())
    }

    /// As [`Self::new`], of work that ends early once `stop` is asked for.
    pub fn stopped_by(log: Log, stop: Stop) -> Self {
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
            stop,
            bar,
            drawn,
            samples_done: AtomicU64::new(0),
            samples: AtomicU64::new(0),
            reused: AtomicU64::new(0),
            began: Instant::now(),
            table: Mutex::new(None),
            simulation: Mutex::new(Instant::now()),
            early: Arc::default(),
        }
    }

    /// Of a command of several stages: reports on stderr at which it is, once it has taken two seconds.
    pub fn stages(log: Log) -> Self {
        let progress = Self::new(log);
        let (bar, drawn) = (progress.bar.clone(), progress.drawn);
        bar.set_draw_target(ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{msg} · {elapsed}") {
            bar.set_style(style);
        }
        if drawn {
            bar.enable_steady_tick(Duration::from_millis(500));
        }
        let early = progress.early.clone();
        // Without the thread (a limit on the memory, say) the first stage is not shown.
        let _ = std::thread::Builder::new().spawn(move || {
            std::thread::sleep(PATIENCE);
            if drawn {
                bar.set_draw_target(ProgressDrawTarget::stderr());
            }
            if let Some(text) = early.lock().unwrap_or_else(PoisonError::into_inner).take() {
                stage_line(log, &text, PATIENCE);
            }
        });
        progress
    }

    /// Reports the stage that begins now.
    pub fn stage(&self, text: impl Into<String>) {
        let (text, since) = (text.into(), self.began.elapsed());
        if self.drawn {
            self.bar.set_message(text);
            return;
        }
        let mut early = self.early.lock().unwrap_or_else(PoisonError::into_inner);
        *early = if since < PATIENCE {
            Some(text)
        } else {
            stage_line(self.log, &text, since);
            None
        };
    }

    /// Reports what did not stop the run.
    pub fn warn(&self, text: &str) {
        self.line(Level::Warn, text);
    }

    /// Reports what is done now.
    pub fn info(&self, text: &str) {
        self.line(Level::Info, text);
    }

    /// Directions of a response table done, of all.
    pub fn table(&self, done: usize, total: usize) {
        self.event(Event::Table { done, total });
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
        *self.early.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    fn line(&self, level: Level, text: &str) {
        self.bar.suspend(|| self.log.line(level, text, &[]));
    }

    /// Shows the time left of a table, by the pace since it was first called. Where no bar is drawn, a line every half
    /// minute.
    fn show_table(&self, done: usize, total: usize) {
        // A poisoned lock only means that another thread stopped.
        let mut pace = self.table.lock().unwrap_or_else(PoisonError::into_inner);
        let now = Instant::now();
        let pace = pace.get_or_insert(TablePace {
            began: now,
            first: done,
            reported: now,
        });
        let fresh = done.saturating_sub(pace.first);
        let left = if fresh > 0 {
            let seconds_each = (now - pace.began).as_secs_f64() / fresh as f64;
            let left = Duration::from_secs_f64(seconds_each * (total - done) as f64);
            format!(" · {} left", HumanDuration(left))
        } else {
            String::new()
        };
        let text = format!("angular response {done}/{total}");
        self.bar.set_message(format!("{text}{left}"));
        if self.drawn {
            return;
        }
        let seconds = (now - pace.began).as_secs_f64();
        let fields = [
            ("event", "angles".into()),
            ("done", done.into()),
            ("of", total.into()),
            ("seconds", seconds.into()),
        ];
        if done == total {
            let text = format!("angular response: {total} angles, {seconds:.1} s");
            self.log.line(Level::Info, &text, &fields);
        } else if now - pace.reported > REPORT_EVERY {
            pace.reported = now;
            let text = format!("{text}{left}");
            self.log.line(Level::Info, &text, &fields);
        }
    }

    /// Where no bar is drawn, a line every half minute.
    fn show_simulation(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        let mut reported = self
            .simulation
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        if !self.drawn && reported.elapsed() > REPORT_EVERY {
            *reported = Instant::now();
            let fields = [("event", "simulation".into())];
            self.log.line(Level::Info, text, &fields);
        }
    }

    fn sample_done(&self) {
        let done = self.samples_done.fetch_add(1, Ordering::Relaxed) + 1;
        self.show_samples();
        if self.drawn {
            return;
        }
        let samples = self.samples.load(Ordering::Relaxed);
        let seconds = self.began.elapsed().as_secs_f64();
        let made = done - self.reused.load(Ordering::Relaxed).min(done);
        let left = seconds / made.max(1) as f64 * samples.saturating_sub(done) as f64;
        let text = format!("sample {done}/{samples} · {seconds:.1} s · {left:.0} s left");
        let fields = [
            ("event", "sample".into()),
            ("done", done.into()),
            ("of", samples.into()),
            ("seconds", seconds.into()),
            ("seconds_left", left.into()),
        ];
        self.log.line(Level::Info, &text, &fields);
    }

    fn show_samples(&self) {
        let done = self.samples_done.load(Ordering::Relaxed);
        let samples = self.samples.load(Ordering::Relaxed);
        self.bar.set_message(format!("sample {done}/{samples}"));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Observer for Progress {
    fn event(&self, event: Event<'_>) {
        if matches!(event, Event::Rays(_) | Event::Table { .. }) && self.stop.is_news() {
            self.warn("asked to stop: ending after the sample in hand; once more ends it at once");
        }
        match event {
            Event::Start { samples, rays } => {
                self.samples.store(samples as u64, Ordering::Relaxed);
                self.bar.set_length(rays);
                self.show_samples();
            }
            Event::Rays(count) => self.bar.inc(count),
            Event::Table { done, total } => self.show_table(done, total),
            Event::Simulation(text) => self.show_simulation(text),
            Event::SampleReused { rays } => {
                self.bar.inc(rays);
                self.samples_done.fetch_add(1, Ordering::Relaxed);
                self.reused.fetch_add(1, Ordering::Relaxed);
                self.show_samples();
            }
            Event::SampleDone => self.sample_done(),
            Event::Decision { sample, decision } => {
                let level = match decision.verdict.is_left_out() {
                    true => Level::Info,
                    false => Level::Debug,
                };
                self.line(level, &format!("{sample}: {decision}"));
            }
            Event::Warning(text) => self.line(Level::Warn, text),
            Event::Info(text) => self.line(Level::Info, text),
            Event::Detail(text) => self.line(Level::Debug, text),
            Event::End => self.finish(),
            // A later version of the library may report more.
            _ => {}
        }
    }

    fn stop_asked(&self) -> bool {
        self.stop.is_asked()
    }
}
