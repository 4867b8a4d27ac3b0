//! Energy and late time.

use std::sync::Arc;

use quadpixel::em::fdtd::{
    Component, CpmlSettings, Domain, Lateral, MaterialMap, Medium, Member, Part, Simulation,
    Source, Wall, YeeGrid, stable_step_um,
};
use rustfft::num_complex::Complex64;

use crate::setup::{OMEGA, bloch, noise, pulse};

/// All values of a component with their cell volumes, at the layers it has.
fn values(sim: &Simulation, component: Component) -> Vec<f64> {
    let grid = sim.grid();
    let mut out = Vec::new();
    for k in 0..grid.nz() {
        for j in 0..grid.ny() {
            let row = sim.row(0, Part::Re, component, j, k).unwrap();
            out.extend(row[..grid.nx()].iter().map(|v| f64::from(*v)));
        }
    }
    out
}

fn magnetic(sim: &Simulation) -> Vec<f64> {
    [Component::Hx, Component::Hy, Component::Hz]
        .into_iter()
        .flat_map(|c| values(sim, c))
        .collect()
}

/// The leapfrog's energy ½ ∫ (ε E·E + H₋·H₊), E between the two H.
fn energy(sim: &mut Simulation) -> f64 {
    let mut electric = Vec::new();
    let grid = sim.grid().clone();
    let (nx, ny) = (grid.nx(), grid.ny());
    let mut volumes = Vec::new();
    for (axis, c) in [Component::Ex, Component::Ey, Component::Ez]
        .into_iter()
        .enumerate()
    {
        for (n, v) in values(sim, c).into_iter().enumerate() {
            let (i, j, k) = (n % nx, n / nx % ny, n / nx / ny);
            let height = if axis == 2 {
                grid.thickness_um(k)
            } else {
                grid.dual_um(k)
            };
            let epsilon = sim.map().media()[sim.map().at(axis, i, j, k)].permittivity();
            electric.push(0.5 * epsilon * v * v * height);
        }
    }
    for axis in 0..3 {
        for n in 0..grid.cells() {
            let k = n / nx / ny;
            volumes.push(if axis == 2 {
                grid.dual_um(k)
            } else {
                grid.thickness_um(k)
            });
        }
    }
    let before = magnetic(sim);
    sim.advance(1);
    let after = magnetic(sim);
    let magnetic: f64 = before
        .iter()
        .zip(&after)
        .zip(&volumes)
        .map(|((a, b), v)| 0.5 * a * b * v)
        .sum();
    electric.iter().sum::<f64>() + magnetic
}

#[test]
fn a_closed_lossless_cavity_keeps_its_energy_on_a_strongly_graded_mesh() {
    // Layers of 40 nm beside layers of 5 nm, glass and silicon scrambled, 0.999 of the stable step. Bound: 20 000 steps
    // of round-off, each at most 2^-24 of the energy: 1.2e-3.
    let mut random = noise(5);
    let mut z = vec![0.0];
    for k in 0..24 {
        let step = if (8..16).contains(&k) { 0.005 } else { 0.04 };
        z.push(z.last().unwrap() + step);
    }
    let grid = YeeGrid::new(6, 5, 0.03, 0.025, z).unwrap();
    let media = vec![
        Medium::VACUUM,
        Medium::new(2.1, 0.0, vec![]).unwrap(),
        Medium::new(16.0, 0.0, vec![]).unwrap(),
    ];
    let mut map = || {
        (0..7 * 6 * 25)
            .map(|_| (3.0 * random()) as u16)
            .collect::<Vec<_>>()
    };
    let map = MaterialMap::new(&grid, media, map(), map(), map()).unwrap();
    let dt = 0.999 * stable_step_um(&grid, &map).unwrap();
    let source = Source {
        plane: 4,
        waveform: pulse(OMEGA, 0.2),
    };
    let wall = Lateral::Mirror(Wall::Electric);
    let member = Member {
        x: wall,
        y: wall,
        current: [1.0, 0.6],
    };
    let closed = CpmlSettings::new(0, 0, [1.0, 1.0]);
    let mut sim = Simulation::new(
        Domain {
            grid,
            map: Arc::new(map),
            cpml: closed,
        },
        &[member],
        source,
        dt,
    )
    .unwrap();
    sim.advance((2.0 / dt) as usize);
    let start = energy(&mut sim);
    assert!(start > 0.0);
    for _ in 0..4 {
        sim.advance(5000);
        let now = energy(&mut sim);
        println!("energy changed by {:.2e}", now / start - 1.0);
        assert!((now / start - 1.0).abs() < 1.2e-3, "{start} {now}");
    }
}

/// Largest |Ex|, |Ey|, |Ez| of both parts.
fn peak(sim: &Simulation) -> f64 {
    let grid = sim.grid();
    let mut peak = 0.0f32;
    for c in [Component::Ex, Component::Ey, Component::Ez] {
        for k in 0..grid.nz() {
            for j in 0..grid.ny() {
                for part in [Part::Re, Part::Im] {
                    for v in sim.row(0, part, c, j, k).into_iter().flatten() {
                        assert!(v.is_finite());
                        peak = peak.max(v.abs());
                    }
                }
            }
        }
    }
    f64::from(peak)
}

#[test]
fn nothing_grows_in_1e5_steps_at_70_deg_in_metal_and_graded_layers() {
    // Walls of a metal with Re ε < 0, of tungsten at 400 nm (3.39 + 2.41i, conductivity) and of a Drude-Lorentz
    // tungsten beside n = 5.6 + 0.3i, all going on into the absorbing layers; the mesh steps from 30 to 4 nm at once.
    // Bound: what rings after 20 000 steps never again exceeds that level, and is below 1e-2 of the first peak at the
    // end.
    let media = vec![
        Medium::VACUUM,
        Medium::from_index(Complex64::new(5.6, 0.3), OMEGA).unwrap(),
        Medium::from_index(Complex64::new(3.39, 2.41), OMEGA).unwrap(),
        Medium::from_permittivity(Complex64::new(-4.0, 9.0), OMEGA).unwrap(),
        Medium::new(
            2.0,
            20.0,
            vec![
                quadpixel::em::fdtd::Pole {
                    strength: 900.0,
                    resonance: 0.0,
                    damping: 0.5,
                },
                quadpixel::em::fdtd::Pole {
                    strength: 600.0,
                    resonance: 9.0,
                    damping: 3.0,
                },
            ],
        )
        .unwrap(),
    ];
    let mut z = vec![0.0];
    for k in 0..32 {
        let step = if k < 16 { 0.004 } else { 0.03 };
        z.push(z.last().unwrap() + step);
    }
    let grid = YeeGrid::new(8, 2, 0.025, 0.025, z).unwrap();
    let column = [3u16, 1, 1, 4, 1, 2, 1, 1, 3];
    let map: Vec<u16> = (0..9 * 3 * 33)
        .map(|n| {
            let (i, k) = (n % 9, n / 27);
            if k < 18 { column[i] } else { 0 }
        })
        .collect();
    let map = MaterialMap::new(&grid, media, map.clone(), map.clone(), map).unwrap();
    let dt = stable_step_um(&grid, &map).unwrap();
    let [x, y] = bloch(&grid, [OMEGA * 70f64.to_radians().sin(), 2.0]);
    let member = Member {
        x,
        y,
        current: [1.0, 1.0],
    };
    let source = Source {
        plane: 23,
        waveform: pulse(OMEGA, 0.3),
    };
    let cpml = CpmlSettings::new(6, 6, [5.6, 1.0]);
    let mut sim = Simulation::new(
        Domain {
            grid,
            map: Arc::new(map),
            cpml,
        },
        &[member],
        source,
        dt,
    )
    .unwrap();
    let mut first = 0.0f64;
    for _ in 0..200 {
        sim.advance(10);
        first = first.max(peak(&sim));
    }
    sim.advance(18_000);
    let mut ringing = 0.0f64;
    for _ in 0..100 {
        sim.advance(17);
        ringing = ringing.max(peak(&sim));
    }
    let mut late = 0.0f64;
    for _ in 0..80 {
        sim.advance(1000);
        late = peak(&sim);
        assert!(late <= 1.01 * ringing, "{late:e} after {ringing:e}");
    }
    println!("first {first:.2e} ringing {ringing:.2e} late {late:.2e}");
    assert!(sim.steps() > 100_000 && late < 1e-2 * first);
}

#[test]
fn a_mirrored_half_gives_the_fields_of_the_whole_period() {
    // A cell that is its own mirror image in y (about j = 0 and j = 4), waves oblique in x. Jx is even in y: magnetic
    // walls; Jy is odd: electric ones. Bound: f32 round-off over 400 steps.
    let nz = 30;
    let z: Vec<f64> = (0..=nz).map(|k| 0.02 * k as f64).collect();
    let whole = YeeGrid::new(6, 8, 0.03, 0.03, z.clone()).unwrap();
    let half = YeeGrid::new(6, 4, 0.03, 0.03, z).unwrap();
    let media = || {
        vec![
            Medium::VACUUM,
            Medium::new(6.0, 1.0, vec![]).unwrap(),
            Medium::from_permittivity(Complex64::new(-3.0, 1.0), OMEGA).unwrap(),
        ]
    };
    let map = |grid: &YeeGrid| {
        let mut maps = [vec![], vec![], vec![]];
        for (axis, map) in maps.iter_mut().enumerate() {
            for k in 0..=nz {
                for j in 0..=grid.ny() {
                    for i in 0..=grid.nx() {
                        let y = j as f64 + if axis == 1 { 0.5 } else { 0.0 };
                        let from_wall = (y - 8.0 * (y / 8.0).round()).abs();
                        let inside = k < 18 && k > 8 && i % 6 != 3;
                        map.push(match inside {
                            true if from_wall < 1.2 => 1u16,
                            true if from_wall > 3.2 => 2,
                            _ => 0,
                        });
                    }
                }
            }
        }
        let [x, y, z] = maps;
        MaterialMap::new(grid, media(), x, y, z).unwrap()
    };
    for (current, wall) in [([1.0, 0.0], Wall::Magnetic), ([0.0, 1.0], Wall::Electric)] {
        let run = |grid: &YeeGrid, y: Lateral| {
            let x = bloch(grid, [8.0, 0.0])[0];
            let source = Source {
                plane: 22,
                waveform: pulse(OMEGA, 0.2),
            };
            let cpml = CpmlSettings::new(6, 5, [1.0, 1.0]);
            let map = map(grid);
            let dt = 0.98 * stable_step_um(grid, &map).unwrap();
            let member = Member { x, y, current };
            let mut sim = Simulation::new(
                Domain {
                    grid: grid.clone(),
                    map: Arc::new(map),
                    cpml,
                },
                &[member],
                source,
                dt,
            )
            .unwrap();
            sim.advance(400);
            sim
        };
        let a = run(&whole, Lateral::Bloch { phase_rad: 0.0 });
        let b = run(&half, Lateral::Mirror(wall));
        let scale = peak(&a);
        let mut compared = 0;
        for part in [Part::Re, Part::Im] {
            for c in [
                Component::Ex,
                Component::Ey,
                Component::Ez,
                Component::Hx,
                Component::Hy,
                Component::Hz,
            ] {
                for k in 0..nz {
                    for j in 0..4 {
                        let rows = [&a, &b].map(|s| s.row(0, part, c, j, k).unwrap());
                        for i in 0..6 {
                            let d = f64::from(rows[0][i] - rows[1][i]).abs();
                            assert!(d < 1e-5 * scale, "{c:?} {part:?} {i} {j} {k}: {rows:?}");
                            compared += 1;
                        }
                    }
                }
            }
        }
        assert!(compared > 0 && scale > 1e-3, "{scale}");
    }
}

#[test]
fn a_step_beyond_the_stable_one_is_refused_with_the_limit() {
    let grid = YeeGrid::new(2, 2, 0.02, 0.02, (0..9).map(|k| 0.02 * k as f64).collect()).unwrap();
    let map = MaterialMap::layered(&grid, vec![Medium::VACUUM], |_| 0).unwrap();
    let limit = stable_step_um(&grid, &map).unwrap();
    // Vacuum on a uniform grid: the Courant limit in closed form.
    assert!((limit - 0.02 / 3f64.sqrt()).abs() < 1e-12, "{limit}");
    let [x, y] = bloch(&grid, [0.0, 0.0]);
    let member = Member {
        x,
        y,
        current: [1.0, 0.0],
    };
    let attempt = |dt, plane, cpml| {
        let source = Source {
            plane,
            waveform: pulse(OMEGA, 0.1),
        };
        Simulation::new(
            Domain {
                grid: grid.clone(),
                map: Arc::new(map.clone()),
                cpml,
            },
            &[member],
            source,
            dt,
        )
        .err()
    };
    let two = CpmlSettings::new(2, 2, [1.0, 1.0]);
    assert!(attempt(limit, 4, two).is_none());
    let e = attempt(1.001 * limit, 4, two).unwrap().to_string();
    assert!(e.contains("dt_um"), "{e}");
    assert!(attempt(limit, 1, two).is_some());
    assert!(attempt(f64::NAN, 4, two).is_some());
    assert!(attempt(limit, 4, CpmlSettings::new(4, 4, [1.0, 1.0])).is_some());
    let other = YeeGrid::new(3, 2, 0.02, 0.02, grid.z_um().to_vec()).unwrap();
    assert!(stable_step_um(&other, &map).is_err());
}
