//! Tables of shifted lenses against pixels simulated at shifts and directions that the table does not hold.

use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::wave::{WaveModel, WaveSettings};
use quadpixel::response::{
    AngularResponse, ChiefRayShifts, ResponseLookup, ShiftSettings, TableSettings, build_table,
};

fn model() -> WaveSettings {
    WaveSettings {
        bounces: 0,
        tolerance: 2e-3,
        ..WaveSettings::draft()
    }
}

fn settings(per_pitch: usize) -> TableSettings {
    TableSettings {
        model: PixelModel::Wave(model()),
        wavelengths_nm: vec![550.0],
        cosine_max: 0.6,
        steps: 4,
        refine: 1,
        shifts: Some(ShiftSettings {
            per_pitch,
            cone_f_number: 2.0,
        }),
    }
}

fn stack() -> PixelStack {
    PixelStack::paper(1.2, 0.85, 0.85, 0.75)
}

/// P at one of the table's directions, straight from the wave model.
fn simulated(shift_um: [f64; 2], [u, v]: [f64; 2]) -> Vec<f64> {
    let mut stack = stack();
    stack.lens.shift_um = shift_um;
    let model = WaveModel::new(&stack, 550.0, &model()).unwrap();
    model.solve(u, v).unwrap().mean.absorbed
}

#[test]
fn a_lens_shifted_by_a_pitch_is_the_neighbours_lens() {
    let model = WaveModel::new(&stack(), 550.0, &model()).unwrap();
    let shifts = [[0.1, -0.25], [1.3, -1.45]];
    let both = model.solve_shifts(0.2, -0.1, &shifts).unwrap();
    for (p, q) in both[0].mean.absorbed.iter().zip(&both[1].mean.absorbed) {
        assert!((p - q).abs() < 1e-6, "{p} {q}");
    }
}

#[test]
fn the_table_of_shifts_gives_shifts_and_octants_that_were_not_simulated() {
    let table = build_table(&stack(), &settings(12), None, &|_, _| ())
        .unwrap()
        .table;
    let coarse = table.with_fewer_shifts(2).unwrap();
    let lookups = [&table, &coarse].map(|t| t.shifted_interpolator(550.0).unwrap());
    // Between nodes, in several octants, half a pitch out and over the neighbour; at nodes of (u, v), so that only the
    // shift is between.
    let cases = [
        ([0.05, 0.05], [0.0, 0.15]),
        ([-0.17, 0.31], [0.15, -0.3]),
        ([0.23, -0.52], [-0.3, 0.15]),
        ([0.58, 0.27], [0.0, 0.0]),
        ([-0.74, -0.35], [0.3, 0.3]),
    ];
    let (mut worst, mut linear_worst) = (0f64, 0f64);
    for (shift, [u, v]) in cases {
        let truth = simulated(shift, [u, v]);
        let mut p = [0f32; 4];
        lookups[0].weights_batch(shift, &[u as f32], &[v as f32], &mut p);
        let mut linear = [0f64; 4];
        let place = shift.map(|s: f64| (s / 0.1).rem_euclid(12.0));
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let node = [(place[0] as usize + i) % 12, (place[1] as usize + j) % 12];
            let part = |x: f64, i: usize| if i == 1 { x.fract() } else { 1.0 - x.fract() };
            let mut at_node = [0f32; 4];
            let lookup = table.interpolator_at_shift(node, 550.0).unwrap();
            lookup.weights(u as f32, v as f32, &mut at_node);
            for k in 0..4 {
                linear[k] += part(place[0], i) * part(place[1], j) * f64::from(at_node[k]);
            }
        }
        for k in 0..4 {
            worst = worst.max((f64::from(p[k]) - truth[k]).abs());
            linear_worst = linear_worst.max((linear[k] - truth[k]).abs());
        }
    }
    // The spot's spectrum ends near order 2 n pitch / λ = 7; what aliases on 12 nodes is some 1e-3 of it (harmonics of
    // the 1.6 µm pixel beyond the 6th: 0.1 %). Plain linear interpolation is off by h²/8 of curvature, a hundredth.
    assert!(worst < 3e-3, "{worst}");
    assert!(linear_worst > 3.0 * worst, "{linear_worst} {worst}");
    // Half the nodes: a table of its own, whose nodes come back.
    let mut p = [[0f32; 4]; 2];
    for (lookup, p) in lookups.iter().zip(&mut p) {
        lookup.weights_batch([0.2, -0.4], &[0.15], &[0.3], p);
    }
    for k in 0..4 {
        assert!((p[0][k] - p[1][k]).abs() < 2e-3, "{p:?}");
    }
    stays_a_share_of_the_light(&table);
    comes_back_from_a_file(&table);
}

fn stays_a_share_of_the_light(table: &AngularResponse) {
    let lookup = quadpixel::response::Response::Table(table.clone()).at(550.0);
    assert!(matches!(lookup, ResponseLookup::Shifted(_)));
    for i in 0..400 {
        let part = |k: usize| (i * k % 401) as f64 / 200.5 - 1.0;
        let mut p = [0f32; 4];
        let shift = [3.0 * part(83), 3.0 * part(151)];
        lookup.weights_under(
            shift,
            &mut [part(57) as f32],
            &mut [part(211) as f32],
            &mut p,
        );
        let sum: f32 = p.iter().sum();
        assert!(p.iter().all(|p| *p >= 0.0) && sum <= 1.0 + 1e-6, "{p:?}");
    }
}

fn comes_back_from_a_file(table: &AngularResponse) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.npz");
    table.write_npz(&path).unwrap();
    assert_eq!(&AngularResponse::read_npz(&path).unwrap(), table);
    // A grid that does not fit the shifts is refused by name.
    let mut meta = table.meta().clone();
    meta.shift_grid.as_mut().unwrap().per_pitch = 10;
    let wrong = AngularResponse::new(table.axes().clone(), meta, table.table().to_vec());
    assert!(wrong.unwrap_err().to_string().contains("shift_um"));
}

#[test]
fn shifts_found_on_the_table_are_those_found_by_simulation() {
    let table = build_table(&stack(), &settings(12), None, &|_, _| ())
        .unwrap()
        .table;
    let of_table = table.meta().chief_ray_shifts.clone().unwrap();
    let pixel = settings(12)
        .model
        .solver_of_shifts(&stack(), 550.0)
        .unwrap();
    let of_pixel = ChiefRayShifts::for_pixel(pixel.as_ref(), 2.0, &[20.0], 2, &|_, _| ()).unwrap();
    for phi in [0.0, 45.0] {
        let [u, v] = quadpixel::em::light::direction_cosines(20.0, phi);
        let (a, b) = (of_table.at(u, v).shift_um, of_pixel.at(u, v).shift_um);
        let off = (a[0] - b[0]).hypot(a[1] - b[1]);
        // The table's directions are 0.15 apart, as wide as the cone's rings: a few hundredths of the shift.
        assert!(off < 0.1 * a[0].hypot(a[1]), "{phi}: {a:?} {b:?}");
    }
}

#[test]
fn a_geometric_pixel_or_one_shifted_already_has_no_table_of_shifts() {
    let mut geometric = settings(8);
    geometric.model = PixelModel::Geometric {
        focal_length_um: 4.0,
    };
    let e = build_table(&stack(), &geometric, None, &|_, _| ()).unwrap_err();
    assert!(e.to_string().contains("moving frame"), "{e}");
    let mut moved = stack();
    moved.lens.shift_um = [0.1, 0.0];
    let e = build_table(&moved, &settings(8), None, &|_, _| ()).unwrap_err();
    assert!(e.to_string().contains("lens.shift_um"), "{e}");
}
