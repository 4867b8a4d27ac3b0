//! What all benches of rates share. Each has the same order: the same work across levels (models, SIMD), then sizes,
//! then threads, with the rate of what is worked on (rays, paths, cells, pixels, directions).

use std::time::Duration;

use criterion::Criterion;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// Short runs, so that a whole bench takes a minute or two;
/// `cargo bench --bench NAME -- --sample-size 50 --measurement-time 10` for steadier ones.
pub fn short() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
}

/// A pool of `threads`.
pub fn pool(threads: usize) -> ThreadPool {
    ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap()
}

/// 1, 2, 4 … threads, and as many as the machine runs at once.
#[allow(dead_code)] // because not every bench has work for more than one thread
pub fn thread_counts() -> Vec<usize> {
    let most = std::thread::available_parallelism().map_or(1, usize::from);
    let mut counts: Vec<usize> = (0..).map(|k| 1 << k).take_while(|n| *n < most).collect();
    counts.push(most);
    counts
}
