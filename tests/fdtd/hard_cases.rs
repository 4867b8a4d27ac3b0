//! Small pixels in the cases that break solvers.

use std::f64::consts::PI;

use quadpixel::em::fdtd::FdtdSettings;
use quadpixel::em::{Layer, Material, MetalWalls};

use super::{bloch, both, coarse, holds, run, small};

fn mean(a: f64, b: f64) -> f64 {
    0.5 * (a + b)
}

/// At normal incidence s and p are only names: any φ, approached closely, is the θ = 0 run (which is a quarter of the
/// cell and real). k∥ of 1e-3 moves P by its first order, 1e-3.
#[test]
fn normal_incidence_has_no_azimuth() {
    let stack = small(0.8);
    let straight = run(&stack, [0.0, 0.0], &coarse());
    holds(&straight, 2e-3);
    for phi in [0.0f64, 137.0] {
        let p = phi.to_radians();
        let near = run(&stack, [1e-3 * p.cos(), 1e-3 * p.sin()], &coarse());
        let ([s0, p0], [s1, p1]) = (both(&straight), both(&near));
        for i in 0..4 {
            let d = mean(s1.absorbed[i], p1.absorbed[i]) - mean(s0.absorbed[i], p0.absorbed[i]);
            assert!(d.abs() < 2e-3, "phi {phi}, {i}: {d}");
        }
    }
}

/// Half a cell between mirrors is the whole cell: a lens shift of 1e-9 µm keeps the solver from halving.
#[test]
fn mirrors_change_nothing() {
    let stack = small(0.8);
    let mut whole = stack.clone();
    whole.lens.shift_um[1] = 1e-9;
    let (a, b) = (
        run(&stack, bloch(25.0, 0.0), &coarse()),
        run(&whole, bloch(25.0, 0.0), &coarse()),
    );
    assert_eq!(2 * a.cells[1], b.cells[1]);
    for (a, b) in both(&a).into_iter().zip(both(&b)) {
        assert!((a.reflected - b.reflected).abs() < 2e-4);
        for (a, b) in a.absorbed.iter().zip(&b.absorbed) {
            assert!((a - b).abs() < 2e-4, "{a} {b}");
        }
    }
}

/// Light from the other side lands on the other side.
#[test]
fn opposite_directions_are_mirror_images() {
    let stack = small(0.8);
    let (a, b) = (
        run(&stack, bloch(25.0, 90.0), &coarse()),
        run(&stack, bloch(25.0, 270.0), &coarse()),
    );
    holds(&a, 2e-3);
    // Sub-pixels 0, 1 are those of −y: light towards +y (φ = 90°) favours 2, 3.
    for (a, b) in both(&a).into_iter().zip(both(&b)) {
        assert!(a.absorbed[2] > a.absorbed[0]);
        for i in 0..4 {
            assert!((a.absorbed[i] - b.absorbed[i ^ 2]).abs() < 2e-4);
        }
    }
}

/// |k∥| where an order grazes the surface: sin θ = λ/p − 1 is the place, and 1 % beside it.
#[test]
fn energy_is_kept_near_a_wood_anomaly() {
    let stack = small(0.8);
    let sine = 0.55 / 0.8 - 1.0;
    let settings = FdtdSettings {
        longest_um: 400.0,
        ..coarse()
    };
    for at in [sine, 1.01 * sine] {
        let run = run(&stack, [2.0 * PI / 0.55 * at, 0.0], &settings);
        for p in both(&run) {
            assert!(
                (p.balance() - 1.0).abs() < 0.01 || !run.warnings().is_empty(),
                "{p:?}"
            );
            assert!((p.balance() - 1.0).abs() < 0.03, "{p:?}");
        }
    }
}

#[test]
fn energy_is_kept_at_70_deg_in_an_oblique_plane() {
    holds(&run(&small(0.8), bloch(70.0, 33.0), &coarse()), 2e-3);
}

/// A trench of a fifth of a cell is its area of oxide, no more: P lies by that much below that of plain silicon (oxide
/// 8 % of the silicon's surface at 2 × 10 nm in 0.5 µm; a lossless trench takes its share of the absorber or less).
#[test]
fn a_trench_thinner_than_a_cell_is_a_little_less_silicon() {
    let total = |trench_um| {
        let mut stack = small(0.5);
        stack.trench_um = trench_um;
        let run = run(&stack, bloch(20.0, 0.0), &coarse());
        holds(&run, 2e-3);
        let [s, p] = both(&run);
        mean(s.absorbed.iter().sum(), p.absorbed.iter().sum())
    };
    let (none, thin) = (total(0.0), total(0.01));
    assert!((thin / none - 1.0).abs() < 0.08, "{thin} {none}");
    assert!(thin != none);
}

#[test]
fn layers_of_no_thickness_change_nothing() {
    let stack = small(0.8);
    let mut with = stack.clone();
    with.layers.insert(
        1,
        Layer {
            name: "nothing".into(),
            thickness_um: 0.0,
            material: Material::Constant { n: 3.0, k: 1.0 },
        },
    );
    let (a, b) = (
        run(&stack, [0.0, 0.0], &coarse()),
        run(&with, [0.0, 0.0], &coarse()),
    );
    assert_eq!(a.answers, b.answers);
}

#[test]
fn pixels_of_half_a_micron_and_of_six_keep_energy() {
    holds(&run(&small(0.5), bloch(20.0, 45.0), &coarse()), 2e-3);
    let mut wide = small(6.0);
    wide.lens.radius_um = 12.0;
    wide.lens.height_um = wide.sag_um();
    let settings = FdtdSettings {
        lateral_nm: 150.0,
        cells_per_wavelength: 6.0,
        ..coarse()
    };
    holds(&run(&wide, [0.0, 0.0], &settings), 5e-3);
}

/// A pitch that no cell divides is on the grid all the same.
#[test]
fn a_pitch_off_the_grid_keeps_the_pixels_symmetry() {
    let run = run(&small(0.77), [0.0, 0.0], &coarse());
    holds(&run, 2e-3);
    let [s, p] = both(&run);
    for i in 1..4 {
        assert!((s.absorbed[i] - s.absorbed[0]).abs() < 1e-6);
    }
    // s and p are the same light, turned by 90°.
    assert!((s.absorbed[0] - p.absorbed[0]).abs() < 1e-4);
}

/// Tungsten walls take light that the pixel without them would have used; a wall of Re ε < 0 keeps energy too.
#[test]
fn metal_walls_absorb() {
    let plain = run(&small(0.8), bloch(20.0, 0.0), &coarse());
    for (n, k) in [(3.5, 2.72), (0.3, 2.9)] {
        let mut stack = small(0.8);
        stack.metal = Some(MetalWalls {
            layer: "oxide".into(),
            width_um: 0.1,
            material: Material::Constant { n, k },
        });
        let walls = run(&stack, bloch(20.0, 0.0), &coarse());
        holds(&walls, 2e-3);
        for (w, p) in both(&walls).into_iter().zip(both(&plain)) {
            assert!(w.elsewhere > p.elsewhere);
        }
    }
}
