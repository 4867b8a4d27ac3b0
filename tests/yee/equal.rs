//! The fast stepper gives the plain stepper's bits, whatever the level, the sides, the media and the number of steps in
//! a call.

use std::sync::Arc;

use quadpixel::em::fdtd::{
    Component, CpmlSettings, Domain, Lateral, MaterialMap, Medium, Member, Part, Pole, Simulation,
    Source, Stencil, Wall, YeeGrid, stable_step_um,
};
use quadpixel::simd::SimdLevel;

use crate::setup::{noise, pulse};

const ALL: [Component; 6] = [
    Component::Ex,
    Component::Ey,
    Component::Ez,
    Component::Hx,
    Component::Hy,
    Component::Hz,
];

fn media() -> Vec<Medium> {
    let pole = |strength, resonance, damping| Pole {
        strength,
        resonance,
        damping,
    };
    vec![
        Medium::VACUUM,
        Medium::new(2.1, 0.0, vec![]).unwrap(),
        Medium::new(16.0, 2.5, vec![]).unwrap(),
        Medium::new(1.5, 0.3, vec![pole(900.0, 0.0, 2.0)]).unwrap(),
        Medium::new(
            2.5,
            0.0,
            vec![
                pole(150.0, 20.0, 1.0),
                pole(80.0, 30.0, 0.0),
                pole(20.0, 0.0, 3.0),
            ],
        )
        .unwrap(),
    ]
}

/// A grid of scrambled media, graded, absorbing at both ends.
fn scrambled(nx: usize, ny: usize, members: &[Member]) -> Simulation {
    let nz = 19;
    let mut random = noise(nx as u64 * 31 + ny as u64);
    let mut z = vec![0.0];
    for _ in 0..nz {
        z.push(z.last().unwrap() + 0.01 + 0.03 * random());
    }
    let mut grid = YeeGrid::new(nx, ny, 0.025, 0.02, z).unwrap();
    if nx > 1 && ny > 1 {
        // Some planes and layers with far nodes, some without.
        let mut stencils = |count: usize| -> Vec<[Stencil; 2]> {
            (0..count)
                .map(|k| {
                    [0.025, 0.02].map(|d| Stencil {
                        near: (1.0 + 0.2 * random()) / d,
                        far: if k % 3 == 0 { 0.0 } else { -0.1 * random() / d },
                    })
                })
                .collect()
        };
        let (planes, layers) = (stencils(nz + 1), stencils(nz));
        grid = grid.with_stencils(planes, layers).unwrap();
    }
    let nodes = (nx + 1) * (ny + 1) * (nz + 1);
    let mut map = |polar_from: usize| -> Vec<u16> {
        (0..nodes)
            .map(|at| {
                let kinds = if at < polar_from { 5.0 } else { 3.0 };
                (random() * kinds) as u16
            })
            .collect()
    };
    // Poles in the lower part only, the absorbing layers there included.
    let polar = nodes / 2;
    let (ex, ey, ez) = (map(polar), map(polar), map(polar));
    let map = MaterialMap::new(&grid, media(), ex, ey, ez).unwrap();
    let source = Source {
        plane: 14,
        waveform: pulse(11.0, 0.1),
    };
    let dt = 0.99 * stable_step_um(&grid, &map).unwrap();
    let cpml = CpmlSettings::new(4, 3, [2.0, 1.0]);
    Simulation::new(
        Domain {
            grid,
            map: Arc::new(map),
            cpml,
        },
        members,
        source,
        dt,
    )
    .unwrap()
}

fn assert_equal(a: &Simulation, b: &Simulation, what: &str) {
    let mut nonzero = 0;
    let grid = a.grid();
    for (m, member) in a.members().enumerate() {
        let mirror = [member.x, member.y].map(|side| matches!(side, Lateral::Mirror(_)));
        for part in [Part::Re, Part::Im].into_iter().take(member.sets()) {
            for c in ALL {
                let electric = matches!(c, Component::Ex | Component::Ey | Component::Ez);
                // What `row` promises: E of all nodes, H of those between the sides and on mirrors.
                let wide = match c {
                    Component::Ey | Component::Ez => true,
                    Component::Hx => mirror[0],
                    _ => false,
                };
                let tall = match c {
                    Component::Ex | Component::Ez => true,
                    Component::Hy => mirror[1],
                    _ => false,
                };
                for k in 0..grid.nz() + usize::from(electric) {
                    for j in 0..grid.ny() + usize::from(tall) {
                        let n = grid.nx() + usize::from(wide);
                        let x = &a.row(m, part, c, j, k).unwrap()[..n];
                        let y = &b.row(m, part, c, j, k).unwrap()[..n];
                        for i in 0..n {
                            assert!(
                                x[i].to_bits() == y[i].to_bits() || (x[i] == 0.0 && y[i] == 0.0),
                                "{what}: member {m} {part:?} {c:?} ({i}, {j}, {k}): {} {}",
                                x[i],
                                y[i]
                            );
                            nonzero += usize::from(x[i] != 0.0);
                        }
                    }
                }
            }
        }
    }
    assert!(nonzero > 100, "{what}: the fields stayed zero");
}

#[test]
fn the_fast_stepper_gives_the_bits_of_the_plain_one() {
    let bloch = |phase_rad| Lateral::Bloch { phase_rad };
    let mirror = Lateral::Mirror;
    let member = |x, y, current| Member { x, y, current };
    let batches = [
        vec![
            member(bloch(0.0), bloch(0.0), [1.0, 0.5]),
            member(bloch(1.3), bloch(-0.4), [0.3, 1.0]),
            member(bloch(0.0), bloch(7.0), [0.0, 1.0]),
        ],
        vec![
            member(bloch(0.9), mirror(Wall::Electric), [1.0, 0.7]),
            member(bloch(0.0), mirror(Wall::Magnetic), [1.0, 0.7]),
        ],
        vec![
            member(mirror(Wall::Magnetic), bloch(0.9), [1.0, 0.7]),
            member(mirror(Wall::Electric), bloch(0.0), [1.0, 0.7]),
        ],
        vec![
            member(mirror(Wall::Electric), mirror(Wall::Magnetic), [1.0, 0.7]),
            member(mirror(Wall::Magnetic), mirror(Wall::Magnetic), [1.0, 0.7]),
        ],
    ];
    // Miri takes a thousand times as long.
    let (sizes, calls): (&[_], &[_]) = match cfg!(miri) {
        true => (&[(5, 3), (33, 1)], &[1, 3]),
        false => (
            &[(1, 1), (5, 3), (16, 4), (31, 2), (33, 1)],
            &[1, 2, 3, 19, 7, 28],
        ),
    };
    for members in batches {
        for &(nx, ny) in sizes {
            let mut plain = scrambled(nx, ny, &members);
            plain.advance_plain(calls.iter().sum());
            for level in SimdLevel::ALL {
                let mut fast = scrambled(nx, ny, &members);
                // Calls of many lengths: passes of one to eight steps.
                for &steps in calls {
                    fast.advance_at(steps, level);
                }
                assert_eq!(fast.steps(), plain.steps());
                assert_equal(&fast, &plain, &format!("{nx} x {ny} {level:?} {members:?}"));
            }
        }
    }
}
