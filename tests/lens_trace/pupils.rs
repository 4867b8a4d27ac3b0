//! Bounds of the exit pupil: closed form, containment by brute force, tightness; and the chief ray.

use glam::{DVec2, DVec3};
use quadpixel::field::SensorWindowMm;
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{
    Clipping, ExitPupilMap, Lens, OpticalSystem, PacketTracer, Prescription, PupilEllipse, Travel,
    chief_ray, table1_defects, trace_visiting,
};
use quadpixel::rays::RayBatch;
use quadpixel::simd::SimdLevel;

use crate::support::{stop, system};

fn window(centre: [f64; 2], half_mm: f64) -> SensorWindowMm {
    SensorWindowMm {
        centre: centre.into(),
        half_width: half_mm,
        half_height: half_mm,
    }
}

/// Evenly spread points of the unit square.
fn spread(i: usize) -> DVec2 {
    let g = 1.324_717_957_244_746_f64;
    DVec2::new(
        (0.5 + i as f64 / g).fract(),
        (0.5 + i as f64 / (g * g)).fract(),
    )
}

/// Part of the ellipse `grown` times as large through which rays pass, and the farthest ray that passes, in
/// semi-diameters of the ellipse itself.
fn passing(
    system: &OpticalSystem,
    tracer: &PacketTracer,
    at: DVec2,
    e: &PupilEllipse,
    grown: f64,
) -> (f64, f64) {
    let origin = camera_from_sensor_mm(at, system.sensor_z_mm);
    let disk: Vec<DVec2> = (0..20_000)
        .map(spread)
        .map(|s| DVec2::from_angle(std::f64::consts::TAU * s.x) * (grown * s.y.sqrt()))
        .collect();
    let mut batch = RayBatch::with_capacity(disk.len());
    for d in &disk {
        let p = e.centre_mm + (d.x * e.axis_a_mm + d.y * e.axis_b_mm).extend(0.0);
        batch.push(origin, (p - origin).normalize());
    }
    tracer.trace_backward(&mut batch, SimdLevel::detect());
    let reaches: Vec<f64> = disk
        .iter()
        .zip(&batch.status)
        .filter_map(|(d, status)| (*status == 0).then_some(d.length()))
        .collect();
    let inside = reaches.iter().filter(|r| **r <= 1.0).count() as f64;
    (
        inside * grown * grown / disk.len() as f64,
        reaches.into_iter().fold(0.0, f64::max),
    )
}

#[test]
fn pupil_of_a_bare_stop_is_its_disk() {
    let lens = system(vec![stop(-8.0, 1.3)], 2.0);
    let map = ExitPupilMap::new(&[lens], window([0.5, -1.0], 3.0));
    for i in 0..30 {
        let at = DVec2::new(0.5, -1.0) + (spread(i) * 2.0 - 1.0) * 3.0;
        let e = map.at(at.x, at.y).unwrap();
        assert_eq!(e.centre_mm.z, -8.0);
        assert!(e.centre_mm.truncate().length() < 0.01, "{e:?}");
        let ratio = e.area_mm2() / (std::f64::consts::PI * 1.3 * 1.3);
        assert!((1.0..1.06).contains(&ratio), "{ratio}");
    }
}

#[test]
fn nothing_passes_where_the_lens_is_dark() {
    // A tube: two small stops far from each other, and a sensor position that looks at its wall.
    let lens = system(vec![stop(-20.0, 1.0), stop(-10.0, 1.0)], 0.0);
    let map = ExitPupilMap::new(&[lens], window([0.0, 0.0], 12.0));
    assert!(map.at(0.0, 0.0).is_some());
    assert!(map.at(12.0, 12.0).is_none());
    assert!(
        ExitPupilMap::new(&[], window([0.0, 0.0], 1.0))
            .at(0.0, 0.0)
            .is_none()
    );
}

/// Containment and tightness over the window, at positions off the nodes; returns the fill on the axis and the least.
fn assert_bounds(name: &str, systems: &[OpticalSystem], half_mm: f64) -> (f64, f64) {
    let started = std::time::Instant::now();
    let map = ExitPupilMap::new(systems, window([0.0, 0.0], half_mm));
    let seconds = started.elapsed().as_secs_f64();
    let tracers: Vec<PacketTracer> = systems.iter().map(PacketTracer::new).collect();
    let (mut on_axis, mut least, mut worst) = (0.0, f64::INFINITY, 0.0_f64);
    for i in 0..60 {
        let at = (spread(i) * 2.0 - 1.0) * half_mm * if i == 0 { 0.01 } else { 1.0 };
        let Some(e) = map.at(at.x, at.y) else {
            continue;
        };
        let mut fill = 0.0_f64;
        for (system, tracer) in systems.iter().zip(&tracers) {
            let (part, reach) = passing(system, tracer, at, &e, 1.3);
            fill = fill.max(part);
            worst = worst.max(reach);
            assert!(
                reach <= 1.0,
                "{name}: a ray passes at {reach} of the bounds seen from {at}"
            );
        }
        if i == 0 {
            on_axis = fill;
        }
        least = least.min(fill);
    }
    println!(
        "{name}: fill on axis {on_axis:.3}, least {least:.3}, farthest ray {worst:.4}, {seconds:.3} s"
    );
    (on_axis, least)
}

#[test]
fn bounds_hold_every_passing_ray_and_little_else() {
    for (name, half_mm, nm) in [
        ("wide_US20120327520A1_emb3", 2.0, vec![620.0, 530.0, 460.0]),
        ("wide_US11940605B2_emb1", 2.0, vec![530.0]),
        ("tele_US10571665B2_220b", 1.8, vec![530.0]),
        ("lib_double_gauss_100mm_glass", 12.0, vec![550.0]),
    ] {
        let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
        let systems: Vec<_> = nm.into_iter().map(|w| lens.at(w).unwrap()).collect();
        let (on_axis, least) = assert_bounds(name, &systems, half_mm);
        assert!(on_axis > 0.9 && least > 0.8, "{name}: {on_axis} {least}");
    }
}

#[test]
fn bounds_hold_for_a_stopped_down_and_for_a_misaligned_lens() {
    let wide = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3").unwrap()).unwrap();
    let small = wide.with_f_number(16.0).unwrap().at(550.0).unwrap();
    // A small pupil moves by more of its own size from node to node, so its bounds need more room off the axis.
    let (on_axis, least) = assert_bounds("f/16", &[small], 2.0);
    assert!(on_axis > 0.9 && least > 0.6, "{on_axis} {least}");

    let folded = Prescription::builtin("tele_US10571665B2_220b").unwrap();
    let bent = Lens::new(&folded)
        .unwrap()
        .perturbed(&table1_defects())
        .unwrap();
    let (on_axis, least) = assert_bounds("table 1", &[bent.at(550.0).unwrap()], 1.8);
    assert!(on_axis > 0.9 && least > 0.8, "{on_axis} {least}");
}

#[test]
fn chief_ray_goes_through_the_centre_of_the_stop() {
    let mut lenses: Vec<(String, OpticalSystem, f64)> = quadpixel::lens::builtin_names()
        .into_iter()
        .map(|name| {
            let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
            let image = (0.35 * lens.paraxial(550.0).unwrap().efl_mm).min(12.0);
            (name.to_owned(), lens.at(550.0).unwrap(), image)
        })
        .collect();
    let folded = Prescription::builtin("tele_US10571665B2_220b").unwrap();
    let bent = Lens::new(&folded)
        .unwrap()
        .perturbed(&table1_defects())
        .unwrap();
    lenses.push(("table 1".into(), bent.at(550.0).unwrap(), 2.0));
    for (name, system, image) in lenses {
        for at in [
            DVec2::ZERO,
            DVec2::new(0.5, -0.3) * image,
            DVec2::new(-0.7, 0.7) * image,
        ] {
            let chief =
                chief_ray(&system, at.x, at.y).unwrap_or_else(|e| panic!("{name} {at}: {e}"));
            assert_eq!(
                chief.origin_mm,
                camera_from_sensor_mm(at, system.sensor_z_mm)
            );
            assert!(chief.direction.z < 0.0);
            let mut on_stop = DVec3::INFINITY;
            let _ = trace_visiting(&system, chief, Travel::Backward, Clipping::Off, |i, p| {
                if i == system.stop {
                    on_stop = p;
                }
            });
            assert!(on_stop.truncate().length() < 1e-8, "{name} {at}: {on_stop}");
        }
    }
}
