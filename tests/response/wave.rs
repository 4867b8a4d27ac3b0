//! Physics of the wave model.

use quadpixel::em::light::Light;
use quadpixel::em::wave::{WaveModel, WaveSettings};
use quadpixel::em::{Layer, Material, PixelStack};
use quadpixel::em::{Level, PixelModel, Preset};
use quadpixel::response::{AngularResponse, Response, TableSettings, build_table};
use quadpixel::sensor::Subpixels;
use rustfft::num_complex::Complex64 as C;

use crate::conformance::conforms;

fn simulated(stack: &PixelStack, settings: &TableSettings) -> AngularResponse {
    build_table(stack, settings, None, &|_, _| {})
        .unwrap()
        .table
}

fn waves(table: &TableSettings) -> WaveSettings {
    match &table.model {
        PixelModel::Wave(settings) => *settings,
        other => panic!("{other:?}"),
    }
}

fn halves(model: &WaveModel, theta_deg: f64) -> (f64, f64) {
    let p = model
        .solve(theta_deg.to_radians().sin(), 0.0)
        .unwrap()
        .mean
        .absorbed;
    (p[0] + p[2], p[1] + p[3])
}

/// Power absorbed in the first `counted_um` of the last medium under flat layers (index, thickness): characteristic
/// matrices (Born & Wolf, 1.6), mean of s and p.
fn transfer_matrix(layers: &[(C, f64)], substrate: C, counted_um: f64, theta_deg: f64) -> f64 {
    let k0 = 2.0 * std::f64::consts::PI / 0.55;
    let sine = theta_deg.to_radians().sin();
    let cosine = |n: C| (C::ONE - (sine / n) * (sine / n)).sqrt();
    let mut mean = 0.0;
    for p in [false, true] {
        let admittance = |n: C| if p { n / cosine(n) } else { n * cosine(n) };
        let (mut e, mut h) = (C::ONE, admittance(substrate));
        for &(n, d) in layers.iter().rev() {
            let phase = k0 * n * cosine(n) * d;
            let y = admittance(n);
            let (c, s) = (phase.cos(), phase.sin());
            (e, h) = (c * e - C::I * s * h / y, c * h - C::I * y * s * e);
        }
        let y0 = admittance(C::ONE);
        // Unit field at the substrate: its flux over the flux that falls in.
        let falls = y0 * (e + h / y0).norm_sqr() / 4.0;
        let enters = admittance(substrate).re / falls.re;
        let decay = (-2.0 * (k0 * substrate * cosine(substrate)).im * counted_um).exp();
        mean += 0.5 * enters * (1.0 - decay);
    }
    mean
}

#[test]
fn flat_slab_absorbs_what_the_transfer_matrix_says_at_0_20_40_deg() {
    let mut stack = PixelStack::paper(1.6, 999.0, 0.05, 0.75);
    stack.trench_um = 0.0;
    let model = WaveModel::new(&stack, 550.0, &WaveSettings::reference()).unwrap();
    let layers = [
        (C::new(1.56, 0.0), 0.55),
        (C::new(1.60, 0.005), 0.75),
        (C::new(1.4599, 0.0), 0.65),
    ];
    for theta in [0.0, 20.0, 40.0] {
        let wanted = transfer_matrix(&layers, C::new(4.077, 0.027968), 4.0, theta);
        let (l, r) = halves(&model, theta);
        println!("{theta} deg: {} and {wanted}", l + r);
        // One scalar for s and p: exact at 0°. At 40° the two differ by a third in what the top surface reflects into
        // the interference, which one amplitude cannot follow on flat layers (a lens blurs it): the stated error there.
        let allowed = [2e-3, 1.5e-2, 7e-2][(theta / 20.0) as usize];
        assert!(
            ((l + r) / wanted - 1.0).abs() < allowed,
            "{theta} deg: {} and {wanted}",
            l + r
        );
    }
}

#[test]
fn any_list_of_flat_layers_absorbs_what_the_transfer_matrix_says() {
    // A lens, a glass plate, an absorber, and a nitride coat on the silicon; one layer of no thickness.
    let mut stack = PixelStack::paper(1.6, 999.0, 0.05, 0.75);
    stack.trench_um = 0.0;
    let n = |n, k| Material::Constant { n, k };
    stack.layers = [
        ("plate", 0.3, n(1.45, 0.0)),
        ("gap", 0.0, n(1.3, 0.0)),
        ("dye", 0.4, n(1.7, 0.02)),
        ("oxide", 0.2, n(1.46, 0.0)),
        ("coat", 0.07, n(2.0, 0.0)),
    ]
    .map(|(name, thickness_um, material)| Layer {
        name: name.into(),
        thickness_um,
        material,
    })
    .to_vec();
    stack.filter = Some("dye".into());
    let model = WaveModel::new(&stack, 550.0, &WaveSettings::reference()).unwrap();
    let layers = [
        (C::new(1.56, 0.0), 0.05),
        (C::new(1.45, 0.0), 0.3),
        (C::new(1.7, 0.02), 0.4),
        (C::new(1.46, 0.0), 0.2),
        (C::new(2.0, 0.0), 0.07),
    ];
    for (theta, allowed) in [(0.0, 2e-3), (20.0, 1.5e-2)] {
        let wanted = transfer_matrix(&layers, C::new(4.077, 0.027968), 4.0, theta);
        let (l, r) = halves(&model, theta);
        assert!(
            ((l + r) / wanted - 1.0).abs() < allowed,
            "{theta} deg: {} and {wanted}",
            l + r
        );
    }
}

#[test]
fn metal_is_refused_by_a_scalar_wave() {
    let stack = PixelStack::builtin("2.8um-tungsten").unwrap();
    let refused = WaveModel::new(&stack, 550.0, &WaveSettings::draft());
    let said = refused.err().unwrap().to_string();
    assert!(said.contains("metal") && said.contains("oxide"), "{said}");
}

#[test]
fn lossless_layers_pass_on_all_light() {
    let mut stack = PixelStack::builtin("1.6um").unwrap();
    stack.filter_layer_mut().unwrap().material = Material::Constant { n: 1.60, k: 0.0 };
    let at = |settings: &WaveSettings| {
        let model = WaveModel::new(&stack, 550.0, settings).unwrap();
        [(0.0, 0.0), (0.2, 0.1), (0.45, 0.0)].map(|(u, v)| model.solve(u, v).unwrap())
    };
    let (rough, fine) = (
        at(&WaveSettings::standard()),
        at(&WaveSettings::reference()),
    );
    // Light lost or found by the slices, before the powers are scaled.
    let rms = |p: &[Light; 3]| (p.iter().map(|p| p.imbalance.powi(2)).sum::<f64>() / 3.0).sqrt();
    println!("imbalance {} and {}", rms(&rough), rms(&fine));
    assert!(rms(&rough) < 0.03 && rms(&fine) < 0.5 * rms(&rough));
    for (rough, fine) in rough.iter().zip(&fine) {
        // Flux above the filter against flux into the trenched silicon, two separate sums.
        println!(
            "lost between lens and silicon {} and {}",
            rough.mean.elsewhere, fine.mean.elsewhere
        );
        assert!(rough.mean.elsewhere.abs() < 1e-2 && fine.mean.elsewhere.abs() < 2e-3);
        assert!((fine.mean.balance() - 1.0).abs() < 1e-12);
    }
}

/// Blue light on a pixel of about a wavelength: with 2.8 slices per wavelength (100 nm) the light reflected and
/// entering was 1.65 of what came, a random test's finding.
#[test]
fn blue_light_in_a_small_lens_is_neither_found_nor_lost() {
    let pitch_um = 0.637_545_739;
    let radius_um = pitch_um * std::f64::consts::FRAC_1_SQRT_2 * 1.354_711_296;
    let stack = PixelStack::paper(pitch_um, radius_um, radius_um, 0.205_126_084);
    for settings in [WaveSettings::draft(), WaveSettings::standard()] {
        let model = WaveModel::new(&stack, 430.856_940_368, &settings).unwrap();
        let imbalance = model.solve(0.0, 0.209_598_088).unwrap().imbalance;
        assert!(imbalance.abs() < 0.2, "{imbalance} of {settings:?}");
    }
}

#[test]
fn thinner_slices_converge_at_least_linearly() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let at = |slice_nm: f64| {
        let settings = WaveSettings {
            slice_nm,
            tolerance: 1e-5,
            bounces: 2,
            ..WaveSettings::standard()
        };
        let model = WaveModel::new(&stack, 550.0, &settings).unwrap();
        [0.0, 7.0, 18.0].map(|t| halves(&model, t).1)
    };
    let (coarse, middle, fine) = (at(80.0), at(40.0), at(12.0));
    let error = |p: &[f64; 3]| {
        p.iter()
            .zip(&fine)
            .map(|(p, f)| (p - f).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    println!("{} {}", error(&coarse), error(&middle));
    assert!(error(&middle) < 0.5 * error(&coarse));
}

#[test]
fn presets_lie_within_their_stated_error_of_the_reference() {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let at = |settings: &WaveSettings| {
        let model = WaveModel::new(&stack, 550.0, settings).unwrap();
        [(0.0, 0.0), (0.1, 0.0), (0.2, 0.1), (0.35, 0.3)]
            .map(|(u, v)| model.solve(u, v).unwrap().mean.absorbed)
    };
    let wanted = at(&WaveSettings::reference());
    for (settings, allowed) in [
        (WaveSettings::draft(), 0.05),
        (WaveSettings::standard(), 0.02),
    ] {
        for (p, q) in at(&settings).iter().zip(&wanted) {
            for (p, q) in p.iter().zip(q) {
                assert!((p - q).abs() < allowed, "{p} and {q}");
            }
        }
    }
}

/// Angles in steps of `step_deg` up to 40° at which left / right lies below 0.2: the first (R_a ends before it), and
/// the width they fill (R_b).
fn ranges_deg(stack: &PixelStack, step_deg: f64) -> (f64, f64) {
    let model = WaveModel::new(stack, 550.0, &WaveSettings::standard()).unwrap();
    let below: Vec<f64> = (0..)
        .map(|i| f64::from(i) * step_deg)
        .take_while(|&t| t <= 40.0)
        .filter(|&t| {
            let (l, r) = halves(&model, t);
            l / r < 0.2
        })
        .collect();
    (below[0], below.len() as f64 * step_deg)
}

#[test]
fn stronger_lens_widens_the_good_range_at_3_5_um() {
    // The paper's figures: R_a 16° and R_b 13° for RoC 3.5 µm, 10° and 18° for RoC 2.48 µm.
    let (a_flat, b_flat) = ranges_deg(&PixelStack::builtin("3.5um-roc3.5").unwrap(), 2.0);
    let (a_best, b_best) = ranges_deg(&PixelStack::builtin("3.5um").unwrap(), 2.0);
    println!("R_a {a_flat:.1} {a_best:.1}, R_b {b_flat:.1} {b_best:.1}");
    assert!(b_best > b_flat + 3.0 && a_best < a_flat - 3.0);
}

#[test]
fn smaller_pixels_mix_their_sub_pixels_up_to_larger_angles() {
    // R_a is 0 in the geometric limit; the same lens shape and filter at three pitches (Fig. 11).
    let at = |pitch: f64| {
        ranges_deg(
            &PixelStack::paper(pitch, pitch * 0.7072, pitch * 0.7072, 0.75),
            1.0,
        )
        .0
    };
    let r_a = [at(1.6), at(2.0), at(2.8)];
    println!("{r_a:?}");
    assert!(r_a[0] > r_a[1] && r_a[1] > r_a[2]);
}

#[test]
fn small_sub_pixels_part_blue_light_better_than_red() {
    // Section 3.2.2: with 0.8 µm sub-pixels the response is worse at 700 nm than at 532 nm, and better at 400 nm.
    let stack = PixelStack::builtin("1.6um").unwrap();
    let contrast = |wavelength_nm: f64| {
        let model = WaveModel::new(&stack, wavelength_nm, &WaveSettings::standard()).unwrap();
        let (mut left, mut right) = (0.0, 0.0);
        for theta in 4..=16 {
            let (l, r) = halves(&model, f64::from(theta));
            left += l;
            right += r;
        }
        left / right
    };
    let ratios = [400.0, 532.0, 700.0].map(contrast);
    println!("{ratios:?}");
    assert!(ratios[0] < ratios[1] && ratios[1] < ratios[2]);
}

#[test]
fn moving_frame_follows_a_shifted_lens() {
    let stack = PixelStack::builtin("2.8um").unwrap();
    let settings = WaveSettings::standard();
    let tiny = TableSettings {
        steps: 2,
        model: PixelModel::Wave(settings),
        ..TableSettings::new(Level::Wave, Preset::Draft, &stack)
    };
    let frame = simulated(&stack, &tiny).frame();
    let centred = WaveModel::new(&stack, 550.0, &settings).unwrap();
    for cra_deg in [10.0f64, 20.0] {
        let chief = cra_deg.to_radians().sin();
        let mut moved = stack.clone();
        moved.lens.shift_um = frame.shift_for_chief_ray(chief, 0.0);
        let model = WaveModel::new(&moved, 550.0, &settings).unwrap();
        let (mut sum, mut unmoved_sum, mut worst, mut count) = (0.0, 0.0, 0.0f64, 0);
        let mut peak = 0.0f64;
        // A cone of F/2 about the chief ray.
        for du in [-0.22, -0.11, 0.0, 0.11, 0.22] {
            for dv in [0.0, 0.15] {
                let (u, v) = (chief + du, dv);
                let truth = model.solve(u, v).unwrap().mean.absorbed;
                let (cu, cv) = frame.centred_uv(u as f32, v as f32, moved.lens.shift_um);
                let ours = centred
                    .solve(f64::from(cu), f64::from(cv))
                    .unwrap()
                    .mean
                    .absorbed;
                let unmoved = centred.solve(u, v).unwrap().mean.absorbed;
                for i in 0..4 {
                    sum += (truth[i] - ours[i]).powi(2);
                    unmoved_sum += (truth[i] - unmoved[i]).powi(2);
                    worst = worst.max((truth[i] - ours[i]).abs());
                    peak = peak.max(truth[i]);
                    count += 1;
                }
            }
        }
        let rms = (sum / f64::from(count)).sqrt() / peak;
        let unmoved = (unmoved_sum / f64::from(count)).sqrt() / peak;
        println!(
            "CRA {cra_deg}: rms {rms:.4} of the peak, worst {:.4}; without moving {unmoved:.4}",
            worst / peak
        );
        // First order: it has to take away most of the shift's effect.
        assert!(rms < 0.35 * unmoved);
    }
}

#[test]
fn wave_tables_conform() {
    for (m, n) in [(2, 2), (2, 1), (1, 2), (3, 3)] {
        let mut stack = PixelStack::builtin("1.6um").unwrap();
        stack.subpixels = Subpixels::new(m, n).unwrap();
        let table = TableSettings {
            steps: 8,
            ..TableSettings::new(Level::Wave, Preset::Draft, &stack)
        };
        let response = simulated(&stack, &table);
        conforms(&Response::Table(response), 550.0, 0.8, 2e-4);
    }
}

#[test]
fn table_follows_the_model_between_its_nodes() {
    // 1.6 µm is the hardest of the built-in pixels: its resonances are the narrowest against the step.
    let stack = PixelStack::builtin("1.6um").unwrap();
    let table = TableSettings::new(Level::Wave, Preset::Standard, &stack);
    let lookup = simulated(&stack, &table).interpolator(550.0);
    let model = WaveModel::new(&stack, 550.0, &waves(&table)).unwrap();
    let (mut sum, mut peak, mut count) = (0.0, 0.0f64, 0.0);
    for i in 0..120 {
        // A golden spiral over the F/1.2 cone.
        let (radius, angle) = (0.4 * (f64::from(i) / 120.0).sqrt(), 2.399963 * f64::from(i));
        let (u, v) = (radius * angle.cos(), radius * angle.sin());
        let mut p = [0.0; 4];
        lookup.weights(u as f32, v as f32, &mut p);
        for (p, q) in p.iter().zip(model.solve(u, v).unwrap().mean.absorbed) {
            sum += (f64::from(*p) - q).powi(2);
            peak = peak.max(q);
            count += 1.0;
        }
    }
    let rms = (sum / count).sqrt() / peak;
    println!("table off by {rms:.4} of the peak (rms)");
    assert!(rms < 0.01);
}

#[test]
fn table_holds_what_the_model_says_at_its_nodes() {
    // A shifted lens, so that no symmetry of the full square may be used; node by node.
    let mut stack = PixelStack::builtin("1.6um").unwrap();
    stack.lens.shift_um = [0.2, 0.0];
    let table = TableSettings {
        steps: 3,
        ..TableSettings::new(Level::Wave, Preset::Draft, &stack)
    };
    let response = simulated(&stack, &table);
    let model = WaveModel::new(&stack, 550.0, &waves(&table)).unwrap();
    let step = 0.8 / 3.0;
    for (iu, iv) in [(0i32, 0i32), (1, 0), (-1, 2), (2, -1), (-2, -2)] {
        let wanted = model
            .solve(f64::from(iu) * step, f64::from(iv) * step)
            .unwrap()
            .mean
            .absorbed;
        let at = |i: i32| ((i + 3) as usize) * table.refine;
        for (p, q) in response.node(0, 0, at(iv), at(iu)).iter().zip(&wanted) {
            // Mirror images are solved to the draft's tolerance, not to the bit.
            assert!(
                (f64::from(*p) - q).abs() < 2e-3,
                "({iu}, {iv}): {p} and {q}"
            );
        }
    }
}
