//! FDTD runs as tables. A pixel far smaller than any built-in one keeps it to seconds; pulses of several wavelengths
//! are held by `response::tabulate`'s own tests.

use quadpixel::em::PixelStack;
use quadpixel::em::fdtd::FdtdSettings;
use quadpixel::em::{Level, PixelModel, Preset};
use quadpixel::response::{TableSettings, build_table};

fn tiny() -> PixelStack {
    let mut stack = PixelStack::paper(0.5, 0.4, 0.4, 0.1);
    for layer in &mut stack.layers {
        layer.thickness_um = 0.1;
    }
    stack.silicon_um = 0.3;
    stack.trench_um = 0.05;
    stack
}

#[test]
fn tables_hold_what_single_runs_say_at_their_nodes() {
    let settings = FdtdSettings {
        tolerance: 1e-2,
        ..FdtdSettings::draft()
    };
    let table = TableSettings {
        model: PixelModel::Fdtd(settings),
        steps: 2,
        refine: 1,
        cosine_max: 0.6,
        ..TableSettings::new(Level::Fdtd, Preset::Draft, &tiny())
    };
    let built = build_table(&tiny(), &table, None, &|_, _| ()).unwrap();
    // (0,0) (1,0) (1,1) (2,0) (2,1) (2,2) of the 5 × 5 nodes; the symmetry gives the others.
    assert_eq!(built.report.runs, 6);
    assert_eq!(built.report.violation(), None);
    let single = table.model.solver(&tiny(), 550.0).unwrap();
    for (iu, iv) in [(2, 2), (1, 4)] {
        let [u, v] = [iu, iv].map(|i: i32| 0.3 * f64::from(i - 2));
        let answer = single.on_microlens(u, v).unwrap();
        let [s, p] = answer.polarized.unwrap();
        let node = built.table.node(0, 0, iv as usize, iu as usize);
        for (i, value) in node.iter().enumerate() {
            let mean = answer.mean.absorbed[i];
            assert!((0.5 * (s.absorbed[i] + p.absorbed[i]) - mean).abs() < 1e-12);
            // The mirrored run meets the same cells in another order, and has stopped at its own tolerance.
            assert!(
                (f64::from(*value) - mean).abs() < 1e-2 * mean.max(0.1),
                "({u}, {v}): {value} and {mean}"
            );
        }
    }
}
