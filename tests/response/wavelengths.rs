//! Tables of one wavelength each, kept apart and joined.

use std::sync::atomic::{AtomicUsize, Ordering};

use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::wave::WaveSettings;
use quadpixel::response::{AngularResponse, ResponseCache, TablePlan, TableSettings, build_table};

fn settings(wavelengths_nm: &[f64]) -> TableSettings {
    TableSettings {
        model: PixelModel::Wave(WaveSettings {
            bounces: 0,
            tolerance: 2e-3,
            ..WaveSettings::draft()
        }),
        wavelengths_nm: wavelengths_nm.to_vec(),
        cosine_max: 0.4,
        steps: 2,
        refine: 1,
        shifts: None,
    }
}

fn plan(wavelengths_nm: &[f64]) -> TablePlan {
    let plan = TablePlan::new(&stack(), &settings(wavelengths_nm)).unwrap();
    plan.each_wavelength(550.0)
}

fn stack() -> PixelStack {
    PixelStack::paper(1.2, 0.85, 0.85, 0.75)
}

#[test]
fn tables_of_one_wavelength_each_make_the_table_of_all_and_are_used_again() {
    let folder = tempfile::tempdir().unwrap();
    let cache = ResponseCache::open(folder.path());
    let runs = AtomicUsize::new(0);
    let count = |done: usize, total: usize| {
        assert!(done <= total);
        runs.fetch_add(1, Ordering::Relaxed);
    };
    let joined = |nm: &[f64]| {
        let made = cache.table(&plan(nm), &count);
        (made.unwrap().table, runs.swap(0, Ordering::Relaxed))
    };
    let (two, of_two) = joined(&[465.0, 550.0]);
    // 550 nm is kept: one wavelength is left to simulate.
    let (three, of_third) = joined(&[465.0, 550.0, 610.0]);
    assert!(
        of_third > 0 && 2 * of_third == of_two,
        "{of_third} {of_two}"
    );
    assert_eq!(joined(&[465.0, 550.0, 610.0]).1, 0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);

    let whole = build_table(
        &stack(),
        &settings(&[465.0, 550.0, 610.0]),
        None,
        &|_, _| (),
    );
    let whole = whole.unwrap().table;
    assert_eq!(three.axes(), whole.axes());
    assert!(three.table() == whole.table());
    assert!(two.table() == &whole.table()[..two.table().len()]);
    assert_eq!(three.meta().settings, whole.meta().settings);
    // The moving frame is the one of the wavelength named, whatever the order.
    let one = build_table(&stack(), &settings(&[550.0]), None, &|_, _| ()).unwrap();
    assert_eq!(three.meta().frame, one.table.meta().frame);
    assert_ne!(three.meta().key, two.meta().key);
}

#[test]
fn tables_of_other_directions_or_twice_one_wavelength_are_not_joined() {
    let build = |s: &TableSettings| build_table(&stack(), s, None, &|_, _| ()).unwrap().table;
    let a = build(&settings(&[550.0]));
    let finer = TableSettings {
        refine: 2,
        ..settings(&[610.0])
    };
    let refused = |tables: &[AngularResponse]| {
        let joined = AngularResponse::from_wavelengths(tables, 550.0);
        joined.unwrap_err().to_string()
    };
    assert!(refused(&[]).contains("at least one"));
    assert!(refused(&[a.clone(), build(&finer)]).contains("the same in all tables"));
    assert!(refused(&[a.clone(), a]).contains("increasing"));
}
