//! A mosaic of colour filters: the supercell of 2×2 microlenses.

use quadpixel::em::mosaic::{FilterColour, Mosaic};
use quadpixel::em::multilayer::{FlatStack, Polarization};
use quadpixel::em::{Material, PixelStack};
use quadpixel::sensor::Subpixels;

use super::{Light, Powers, RcwaModel, RcwaSettings, all, distance, small, solve, tungsten, walls};

fn constant(n: f64, k: f64) -> Material {
    Material::Constant { n, k }
}

/// The small pixel under filters (n, k) of red, green and blue.
fn coloured([red, green, blue]: [(f64, f64); 3]) -> (PixelStack, RcwaSettings) {
    let (mut stack, settings) = small();
    stack.layers[1].material = constant(green.0, green.1);
    stack.mosaic = Some(Mosaic {
        red: constant(red.0, red.1),
        blue: constant(blue.0, blue.1),
        colour: FilterColour::Green,
    });
    (stack, settings)
}

/// Powers of s and p with P of each photodiode of microlens `i` per light on it.
fn microlens(stack: &PixelStack, answer: &Light, i: usize) -> Vec<f64> {
    let absorbed = |p: &Powers| stack.by_microlens(&p.absorbed)[i].clone();
    [absorbed(answer.s()), absorbed(answer.p())].concat()
}

/// The four microlenses against those of one, to what rounding leaves of some hundred orders.
fn is_one_colour(stack: &PixelStack, settings: &RcwaSettings, [u, v]: [f64; 2], bound: f64) {
    let mut one = stack.clone();
    one.mosaic = None;
    let wanted = solve(&one, settings, u, v);
    let found = solve(stack, settings, u, v);
    for i in 0..4 {
        let off = distance(&microlens(stack, &found, i), &microlens(&one, &wanted, 0));
        assert!(off < bound, "({u}, {v}), microlens {i}: {off:e}");
    }
    let rest = |a: &Light| {
        let of = |p: &Powers| [p.reflected, p.transmitted, p.elsewhere];
        [of(a.s()), of(a.p())].concat()
    };
    assert!(distance(&rest(&found), &rest(&wanted)) < bound);
}

#[test]
fn four_filters_of_one_colour_are_the_period_of_one_microlens() {
    let green = (1.6, 0.02);
    let (mut stack, settings) = coloured([green; 3]);
    for at in [[0.0, 0.0], [0.3, 0.0], [0.2, -0.35]] {
        is_one_colour(&stack, &settings, at, 1e-9);
    }
    stack.lens.shift_um = [0.1, -0.05];
    is_one_colour(&stack, &settings, [0.3, 0.0], 1e-9);
    // An odd number of sub-pixels, whose trenches lie elsewhere.
    stack.lens.shift_um = [0.0, 0.0];
    stack.subpixels = Subpixels::SINGLE;
    is_one_colour(&stack, &settings, [0.0, 0.3], 1e-9);
    stack.subpixels = Subpixels::QUAD;
    stack.metal = Some(walls("oxide", constant(1.2, 0.5)));
    is_one_colour(&stack, &settings, [0.25, 0.0], 1e-9);
}

/// The modes of the filters, not the plane waves that four equal ones are: of first order in the contrast, so 1e-6 of
/// index moves P by less than 1e-5 (k0 d is 4.6).
#[test]
fn filters_that_hardly_differ_are_hardly_felt() {
    let (stack, settings) = coloured([(1.6 + 1e-6, 0.02), (1.6, 0.02), (1.6, 0.02 + 1e-6)]);
    is_one_colour(&stack, &settings, [0.3, 0.0], 1e-5);
}

#[test]
fn energy_is_kept_among_opaque_neighbours() {
    let (stack, settings) = coloured([(1.62, 0.3), (1.6, 0.005), (1.6, 0.6)]);
    for (u, v) in [(0.0, 0.0), (0.35, 0.0), (0.25, 0.3)] {
        let answer = solve(&stack, &settings, u, v);
        for p in [answer.s(), answer.p()] {
            println!("{p:?}");
            assert!((p.balance() - 1.0).abs() < 1e-6, "{}", p.balance());
            assert!(p.absorbed.iter().all(|p| *p >= 0.0));
            assert!(p.elsewhere > 0.0 && p.reflected > 0.0);
            let by_volume = p.absorbed.iter().sum::<f64>();
            assert!((by_volume - p.sum_by_flux()).abs() < 1e-6);
        }
        // The opaque ones get less than the green ones between them.
        let [red, green, _, blue] =
            [0, 1, 2, 3].map(|i| microlens(&stack, &answer, i).iter().sum::<f64>());
        assert!(red < green && blue < red, "{red} {green} {blue}");
    }
}

/// What comes down through the lens and what goes on below the filters are found apart: without loss they are equal.
#[test]
fn unlike_filters_without_loss_lose_nothing() {
    let (mut stack, settings) = coloured([(1.9, 0.0), (1.6, 0.0), (1.4, 0.0)]);
    stack.silicon = constant(4.077, 0.0);
    for [u, v] in [[0.0, 0.0], [0.4, 0.0], [0.3, -0.2]] {
        let answer = solve(&stack, &settings, u, v);
        for p in [answer.s(), answer.p()] {
            assert!((p.reflected + p.transmitted - 1.0).abs() < 1e-8, "{p:?}");
            assert!(p.elsewhere.abs() < 1e-8);
        }
    }
}

/// Along the normal the diagonal of the mosaic is a mirror: it changes the greens, and s and p, for each other. Waves
/// along x and along y do so as well.
#[test]
fn the_diagonal_mirror_changes_the_two_greens_for_each_other() {
    let (stack, settings) = coloured([(1.62, 0.25), (1.6, 0.005), (1.6, 0.1)]);
    // Sub-pixels B, A, D, C: the diagonal changes A and D.
    let swapped = |p: &[f64]| vec![p[0], p[2], p[1], p[3]];
    for (here, there) in [
        ([0.0, 0.0], [0.0, 0.0]),
        ([0.3, 0.0], [0.0, 0.3]),
        ([0.2, 0.1], [0.1, 0.2]),
    ] {
        let a = solve(&stack, &settings, here[0], here[1]);
        let b = solve(&stack, &settings, there[0], there[1]);
        // At the normal s is along y and p along x: the diagonal changes them.
        let of_b = if here == [0.0, 0.0] {
            [b.p(), b.s()]
        } else {
            [b.s(), b.p()]
        };
        for (a, b) in [a.s(), a.p()].into_iter().zip(of_b) {
            let (a, b) = (
                stack.by_microlens(&a.absorbed),
                stack.by_microlens(&b.absorbed),
            );
            for (i, j) in [(0, 0), (1, 2), (2, 1), (3, 3)] {
                let off = distance(&a[i], &swapped(&b[j]));
                assert!(off < 1e-9, "{here:?}, microlens {i}: {off:e}");
            }
        }
    }
}

/// Each microlens is mirrored in its own centre: −u gives the mirror image, and along the normal all sub-pixels of a
/// microlens are alike in the mean of s and p.
#[test]
fn mirrors_go_through_the_centres_of_microlenses() {
    let (stack, settings) = coloured([(1.62, 0.25), (1.6, 0.005), (1.6, 0.1)]);
    let there = solve(&stack, &settings, 0.3, 0.1);
    let back = solve(&stack, &settings, -0.3, 0.1);
    for (a, b) in [(there.s(), back.s()), (there.p(), back.p())] {
        let (a, b) = (
            stack.by_microlens(&a.absorbed),
            stack.by_microlens(&b.absorbed),
        );
        for (a, b) in a.iter().zip(&b) {
            assert!(distance(a, &[b[1], b[0], b[3], b[2]]) < 1e-9);
        }
    }
    let normal = solve(&stack, &settings, 0.0, 0.0);
    for i in 0..4 {
        let both = microlens(&stack, &normal, i);
        let mean: Vec<f64> = (0..4).map(|k| 0.5 * (both[k] + both[k + 4])).collect();
        // A and D, B and C are alike by both mirrors.
        assert!(distance(&mean[..2], &[mean[3], mean[2]]) < 1e-9, "{mean:?}");
    }
}

/// Under a lens of air, without trenches and differences.
#[test]
fn a_flat_mosaic_of_one_colour_is_the_transfer_matrix() {
    let (mut stack, settings) = coloured([(1.6, 0.02); 3]);
    stack.trench_um = 0.0;
    stack.lens.material = constant(1.0, 0.0);
    let one = stack.with_single_filter(FilterColour::Green).unwrap();
    let exact = FlatStack::from_pixel(&one, 550.0).unwrap();
    let answer = solve(&stack, &settings, 0.4, 0.0);
    for (got, polarization) in [(answer.s(), Polarization::S), (answer.p(), Polarization::P)] {
        let want = exact.solve(550.0, 0.4, polarization).unwrap();
        let n = want.entering.len();
        let inside = want.entering[n - 2] - want.entering[n - 1];
        assert!((got.reflected - want.reflected).abs() < 1e-9);
        assert!((got.transmitted - want.transmitted()).abs() < 1e-9);
        for p in &got.absorbed {
            assert!((16.0 * p - inside).abs() < 1e-9);
        }
    }
    assert_eq!(all(&answer).len(), 2 * (16 + 4));
}

#[test]
fn walls_above_the_filters_of_a_mosaic_are_refused() {
    let (mut stack, settings) = coloured([(1.62, 0.25), (1.6, 0.005), (1.6, 0.1)]);
    stack.metal = Some(walls("planarization", tungsten()));
    let e = RcwaModel::new(&stack, 550.0, &settings).err().unwrap();
    assert!(
        e.to_string().contains("metal.layer is `planarization`"),
        "{e}"
    );
}
