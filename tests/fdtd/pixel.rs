//! The paper's 1.6 µm pixel against an independent vector solution (Fourier modal method; `tests/response/reference`).

use quadpixel::em::PixelStack;

use super::{coarse, holds, run};

/// At θ = 0, where a quarter of the cell is enough. The reference: 0.37703 of the light in each half. The bound of the
/// draft preset, 6 %, on a mesh coarser than it. All angles and presets:
/// `cargo bench -p quadpixel-laboratory --bench fdtd_accuracy -- curve 1.6 draft`.
#[test]
fn the_pixel_absorbs_what_the_vector_solution_says_at_normal_incidence() {
    let stack = PixelStack::paper(1.6, 1.1314, 1.1314, 0.75);
    let run = run(&stack, [0.0, 0.0], &coarse());
    holds(&run, 5e-3);
    let s = &run.answers[0].s().absorbed;
    assert!(((s[0] + s[2]) / 0.37703 - 1.0).abs() < 0.06, "{s:?}");
}
