//! The draw with aberrations: rays displaced by it against waves with the same phases, on a disk.

use glam::DVec2;

use super::{Kernel, PhaseDraw, Wavefront};
use crate::sampling::{SobolSet, concentric_disk};

/// Phase (rad) of a wave over the unit disk, and its gradient.
struct Aberration {
    name: &'static str,
    phase: fn(DVec2) -> f64,
    gradient: fn(DVec2) -> DVec2,
    /// Largest error of the transfer function up to half its cutoff.
    bound: f64,
}

use std::f64::consts::PI;

const ABERRATIONS: [Aberration; 7] = [
    Aberration {
        name: "none",
        phase: |_| 0.0,
        gradient: |_| DVec2::ZERO,
        bound: 0.01,
    },
    Aberration {
        name: "defocus, 1/4 wave",
        phase: |w| 0.5 * PI * w.length_squared(),
        gradient: |w| PI * w,
        bound: 0.1,
    },
    Aberration {
        name: "defocus, 1/2 wave",
        phase: |w| PI * w.length_squared(),
        gradient: |w| 2.0 * PI * w,
        bound: 0.05,
    },
    Aberration {
        name: "defocus, 1 wave",
        phase: |w| 2.0 * PI * w.length_squared(),
        gradient: |w| 4.0 * PI * w,
        bound: 0.08,
    },
    Aberration {
        name: "spherical, balanced, 1/2 wave",
        phase: |w| PI * (w.length_squared().powi(2) - w.length_squared()),
        gradient: |w| PI * (4.0 * w.length_squared() - 2.0) * w,
        bound: 0.05,
    },
    Aberration {
        name: "coma, 1 wave",
        phase: |w| 2.0 * PI * (w.length_squared() - 2.0 / 3.0) * w.x,
        gradient: |w| {
            2.0 * PI * DVec2::new(3.0 * w.x * w.x + w.y * w.y - 2.0 / 3.0, 2.0 * w.x * w.y)
        },
        bound: 0.2,
    },
    Aberration {
        name: "astigmatism, 1/4 wave",
        phase: |w| 0.5 * PI * (w.x * w.x - w.y * w.y),
        gradient: |w| PI * DVec2::new(w.x, -w.y),
        bound: 0.1,
    },
];

/// Overlap of the wave with itself moved by `s`: its transfer function, as a complex number. `defocus`: phase at the
/// edge, rad.
fn waves(aberration: &Aberration, defocus: f64, s: DVec2) -> DVec2 {
    let n = 300;
    let at = |i: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
    let points = (0..n * n).map(|i| DVec2::new(at(i % n), at(i / n)));
    let phase = |w: DVec2| (aberration.phase)(w) + defocus * w.length_squared();
    let (mut sum, mut all) = (DVec2::ZERO, 0.0);
    for w in points {
        all += f64::from(u8::from(w.length_squared() < 1.0));
        let (a, b) = (w + 0.5 * s, w - 0.5 * s);
        if a.length_squared().max(b.length_squared()) < 1.0 {
            sum += DVec2::from_angle(phase(a) - phase(b));
        }
    }
    sum / all
}

/// Waves of defocus added to each aberration.
const BESIDE_WAVES: [f64; 6] = [-1.0, -0.5, -0.25, 0.25, 0.5, 1.0];

#[test]
fn rays_displaced_by_their_place_in_the_pupil_follow_the_waves() {
    const RAYS: usize = 1 << 15;
    let kernel = Kernel::disk();
    let set = SobolSet::new(RAYS);
    let columns = [0, 1, 2, 3, 4].map(|dim| {
        let mut column = vec![0.0; RAYS];
        set.fill(dim, 3, 0, &mut column);
        column
    });
    let place = |i: usize| DVec2::from(concentric_disk(columns[2][i], columns[3][i]));
    // Along x and along y.
    let along = |k: u32| 0.2 * f64::from(k);
    let frequencies = (1..=5).flat_map(|k| [DVec2::new(along(k), 0.0), DVec2::new(0.0, along(k))]);
    let frequencies: Vec<DVec2> = frequencies.collect();
    println!(
        "largest error up to half the cutoff: in focus; and with up to a wave of defocus more and less"
    );
    println!(
        "aberration | rays alone | independent draw | draw by the place in the pupil | by the phases"
    );
    for aberration in &ABERRATIONS {
        let largest_error = |beside: &[f64], displacement: &dyn Fn(usize) -> DVec2| {
            let mut largest = 0f64;
            for waves_of_defocus in beside {
                let defocus = 2.0 * PI * waves_of_defocus;
                let spot = |i| {
                    (aberration.gradient)(place(i)) + 2.0 * defocus * place(i) + displacement(i)
                };
                let spots: Vec<DVec2> = (0..RAYS).map(spot).collect();
                for s in &frequencies {
                    let turns = spots.iter().map(|spot| DVec2::from_angle(spot.dot(*s)));
                    let rays = turns.sum::<DVec2>() / RAYS as f64;
                    largest = largest.max((rays - waves(aberration, defocus, *s)).length());
                }
            }
            largest
        };
        let fit = Wavefront::fit().unwrap();
        let at_points: Vec<f64> = (fit.points().iter())
            .map(|q| (aberration.phase)(*q))
            .collect();
        let front = Wavefront::fitted(1.0, &fit, &at_points);
        let phases = PhaseDraw::new(&kernel, &front).unwrap();
        let draws: [&dyn Fn(usize) -> DVec2; 4] = [
            &|_| DVec2::ZERO,
            &|i| kernel.displacement_at(columns[0][i], columns[1][i]),
            &|i| kernel.displacement(place(i), columns[4][i]),
            // The place of the light is that of the ray, less what it starts beside it.
            &|i| -phases.displacement(place(i), columns[4][i]),
        ];
        let [rays, independent, by_place, by_phases] =
            draws.map(|draw| largest_error(&[0.0], draw));
        let beside = draws.map(|draw| largest_error(&BESIDE_WAVES, draw));
        println!(
            "{} | {rays:.2}; {:.2} | {independent:.2}; {:.2} | {by_place:.2}; {:.2} | {by_phases:.2}; {:.2}",
            aberration.name, beside[0], beside[1], beside[2], beside[3]
        );
        let name = aberration.name;
        assert!(by_place < aberration.bound, "{name}: {by_place}");
        assert!(by_place < rays.max(0.01), "{name}: {by_place} {rays}");
        assert!(by_phases < 0.03, "{name}: {by_phases}");
        assert!(beside[3] < 0.12, "{name}: {beside:?}");
    }
}
