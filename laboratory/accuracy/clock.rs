//! Time of a piece of work on a machine that others use too: processor time of this thread, the best of several runs.
//!
//! The work must run on the calling thread (in a pool of one thread, `ThreadPool::install`). What is shared beyond the
//! core (caches, memory, clock rate) still makes runs differ; the best one is nearest to a quiet machine.

use std::time::Instant;

/// A run is repeated until it takes this long, s: the system counts processor time in steps of some milliseconds.
const LEAST_S: f64 = 0.1;

/// Time that this thread was on a CPU, s, where Linux tells it; NaN elsewhere.
pub fn thread_seconds() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok())
        .map_or(f64::NAN, |nanoseconds| 1e-9 * nanoseconds)
}

/// Least processor seconds (where the system does not tell: wall-clock seconds) of `rounds` runs of `work`, and what
/// the last gave.
pub fn best_of<T>(rounds: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let (mut seconds, mut result) = once(&mut work);
    for _ in 1..rounds {
        let (again, last) = once(&mut work);
        (seconds, result) = (seconds.min(again), last);
    }
    (seconds, result)
}

/// Mean seconds of a run, of as many as [`LEAST_S`] asks for, and what the last gave.
fn once<T>(work: &mut impl FnMut() -> T) -> (f64, T) {
    let (wall, processor) = (Instant::now(), thread_seconds());
    let mut runs = 0.0;
    loop {
        let result = work();
        runs += 1.0;
        let processor = thread_seconds() - processor;
        let wall = wall.elapsed().as_secs_f64();
        if wall > LEAST_S {
            let seconds = if processor > 0.0 { processor } else { wall };
            return (seconds / runs, result);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twice_the_work_takes_about_twice_the_time() {
        let work =
            |n: u64| move || (0..n).fold(1u64, |a, i| std::hint::black_box(a.wrapping_mul(a ^ i)));
        let (one, _) = best_of(3, work(4_000_000));
        let (two, _) = best_of(3, work(8_000_000));
        // Wide bounds: the machine may be busy.
        assert!((1.4..2.8).contains(&(two / one)), "{one} {two}");
    }
}
