//! The Fourier modal level as a table.

use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::response::{LitPixel, PixelModel, Response, TableSettings, build_table};

use crate::conformance::conforms;

#[test]
fn rcwa_tables_conform_and_hold_what_single_directions_say() {
    let mut stack = PixelStack::paper(0.9, 0.7, 0.7, 0.4);
    stack.silicon_um = 1.0;
    let settings = TableSettings {
        model: PixelModel::Rcwa(RcwaSettings {
            silicon_margin: 1.0,
            ..RcwaSettings::draft()
        }),
        steps: 4,
        refine: 2,
        ..TableSettings::rcwa_draft()
    };
    let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
    assert_eq!(built.report.violation(), None);
    assert!(built.report.imbalance.abs() < 1e-6 && built.report.residual < 1e-6);
    let single = LitPixel::new(&stack, &settings.model, 550.0).unwrap();
    // Node (−1, 2) of the simulated grid, of which the symmetry simulated another.
    let answer = single.light(-0.2, 0.4).unwrap();
    let node = built.table.node(0, 0, 8 + 4, 8 - 2);
    for (value, p) in node.iter().zip(&answer.mean.absorbed) {
        assert!((f64::from(*value) - p).abs() < 1e-6, "{value} {p}");
    }
    conforms(&Response::Table(built.table), 550.0, 0.5, 1e-5);
}
