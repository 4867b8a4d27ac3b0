//! Many shifts of the lens solved together are those solved one by one.

use quadpixel::em::light::Light;
use quadpixel::em::rcwa::RcwaModel;
use quadpixel::em::{Material, PixelStack};

use super::{all, distance, small, solve, tungsten, walls};

const SHIFTS_UM: [[f64; 2]; 4] = [[0.0, 0.0], [0.13, -0.31], [0.45, 0.0], [-0.2, 0.6]];

fn together(stack: &PixelStack, [u, v]: [f64; 2], shifts_um: &[[f64; 2]]) -> Vec<Light> {
    let model = RcwaModel::new(stack, 550.0, &small().1).unwrap();
    model.solve_shifts(u, v, shifts_um).unwrap()
}

#[test]
fn shifts_together_are_shifts_one_by_one() {
    let (mut stack, settings) = small();
    for walled in [false, true] {
        if walled {
            stack.metal = Some(walls("oxide", tungsten()));
        }
        for cosines in [[0.3, -0.2], [0.0, 0.0], [0.0, 0.4], [0.6, 0.6]] {
            let found = together(&stack, cosines, &SHIFTS_UM);
            for (answer, shift) in found.iter().zip(SHIFTS_UM) {
                let mut moved = stack.clone();
                moved.lens.shift_um = shift;
                let alone = solve(&moved, &settings, cosines[0], cosines[1]);
                // The same functions: only rounding, the rounds' 1e-9, and the depth's quadrature of the one way lie
                // between.
                let off = distance(&all(answer), &all(&alone));
                assert!(
                    off < 1e-6,
                    "{cosines:?}, {shift:?}, walls {walled}: {off:.1e}"
                );
            }
        }
    }
}

#[test]
fn a_lens_shifted_by_a_pitch_is_the_neighbours() {
    let (stack, _) = small();
    let shifts = [[0.1, -0.2], [1.0, 0.7]];
    let found = together(&stack, [0.3, 0.1], &shifts);
    let off = distance(&all(&found[0]), &all(&found[1]));
    assert!(off < 1e-9, "{off:.1e}");
}

#[test]
fn nothing_is_lost_without_absorption_under_any_shift() {
    let (mut stack, _) = small();
    stack.silicon = Material::Constant { n: 4.077, k: 0.0 };
    stack.filter_layer_mut().unwrap().material = Material::Constant { n: 1.6, k: 0.0 };
    for answer in together(&stack, [0.3, -0.2], &SHIFTS_UM) {
        for p in [answer.s(), answer.p()] {
            assert!((p.reflected + p.transmitted - 1.0).abs() < 1e-7, "{p:?}");
            assert!(p.elsewhere.abs() < 1e-7 && p.sum_by_flux().abs() < 1e-7);
            assert!(p.absorbed.iter().all(|p| p.abs() < 1e-12));
        }
    }
}
