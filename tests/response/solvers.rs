//! What every pixel solver holds: a new one joins by a line of [`solvers`].

use quadpixel::em::fdtd::FdtdSettings;
use quadpixel::em::light::{Incidence, Light, PixelSolver, Powers};
use quadpixel::em::multilayer::{FlatStack, Polarization};
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{Level, Material, ModelChoice, PixelModel, PixelStack, Preset};

/// A model, how far its energy may be off, and its P off its mirror image, a batch or a flat stack.
struct Held {
    model: PixelModel,
    energy: f64,
    equal: f64,
    flat: f64,
}

/// One line per solver. The geometric pixel knows no flat stack: it reflects nothing.
fn solvers() -> Vec<Held> {
    let held = |model, energy, equal, flat| Held {
        model,
        energy,
        equal,
        flat,
    };
    let geometric = PixelModel::Geometric {
        focal_length_um: 2.0,
    };
    let corrected = ModelChoice {
        exact: (Level::Rcwa, Preset::Draft, 3),
        ..ModelChoice::new(Level::Corrected, Preset::Reference)
    };
    vec![
        held(geometric, 1e-6, 1e-6, f64::INFINITY),
        // One scalar for s and p on flat layers: exact at normal incidence, 1.5 % at 20 degrees.
        held(
            PixelModel::Wave(WaveSettings::reference()),
            1e-9,
            1e-3,
            1.5e-2,
        ),
        held(PixelModel::Rcwa(RcwaSettings::draft()), 1e-6, 1e-6, 1e-6),
        // The figures of the wave model that it corrects.
        held(corrected.model(), 1e-9, 1e-3, 1.5e-2),
        // The draft's own figures: balance within 1 %, and a mirrored run stops at its own tolerance.
        held(PixelModel::Fdtd(FdtdSettings::draft()), 1e-2, 1e-2, 3e-2),
    ]
}

/// A pixel far smaller than any built-in one keeps all solvers to seconds.
fn tiny() -> PixelStack {
    of_pitch(0.5)
}

fn of_pitch(pitch_um: f64) -> PixelStack {
    let mut stack = PixelStack::paper(pitch_um, 0.4, 0.4, 0.1);
    for layer in &mut stack.layers {
        layer.thickness_um = 0.1;
    }
    stack.silicon_um = 0.3;
    stack.trench_um = 0.05;
    stack
}

/// The same without lens and trenches.
fn flat() -> PixelStack {
    let mut stack = tiny();
    stack.trench_um = 0.0;
    (stack.lens.radius_um, stack.lens.height_um) = (999.0, 0.05);
    stack.lens.material = Material::Constant { n: 1.56, k: 0.0 };
    stack
}

fn one(solver: &dyn PixelSolver, u: f64, v: f64) -> Light {
    solver.on_period(u, v).unwrap()
}

fn off(a: &Powers, b: &[f64]) -> f64 {
    assert_eq!(a.absorbed.len(), b.len());
    let apart = a.absorbed.iter().zip(b).map(|(a, b)| (a - b).abs());
    apart.fold(0.0, f64::max)
}

#[test]
fn energy_is_kept_and_mirrored_light_finds_a_mirrored_pixel() {
    for held in solvers() {
        let solver = held.model.solver(&tiny(), 550.0).unwrap();
        let here = one(solver.as_ref(), 0.3, 0.1);
        let name = held.model.version();
        assert!(
            (here.mean.balance() - 1.0).abs() < held.energy,
            "{name}: {here:?}"
        );
        assert!(here.imbalance.is_finite() && here.residual.is_finite());
        // Sub-pixels C, D, B, A as stored from the row at y = 0: a mirror in x changes the columns.
        let there = one(solver.as_ref(), -0.3, 0.1);
        let p = &here.mean.absorbed;
        let mirrored = [p[1], p[0], p[3], p[2]];
        assert!(
            off(&there.mean, &mirrored) < held.equal,
            "{name}: {here:?} {there:?}"
        );
    }
}

/// Lorentz reciprocity, of the reflected power alone: the specular orders of (u, v) and (−u, −v) swap source and
/// observer, so the mean over both polarizations of what is reflected is the same, however the pixel absorbs. It is all
/// of the reflected light where no other order leaves the pixel, pitch (1 + sin θ) < λ. The shifted lens breaks the
/// mirrors that would say so without reciprocity. Of the geometric pixel, which reflects nothing, it says nothing.
#[test]
fn opposite_light_is_reflected_alike_by_a_pixel_without_mirrors() {
    let mut stack = of_pitch(0.4);
    stack.lens.shift_um = [0.07, 0.03];
    for held in solvers() {
        let solver = held.model.solver(&stack, 550.0).unwrap();
        let [here, there] = [1.0, -1.0].map(|sign| one(solver.as_ref(), sign * 0.25, sign * 0.1));
        let apart = (here.mean.reflected - there.mean.reflected).abs();
        let name = held.model.version();
        // 2e-5 of the wave model, which averages the polarizations at every interface; 5e-6 of the FDTD draft.
        assert!(apart < 1e-4, "{name}: {here:?} {there:?}");
        if !matches!(held.model, PixelModel::Geometric { .. }) {
            // Not by symmetry: what is absorbed where does change.
            assert!(off(&here.mean, &there.mean.absorbed) > 1e-3, "{name}");
        }
    }
}

#[test]
fn a_batch_says_what_single_plane_waves_say() {
    for held in solvers() {
        let name = held.model.version();
        // A pixel without neighbours has no lens shifts but its own.
        let shifts: &[[f64; 2]] = match held.model {
            PixelModel::Geometric { .. } => &[[0.0, 0.0]],
            _ => &[[0.0, 0.0], [0.1, -0.05]],
        };
        let solver = match shifts.len() {
            1 => held.model.solver(&tiny(), 550.0),
            _ => held.model.solver_of_shifts(&tiny(), 550.0),
        };
        let solver = solver.unwrap();
        let wave = |shift_um: &[f64; 2]| Incidence {
            direction: [0.3, 0.1],
            shift_um: *shift_um,
        };
        let waves: Vec<Incidence> = shifts.iter().map(wave).collect();
        let batch = solver.light(&waves, 1, &|_| ()).unwrap();
        assert_eq!(batch.len(), waves.len());
        for (wave, together) in waves.iter().zip(batch) {
            let alone = solver.light(&[*wave], 1, &|_| ()).unwrap();
            let apart = off(&together[0].mean, &alone[0][0].mean.absorbed);
            assert!(apart < held.equal, "{name}: {apart}");
        }
    }
}

#[test]
fn a_flat_stack_absorbs_what_the_transfer_matrix_says() {
    for held in solvers().into_iter().filter(|h| h.flat.is_finite()) {
        let stack = flat();
        let exact = FlatStack::from_pixel(&stack, 550.0).unwrap();
        let solver = held.model.solver(&stack, 550.0).unwrap();
        let sine = f64::to_radians(20.0).sin();
        let found: f64 = one(solver.as_ref(), sine, 0.0).mean.absorbed.iter().sum();
        let wanted = [Polarization::S, Polarization::P].map(|polarization| {
            let powers = exact.solve(550.0, sine, polarization).unwrap();
            let n = powers.entering.len();
            powers.entering[n - 2] - powers.entering[n - 1]
        });
        let wanted = 0.5 * (wanted[0] + wanted[1]);
        let name = held.model.version();
        assert!(
            (found - wanted).abs() < held.flat,
            "{name}: {found} {wanted}"
        );
    }
}
