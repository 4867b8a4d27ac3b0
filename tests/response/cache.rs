//! The cache of simulated tables.

use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::em::PixelStack;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{Level, PixelModel, Preset};
use quadpixel::response::{
    CacheWarning, ResponseCache, ShiftSettings, TablePlan, TableSettings, build_table,
};
use quadpixel::shard::Shard;

fn small() -> (PixelStack, TableSettings) {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let table = TableSettings {
        steps: 2,
        refine: 1,
        ..TableSettings::new(Level::Wave, Preset::Draft, &stack)
    };
    (stack, table)
}

fn plan(stack: &PixelStack, settings: &TableSettings) -> TablePlan {
    TablePlan::new(stack, settings).unwrap()
}

#[test]
fn second_time_is_read_and_a_corrupt_file_is_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path().join("deep/cache"));
    let (stack, table) = small();
    let simulated = AtomicUsize::new(0);
    // The first call tells that none is done yet.
    let count = |done: usize, _: usize| {
        simulated.fetch_add(usize::from(done > 0), Ordering::Relaxed);
    };
    let first = cache.table(&plan(&stack, &table), &count).unwrap();
    assert!(first.warnings.is_empty());
    // 5 × 5 nodes in eighths: (0,0) (1,0) (1,1) (2,0) (2,1); (2,2) is beyond the horizon.
    assert_eq!(simulated.swap(0, Ordering::Relaxed), 5);
    assert_eq!(first.report.unwrap().runs, 5);
    let second = cache.table(&plan(&stack, &table), &count).unwrap();
    assert!(second.warnings.is_empty() && second.report.is_none());
    assert_eq!(first.table, second.table);
    assert_eq!(simulated.load(Ordering::Relaxed), 0);

    std::fs::write(cache.path(&table.key(&stack).unwrap()), b"not a table").unwrap();
    let third = cache.table(&plan(&stack, &table), &count).unwrap();
    let warnings = third.warnings;
    assert!(
        matches!(warnings[..], [CacheWarning::Rebuilt { .. }]),
        "{warnings:?}"
    );
    assert_eq!(first.table, third.table);
    let fourth = cache.table(&plan(&stack, &table), &count).unwrap();
    assert!(fourth.warnings.is_empty());
    // Nothing but the table is left, and what was set aside.
    let left = std::fs::read_dir(folder.path().join("deep/cache")).unwrap();
    let mut left: Vec<_> = left.map(|entry| entry.unwrap().path()).collect();
    left.sort();
    let path = cache.path(&table.key(&stack).unwrap());
    assert_eq!(left, [path.clone(), path.with_extension("npz.damaged")]);
    assert_eq!(std::fs::read(&left[1]).unwrap(), b"not a table");
}

/// The file with another last value of P, sound as a container: its checksums are those of what it holds.
fn with_a_changed_value(file: &[u8]) -> Vec<u8> {
    use std::io::{Cursor, Read, Write};
    let mut old = zip::ZipArchive::new(Cursor::new(file)).unwrap();
    let mut new = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = zip::write::SimpleFileOptions::default();
    let stored = stored.compression_method(zip::CompressionMethod::Stored);
    for place in 0..old.len() {
        let mut entry = old.by_index(place).unwrap();
        let (name, mut bytes) = (entry.name().to_owned(), Vec::new());
        entry.read_to_end(&mut bytes).unwrap();
        if name == "P.npy" {
            let end = bytes.len();
            bytes[end - 4..].copy_from_slice(&0.123f32.to_le_bytes());
        }
        new.start_file(name, stored).unwrap();
        new.write_all(&bytes).unwrap();
    }
    new.finish().unwrap().into_inner()
}

#[test]
fn a_value_changed_in_a_sound_container_is_no_table_of_ours() {
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path());
    let (stack, table) = small();
    let first = cache.table(&plan(&stack, &table), &()).unwrap().table;
    let path = cache.path(&table.key(&stack).unwrap());
    let changed = with_a_changed_value(&std::fs::read(&path).unwrap());
    std::fs::write(&path, changed).unwrap();
    let again = cache.table(&plan(&stack, &table), &()).unwrap();
    let text = again.warnings.iter().map(ToString::to_string);
    let text = text.collect::<Vec<_>>().join("\n");
    assert!(text.contains("differs from its hash"), "{text}");
    assert_eq!(again.table, first);
}

#[test]
fn cache_that_cannot_be_written_is_a_warning_only() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, b"").unwrap();
    let (stack, table) = small();
    let warnings = ResponseCache::open(&file)
        .table(&plan(&stack, &table), &|_, _| {})
        .unwrap()
        .warnings;
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
    finer.model = PixelModel::Wave(WaveSettings::reference());
    let key = |table: &TableSettings, stack| table.key(stack).unwrap();
    assert_ne!(key(&table, &stack), key(&table, &other));
    assert_ne!(key(&table, &stack), key(&finer, &stack));
    assert_eq!(key(&table, &stack), key(&small().1, &small().0));
}

#[test]
fn threads_do_not_change_the_table() {
    let (stack, table) = small();
    let with = |threads: usize| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| build_table(&stack, &table, None, &|_, _| {}).unwrap().table)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn parts_of_a_table_of_lens_shifts_make_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path());
    let (stack, table) = small();
    let settings = TableSettings {
        cosine_max: 0.6,
        shifts: Some(ShiftSettings {
            per_pitch: 4,
            cone_f_number: 4.0,
        }),
        ..table
    };
    let part = |number| {
        let shard = Shard::new(number, 2).unwrap();
        cache.make_part(&plan(&stack, &settings), shard, &|_, _| {})
    };
    let parts = [part(1).unwrap(), part(2).unwrap()];
    let whole = cache.table(&plan(&stack, &settings), &|_, _| {}).unwrap();
    let report = whole.report.unwrap();
    // Nothing was left to do, and the bits are those of a table made in one go.
    assert_eq!(report.runs, parts[0].runs + parts[1].runs);
    assert_eq!(report.reused, report.runs);
    let at_once = build_table(&stack, &settings, None, &|_, _| {}).unwrap();
    assert_eq!(whole.table, at_once.table);
}
