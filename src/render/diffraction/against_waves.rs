//! The draw with aberrations: rays displaced by it against waves with the same phases, on a disk.

use glam::DVec2;

use super::Kernel;
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

/// Overlap of the wave with itself moved by `s`: its transfer function, as a complex number.
fn waves(phase: fn(DVec2) -> f64, s: DVec2) -> DVec2 {
    let n = 300;
    let at = |i: usize| 2.0 * (i as f64 + 0.5) / n as f64 - 1.0;
    let points = (0..n * n).map(|i| DVec2::new(at(i % n), at(i / n)));
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
    let frequencies: Vec<DVec2> = (1..=10)
        .map(|k| DVec2::new(0.1 * f64::from(k), 0.0))
        .collect();
    println!("aberration | rays alone | independent draw | draw by the place in the pupil");
    for aberration in &ABERRATIONS {
        let exact: Vec<DVec2> = frequencies
            .iter()
            .map(|&s| waves(aberration.phase, s))
            .collect();
        let largest_error = |displacement: &dyn Fn(usize) -> DVec2| {
            let spots: Vec<DVec2> = (0..RAYS)
                .map(|i| (aberration.gradient)(place(i)) + displacement(i))
                .collect();
            let errors = frequencies.iter().zip(&exact).map(|(s, exact)| {
                let sum: DVec2 = spots
                    .iter()
                    .map(|spot| DVec2::from_angle(spot.dot(*s)))
                    .sum();
                (sum / RAYS as f64 - *exact).length()
            });
            errors.fold(0.0, f64::max)
        };
        let rays = largest_error(&|_| DVec2::ZERO);
        let independent = largest_error(&|i| kernel.displacement_at(columns[0][i], columns[1][i]));
        let draw = largest_error(&|i| kernel.displacement(place(i), columns[4][i]));
        println!(
            "{} | {rays:.2} | {independent:.2} | {draw:.2}",
            aberration.name
        );
        assert!(draw < aberration.bound, "{}: {draw}", aberration.name);
        assert!(draw < rays.max(0.01), "{}: {draw} {rays}", aberration.name);
    }
}
