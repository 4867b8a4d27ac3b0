//! The Fourier modal level as a table.

use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::response::{LitPixel, PixelModel, Response, TableSettings, build_table};

use crate::conformance::conforms;

#[test]
fn rcwa_tables_conform_and_hold_what_single_directions_say() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let settings = TableSettings {
        // Few orders: what is held here does not depend on them.
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 0.0,
            lens_cutoff: 1.6,
            ..RcwaSettings::draft()
        }),
        steps: 3,
        refine: 2,
        cosine_max: 0.6,
        ..TableSettings::rcwa_draft()
    };
    let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
    assert_eq!(built.report.runs, 10);
    assert_eq!(built.report.violation(), None);
    assert!(built.report.imbalance.abs() < 1e-6 && built.report.residual < 1e-6);
    let single = LitPixel::new(&stack, &settings.model, 550.0).unwrap();
    // Node (−1, 2) of the simulated grid, of which the symmetry simulated another.
    let answer = single.light(-0.2, 0.4).unwrap();
    let node = built.table.node(0, 0, 6 + 4, 6 - 2);
    for (value, p) in node.iter().zip(&answer.mean.absorbed) {
        assert!((f64::from(*value) - p).abs() < 1e-6, "{value} {p}");
    }
    conforms(&Response::Table(built.table), 550.0, 0.7, 1e-5);
}
