//! Displacements against the autocorrelation of the aperture: the mean of exp(i κ·s) over the diffraction pattern of a
//! region is the part of the region that it shares with itself moved by s (the optical transfer function).

use super::*;
use crate::lens::{FocusBy, Lens, Prescription};
use crate::rays::Ray;
use crate::sampling::SobolSet;

const SAMPLES: usize = 1 << 17;

/// Mean of cos(κ·s) over the displacements κ of points spread evenly over a region within ±`half` of the origin.
fn transfer(
    inside: impl Fn(DVec2) -> bool,
    half: f64,
    displacement: impl Fn(usize, DVec2, f64) -> DVec2,
    s: DVec2,
) -> f64 {
    let set = SobolSet::new(SAMPLES);
    let columns = [2, 3, 4].map(|dim| {
        let mut column = vec![0.0; SAMPLES];
        set.fill(dim, 7, 0, &mut column);
        column
    });
    let place = |i: usize| half * (2.0 * DVec2::new(columns[0][i], columns[1][i]) - 1.0);
    let (mut sum, mut count) = (0.0, 0.0);
    for i in (0..SAMPLES).filter(|&i| inside(place(i))) {
        sum += displacement(i, place(i), columns[2][i]).dot(s).cos();
        count += 1.0;
    }
    sum / count
}

/// The part of a region, within ±`half` of the origin, that it shares with itself moved by `s`, on a grid of points.
fn overlap(inside: impl Fn(DVec2) -> bool, half: f64, s: DVec2) -> f64 {
    let n = 600;
    let at = |i: usize| half * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
    let points = (0..n * n).map(|i| DVec2::new(at(i % n), at(i / n)));
    let (mut all, mut shared) = (0u32, 0u32);
    for p in points.filter(|p| inside(*p)) {
        all += 1;
        shared += u32::from(inside(p - s));
    }
    f64::from(shared) / f64::from(all)
}

#[test]
fn a_disk_has_the_transfer_function_of_a_perfect_lens() {
    let kernel = Kernel::disk();
    for x in [0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0, 1.5] {
        for angle in [0.0, 0.3, 1.0, 2.2] {
            let s = 2.0 * x * DVec2::from_angle(angle);
            let exact = match x < 1.0 {
                true => 2.0 / std::f64::consts::PI * (x.acos() - x * (1.0 - x * x).sqrt()),
                false => 0.0,
            };
            let value = transfer(
                |q| q.length() < 1.0,
                1.0,
                |_, q, u| kernel.displacement(q, u),
                s,
            );
            assert!((value - exact).abs() < 3e-3, "{x} {angle}: {value} {exact}");
        }
    }
}

#[test]
fn the_light_of_airys_disk_lies_where_it_must() {
    // Encircled energy 1 − J₀² − J₁² (Born & Wolf 8.5) within 1, 2, 5; where it grows fast enough to say a radius.
    let kernel = Kernel::disk();
    for (within, energy) in [(1.0, 0.220_82), (2.0, 0.617_25), (5.0, 0.861_15)] {
        let radius = kernel.displacement_at(energy, 0.37).length();
        assert!((radius / within - 1.0).abs() < 0.01, "{radius} {within}");
    }
    // Far out 1 − E = 2/(π κ).
    let far = kernel.displacement_at(0.999, 0.2).length();
    assert!(
        (far * 0.001 * std::f64::consts::FRAC_PI_2 - 1.0).abs() < 0.02,
        "{far}"
    );
}

#[test]
fn a_cats_eye_and_a_square_have_the_transfer_function_of_their_overlap() {
    let lens = |p: DVec2| p.length() < 1.0 && (p - DVec2::new(0.9, 0.3)).length() < 1.0;
    let square = |p: DVec2| p.abs().max_element() < 0.7;
    let edge = |inside: &dyn Fn(DVec2) -> bool| -> Vec<DVec2> {
        let bisect = |direction: DVec2| {
            let (mut a, mut b) = (0.0, 3.0);
            for _ in 0..40 {
                let middle = 0.5 * (a + b);
                if inside(middle * direction) {
                    a = middle
                } else {
                    b = middle
                }
            }
            a * direction
        };
        let angles = (0..160).map(|i| f64::from(i) * std::f64::consts::TAU / 160.0);
        angles.map(|t| bisect(DVec2::from_angle(t))).collect()
    };
    let moved = |p: DVec2| lens(p + DVec2::new(0.45, 0.15));
    // The spikes of a square are narrower than the table's sectors.
    let shapes: [(&dyn Fn(DVec2) -> bool, f64); 2] = [(&moved, 4e-3), (&square, 1e-2)];
    for (inside, bound) in shapes {
        let kernel = Kernel::new(&edge(inside));
        for s in [(0.1, 0.0), (0.0, 0.2), (0.3, 0.3), (0.5, -0.4), (-0.2, 0.7)].map(DVec2::from) {
            let exact = overlap(inside, 1.5, s);
            let value = transfer(inside, 1.0, |_, q, u| kernel.displacement(q, u), s);
            assert!((value - exact).abs() < bound, "{s}: {value} {exact}");
        }
    }
}

/// Off the axis of a real, vignetted lens: the overlap of the directions that pass it, by rays through its surfaces.
#[test]
fn places_off_the_axis_diffract_as_the_directions_that_reach_them() {
    let lens = Lens::new(&Prescription::builtin("lib_50mm_US20210263286_ex1").unwrap()).unwrap();
    let lens = lens.focused_at(3000.0, FocusBy::Sensor, 550.0).unwrap();
    let system = lens.at(550.0).unwrap();
    let window = crate::field::SensorWindowMm {
        centre: DVec2::new(13.0, 8.0),
        half_width: 2.0,
        half_height: 1.5,
    };
    let pupils = ExitPupilMap::new(std::slice::from_ref(&system), window);
    let field = LensDiffraction::new(&pupils, system.sensor_z_mm).unwrap();
    assert!(field.kernels.len() > 1, "the corner is vignetted");
    let place = DVec2::new(14.1, 8.6);
    let origin_mm = camera_from_sensor_mm(place, system.sensor_z_mm);
    // The directions, traced backward, around that of the chief ray.
    let chief = crate::lens::chief_ray(&system, place.x, place.y).unwrap();
    let chief = chief.direction.truncate();
    let inside = |w: DVec2| {
        let w = chief + w;
        let direction = w.extend(-(1.0 - w.length_squared()).sqrt());
        crate::lens::trace_backward(
            &system,
            Ray {
                origin_mm,
                direction,
            },
        )
        .is_ok()
    };
    let here = field.at(place, 5);
    for s in [(0.02, 0.0), (0.0, 0.03), (0.05, 0.05), (0.06, -0.06)].map(DVec2::from) {
        let exact = overlap(inside, 0.4, s);
        let value = transfer(
            inside,
            0.4,
            |i, w, u| std::f64::consts::TAU * here.displacement(i, chief + w, u),
            s,
        );
        assert!((value - exact).abs() < 0.01, "{s}: {value} {exact}");
    }
}

/// A ray that starts where the slope of the phases puts it meets the point that the phases are of.
#[test]
fn slopes_of_the_phases_are_where_rays_to_the_point_start() {
    let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3").unwrap()).unwrap();
    let lens = lens.focused_at(750.0, FocusBy::Sensor, 550.0).unwrap();
    let system = lens.at(550.0).unwrap();
    let place = DVec2::new(1.6, 1.2);
    let window = crate::field::SensorWindowMm {
        centre: place,
        half_width: 0.02,
        half_height: 0.02,
    };
    let pupils = ExitPupilMap::new(std::slice::from_ref(&system), window);
    let field = LensDiffraction::new(&pupils, system.sensor_z_mm).unwrap();
    let (middle, to_disk) = field.ellipse(place);
    let place_mm = camera_from_sensor_mm(place, system.sensor_z_mm);
    let open = opened(&system);
    let sight = Sight {
        system: &system,
        open: &open,
        place_mm,
        depth_mm: 750.0,
        middle,
        to_disk,
    };
    let kernel = field.kernel(0);
    let front = Wavefront::traced(&sight, kernel.radius(), &Wavefront::fit().unwrap()).unwrap();
    let reached = |start: DVec2, q: DVec2| {
        let w = middle + to_disk.inverse() * q;
        let ray = Ray {
            origin_mm: place_mm + start.extend(0.0),
            direction: w.extend(-(1.0 - w.length_squared()).sqrt()),
        };
        let ray = crate::lens::trace_backward(&system, ray).unwrap();
        let t = (-750.0 - ray.origin_mm.z) / ray.direction.z;
        (ray.origin_mm + t * ray.direction).truncate()
    };
    let point = reached(DVec2::ZERO, DVec2::ZERO);
    for q in [(0.6, 0.1), (-0.5, 0.4), (0.1, -0.7), (-0.3, -0.3)].map(DVec2::from) {
        let start = 550e-6 / std::f64::consts::TAU * (to_disk.transpose() * front.gradient(q));
        let (before, after) = (reached(DVec2::ZERO, q) - point, reached(start, q) - point);
        // What a polynomial of the twelfth degree leaves of this lens's slopes.
        assert!(
            after.length() < 0.06 * before.length(),
            "{q}: {before} {after}"
        );
    }
    let draw = PhaseDraw::new(kernel, &front).unwrap();
    for s in [(0.36, 0.0), (0.0, 0.36), (0.7, 0.0), (0.0, 0.7), (0.3, 0.3)].map(DVec2::from) {
        let (mut waves, mut all) = (DVec2::ZERO, 0.0);
        let n = 400;
        let at = |i: usize| 1.3 * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
        for q in (0..n * n).map(|i| DVec2::new(at(i % n), at(i / n))) {
            all += f64::from(u8::from(kernel.is_inside(q)));
            let (a, b) = (q + 0.5 * s, q - 0.5 * s);
            if kernel.is_inside(a) && kernel.is_inside(b) {
                waves += DVec2::from_angle(front.phase(a) - front.phase(b));
            }
        }
        let waves = waves / all;
        let set = SobolSet::new(SAMPLES);
        let columns = [2, 3, 4].map(|dim| {
            let mut column = vec![0.0; SAMPLES];
            set.fill(dim, 7, 0, &mut column);
            column
        });
        let mut sums = [DVec2::ZERO; 2];
        let mut count = 0.0;
        for ((x, y), sample) in columns[0].iter().zip(&columns[1]).zip(&columns[2]) {
            let q = 1.3 * (2.0 * DVec2::new(*x, *y) - 1.0);
            if kernel.is_inside(q) {
                count += 1.0;
                let g = front.gradient(q);
                sums[0] += DVec2::from_angle(s.dot(g - draw.displacement(q, *sample)));
                sums[1] += DVec2::from_angle(s.dot(g - kernel.displacement(q, *sample)));
            }
        }
        let [drawn, by_place] = sums.map(|sum| (sum / count - waves).length());
        println!("{s}: errors {drawn} by the phases, {by_place} by the place in the pupil alone");
        assert!(drawn < 0.03, "{s}: {drawn}");
    }
}

#[test]
fn a_lens_on_the_axis_displaces_rays_of_mirrored_places_by_mirrored_ways() {
    let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3").unwrap()).unwrap();
    let lens = lens.focused_at(500.0, FocusBy::Sensor, 550.0).unwrap();
    let system = lens.at(550.0).unwrap();
    let window = crate::field::SensorWindowMm {
        centre: DVec2::ZERO,
        half_width: 1.6,
        half_height: 1.2,
    };
    let map = ExitPupilMap::new(std::slice::from_ref(&system), window);
    let diffraction = LensDiffraction::new(&map, system.sensor_z_mm).unwrap();
    let diffraction = diffraction.with_phases(&system, 500.0);
    // A node of the draws: only its own counts there.
    let place = DVec2::new(-0.8, -0.6);
    let drawn = |signs: DVec2, q: DVec2, sample: f64| {
        let here = diffraction.at(signs * place, 1);
        assert!(
            here.kernels
                .iter()
                .any(|(node, w)| *w == 1.0 && node.phases.is_some())
        );
        let direction = here.middle + here.to_disk.inverse() * (signs * q);
        signs * here.displacement(0, direction, sample)
    };
    for i in 0..40 {
        let t = f64::from(i) + 0.5;
        let q = 0.8 * (t / 40.0).sqrt() * DVec2::from_angle(2.4 * t);
        let sample = (0.618 * t).fract();
        let own = drawn(DVec2::ONE, q, sample);
        for signs in [DVec2::new(-1.0, 1.0), DVec2::new(1.0, -1.0), -DVec2::ONE] {
            let mirrored = drawn(signs, q, sample);
            assert!(
                (mirrored - own).length() < 1e-9 * own.length(),
                "{q}: {own} {mirrored}"
            );
        }
    }
}

/// Of a run of rays: between four nodes with phases, and where the lens has none.
#[test]
fn displacements_of_many_rays_are_those_of_each() {
    let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3").unwrap()).unwrap();
    let lens = lens.focused_at(750.0, FocusBy::Sensor, 550.0).unwrap();
    let system = lens.at(550.0).unwrap();
    let window = crate::field::SensorWindowMm {
        centre: DVec2::new(1.4, 1.0),
        half_width: 0.2,
        half_height: 0.2,
    };
    let pupils = ExitPupilMap::new(std::slice::from_ref(&system), window);
    let plain = LensDiffraction::new(&pupils, system.sensor_z_mm).unwrap();
    let place = window.centre + DVec2::new(0.07, -0.03);
    let (middle, to_disk) = plain.ellipse(place);
    let (directions, samples): (Vec<DVec2>, Vec<f64>) = (0..50)
        .map(|i| {
            let u = |k: u64| uniform(3, &[i, k]);
            let q = 1.8 * DVec2::new(u(0), u(1)) - 0.9;
            (middle + to_disk.inverse() * q, u(2))
        })
        .unzip();
    let [dx, dy] = [0, 1].map(|k| directions.iter().map(|d| d[k]).collect::<Vec<f64>>());
    for (has_phases, field) in [
        (true, plain.clone().with_phases(&system, 750.0)),
        (false, plain),
    ] {
        let here = field.at(place, 5);
        let nodes_with_phases = here.kernels.iter().filter(|k| k.0.phases.is_some());
        assert_eq!(nodes_with_phases.count(), if has_phases { 4 } else { 0 });
        let (mut x, mut y) = (samples.clone(), vec![0.0; samples.len()]);
        here.displacements(7, [&dx, &dy], [&mut x, &mut y]);
        let mut turns = std::collections::BTreeSet::new();
        for (i, direction) in directions.iter().enumerate() {
            let alone = here.displacement(7 + i, *direction, samples[i]);
            assert_eq!(DVec2::new(x[i], y[i]), alone, "{i}");
            turns.insert(here.turn_of(7 + i));
        }
        assert_eq!(turns.len(), 4);
    }
}
