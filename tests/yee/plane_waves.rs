//! Plane waves: the dispersion of the grid, what the absorbing layers send back, slabs of matter.

use quadpixel::em::fdtd::{Component, CpmlSettings, Medium, Pole, YeeGrid};
use rustfft::num_complex::Complex64;

use crate::setup::{Driven, OMEGA, planes, up_and_down};

/// sin θ and the two polarizations: s is Ey, p is Ex, for k∥ along x.
fn k_of(theta_deg: f64) -> [f64; 2] {
    [OMEGA * theta_deg.to_radians().sin(), 0.0]
}

const S: (Component, [f64; 2]) = (Component::Ey, [0.0, 1.0]);
const P: (Component, [f64; 2]) = (Component::Ex, [1.0, 0.0]);

#[test]
fn oblique_waves_follow_yees_dispersion_relation() {
    // Coarse on purpose: eleven cells per wavelength, unequal steps, where kz is 1 % off that of the continuum. For
    // waves up and down in any mixture E(k+1) + E(k−1) = 2 cos(kz dz) E(k). Bound: 2e-6, f32 noise on sums of 72 steps.
    for (theta, azimuth) in [(0.0f64, 0.0f64), (30.0, 20.0), (50.0, 65.0)] {
        let (sin, turn) = (theta.to_radians().sin(), azimuth.to_radians());
        let k = [OMEGA * sin * turn.cos(), OMEGA * sin * turn.sin()];
        for (component, current) in [S, P] {
            let grid = YeeGrid::new(1, 1, 0.06, 0.05, planes(70, 0.05)).unwrap();
            let cpml = CpmlSettings::new(14, 14, [1.0, 1.0]);
            let mut run = Driven::new(
                grid,
                (vec![Medium::VACUUM], &|_| 0),
                k,
                current,
                40,
                cpml,
                150,
            );
            let e = run.amplitudes(component, &[24, 25, 26]);
            let cosine = (e[0] + e[2]) / (2.0 * e[1]);
            let expected = (run.kz(k, 1.0, 0.05) * 0.05).cos();
            let continuum = ((OMEGA * OMEGA - k[0] * k[0] - k[1] * k[1]).sqrt() * 0.05).cos();
            assert!(
                (cosine - expected).norm() < 2e-6,
                "{theta} {cosine} {expected}"
            );
            assert!((expected - continuum).abs() > 1e-4, "too fine to tell");
        }
    }
}

/// Power sent back by the bottom layers.
fn sent_back(
    index: f64,
    dz_um: f64,
    layers: usize,
    theta_deg: f64,
    polarization: (Component, [f64; 2]),
) -> f64 {
    let k = k_of(theta_deg);
    let nz = 2 * layers + 60;
    let grid = YeeGrid::new(1, 1, dz_um, dz_um, planes(nz, dz_um)).unwrap();
    let medium = Medium::new(index * index, 0.0, vec![]).unwrap();
    let cpml = CpmlSettings::new(layers, layers, [index, index]);
    let (component, current) = polarization;
    let mut run = Driven::new(
        grid,
        (vec![medium], &|_| 0),
        k,
        current,
        layers + 50,
        cpml,
        250,
    );
    let at = layers + 20;
    let e = run.amplitudes(component, &[at, at + 1]);
    let kz = run.kz(k, index * index, dz_um);
    let [up, down] = up_and_down([e[0], e[1]], kz, dz_um);
    (up / down).norm_sqr()
}

#[test]
fn absorbing_layers_send_back_little_up_to_70_deg() {
    // In the continuum |r|² = 1e-16^cos θ: 3e-6 at 70°. Stated bounds: 1e-5 at 0 and 40°, 1e-4 at 70°, for 16 layers of
    // 20 nm in air; the energy balance is asked to 1e-2.
    for polarization in [S, P] {
        for (theta, bound) in [(0.0, 1e-5), (40.0, 1e-5), (70.0, 1e-4)] {
            let r = sent_back(1.0, 0.02, 16, theta, polarization);
            println!("air {theta} deg {:?}: {r:.2e}", polarization.0);
            assert!(r < bound, "air {theta} {r:e}");
        }
    }
}

#[test]
fn absorbing_layers_in_silicon_reflect_little_at_all_angles_in_air() {
    for polarization in [S, P] {
        for theta in [0.0, 40.0, 70.0] {
            let r = sent_back(4.0, 0.01, 16, theta, polarization);
            println!("silicon {theta} deg {:?}: {r:.2e}", polarization.0);
            assert!(r < 1e-5, "{theta} {r:e}");
        }
    }
}

/// R and T of a slab in vacuum by Fresnel's coefficients and Airy's sum.
fn airy(epsilon: Complex64, thickness_um: f64, theta_deg: f64, s: bool) -> [f64; 2] {
    let sine = theta_deg.to_radians().sin();
    let outside = Complex64::new(theta_deg.to_radians().cos(), 0.0);
    let inside = (epsilon - sine * sine).sqrt();
    let (a, b) = if s {
        (outside, inside)
    } else {
        (inside, outside * epsilon)
    };
    // r of tangential E for s, of H for p; the powers are the same.
    let r = if s {
        (a - b) / (a + b)
    } else {
        (b - a) / (b + a)
    };
    let p = (Complex64::i() * inside * OMEGA * thickness_um).exp();
    let den = 1.0 - r * r * p * p;
    let reflected = r * (1.0 - p * p) / den;
    let transmitted = (1.0 - r * r) * p / den;
    [reflected.norm_sqr(), transmitted.norm_sqr()]
}

/// R and T of a slab on the grid, its faces on E nodes with the mean of the media there.
fn slab(medium: &Medium, cells: usize, dz_um: f64, theta_deg: f64, s: bool) -> [f64; 2] {
    let k = k_of(theta_deg);
    let face = {
        let poles = medium.poles().iter().map(|p| Pole {
            strength: 0.5 * p.strength,
            ..*p
        });
        Medium::new(
            0.5 * (1.0 + medium.permittivity()),
            0.5 * medium.conductivity(),
            poles.collect(),
        )
        .unwrap()
    };
    let absorbing = (0.2 / dz_um).round() as usize;
    let (low, high) = (absorbing + 12, absorbing + 12 + cells);
    let nz = high + absorbing + 30;
    let grid = YeeGrid::new(1, 1, dz_um, dz_um, planes(nz, dz_um)).unwrap();
    let cpml = CpmlSettings::new(absorbing, absorbing, [1.0, 1.0]);
    let (component, current) = if s { S } else { P };
    // Ez of layer `low` is inside already, Ex and Ey of plane `low` are on the face.
    let mut maps = [vec![], vec![]];
    for k in 0..=nz {
        let plane = u16::from(k >= low && k <= high) + u16::from(k > low && k < high);
        let above = 2 * u16::from(k >= low && k < high);
        maps[0].extend([plane; 4]);
        maps[1].extend([above; 4]);
    }
    let [plane, above] = maps;
    let media = vec![Medium::VACUUM, face, medium.clone()];
    let map =
        quadpixel::em::fdtd::MaterialMap::new(&grid, media, plane.clone(), plane, above).unwrap();
    let mut run = Driven::with_map(grid, map, k, current, high + 20, cpml, 110);
    let e = run.amplitudes(component, &[low - 6, low - 5, high + 8, high + 9]);
    let kz = run.kz(k, 1.0, dz_um);
    let below = up_and_down([e[0], e[1]], kz, dz_um);
    let above = up_and_down([e[2], e[3]], kz, dz_um);
    [
        (above[0] / above[1]).norm_sqr(),
        (below[1] / above[1]).norm_sqr(),
    ]
}

#[test]
fn dispersive_and_conducting_slabs_converge_to_fresnel_at_second_order() {
    // 0.1 µm slabs; steps of 10 and 5 nm. Bound: the error of the fine mesh is below 4e-3 and a quarter (within 35 %)
    // of the coarse one's.
    let pole = |strength, resonance, damping| Pole {
        strength,
        resonance,
        damping,
    };
    let media = [
        (
            "metal",
            Medium::from_permittivity(Complex64::new(-2.0, 0.5), OMEGA).unwrap(),
        ),
        (
            "lorentz",
            Medium::new(
                2.0,
                0.0,
                vec![pole(250.0, 13.0, 1.0), pole(40.0, 20.0, 2.0)],
            )
            .unwrap(),
        ),
        (
            "conductor",
            Medium::from_index(Complex64::new(3.5, 0.3), OMEGA).unwrap(),
        ),
    ];
    for (name, medium) in &media {
        for (theta, s) in [(0.0, true), (50.0, false)] {
            let exact = airy(medium.epsilon(OMEGA), 0.1, theta, s);
            let error = |cells: usize| {
                let found = slab(medium, cells, 0.1 / cells as f64, theta, s);
                [0, 1].map(|i| found[i] - exact[i])
            };
            let (coarse, fine) = (error(10), error(20));
            println!("{name} {theta} s={s}: exact {exact:?} errors {coarse:?} {fine:?}");
            // R and T together: one alone may change its sign between two meshes.
            let size = |e: [f64; 2]| e[0].hypot(e[1]);
            let ratio = size(fine) / size(coarse);
            assert!(size(fine) < 4e-3, "{name} {theta} {s}: {fine:?}");
            assert!(
                (0.16..0.34).contains(&ratio),
                "{name} {theta} {s}: ratio {ratio}"
            );
        }
    }
}
