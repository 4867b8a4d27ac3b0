//! The cache of simulated tables.

use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::em::PixelStack;
use quadpixel::response::{CacheWarning, ResponseCache, WaveTable};

fn small() -> (PixelStack, WaveTable) {
    let table = WaveTable {
        steps: 2,
        refine: 1,
        ..WaveTable::draft()
    };
    (PixelStack::builtin("1.6um").unwrap(), table)
}

#[test]
fn second_time_is_read_and_a_corrupt_file_is_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path().join("deep/cache"));
    let (stack, table) = small();
    let simulated = AtomicUsize::new(0);
    let count = |_: usize, _: usize| {
        simulated.fetch_add(1, Ordering::Relaxed);
    };
    let (first, warnings) = cache.get_or_build(&stack, &table, &count).unwrap();
    assert!(warnings.is_empty());
    // 5 × 5 nodes in eighths: (0,0) (1,0) (1,1) (2,0) (2,1) (2,2).
    assert_eq!(simulated.swap(0, Ordering::Relaxed), 6);
    let (second, warnings) = cache.get_or_build(&stack, &table, &count).unwrap();
    assert!(warnings.is_empty() && first == second);
    assert_eq!(simulated.load(Ordering::Relaxed), 0);

    std::fs::write(cache.path(&table.key(&stack)), b"not a table").unwrap();
    let (third, warnings) = cache.get_or_build(&stack, &table, &count).unwrap();
    assert!(
        matches!(warnings[..], [CacheWarning::Rebuilt { .. }]),
        "{warnings:?}"
    );
    assert_eq!(first, third);
    let (_, warnings) = cache.get_or_build(&stack, &table, &count).unwrap();
    assert!(warnings.is_empty());
}

#[test]
fn cache_that_cannot_be_written_is_a_warning_only() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, b"").unwrap();
    let (stack, table) = small();
    let (_, warnings) = ResponseCache::open(&file)
        .get_or_build(&stack, &table, &|_, _| {})
        .unwrap();
    assert!(
        matches!(warnings[..], [CacheWarning::NotKept { .. }]),
        "{warnings:?}"
    );
}

#[test]
fn key_changes_with_pixel_and_settings() {
    let (stack, table) = small();
    let mut other = stack.clone();
    other.lens.shift_um[0] = 0.1;
    let mut finer = table.clone();
    finer.wave.slice_nm *= 0.5;
    assert_ne!(table.key(&stack), table.key(&other));
    assert_ne!(table.key(&stack), finer.key(&stack));
    assert_eq!(table.key(&stack), small().1.key(&small().0));
}

#[test]
fn threads_do_not_change_the_table() {
    let (stack, table) = small();
    let with = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| quadpixel::response::wave_response(&stack, &table, &|_, _| {}).unwrap())
    };
    assert_eq!(with(1), with(3));
}
