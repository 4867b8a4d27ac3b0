//! The packet tracer against the plain one, and against itself at other levels and groupings.

use glam::{DVec2, DVec3};
use quadpixel::lens::{
    Lens, OpticalSystem, PacketTracer, Paraxial, Prescription, builtin_names, table1_defects,
    trace_backward, trace_forward,
};
use quadpixel::rays::{Ray, RayBatch, RayFailure};
use quadpixel::simd::SimdLevel;

use crate::support::{asphere, conic, stop, system, tilted};

/// Rays from all over the image circle: every other one aimed over and beyond the last surface, the others at and
/// around the paraxial exit pupil.
fn backward_rays(system: &OpticalSystem, image_mm: f64, count: usize) -> Vec<Ray> {
    let last = &system.surfaces[system.surfaces.len() - 1];
    let semi = last.aperture.semi_mm.min(3.0 * image_mm);
    let paraxial = Paraxial::from_aligned(system);
    // The additive recurrence of the plastic number's generalisation fills the four-cube evenly.
    let at = |i: usize, k: i32| (0.5 + i as f64 * 1.167_303_978_261_418_7_f64.powi(-k)).fract();
    (0..count)
        .map(|i| {
            let on_sensor = DVec2::new(at(i, 1), at(i, 2)) * 2.0 - 1.0;
            let at_target = DVec2::new(at(i, 3), at(i, 4)) * 2.2 - 1.1;
            let origin_mm = (on_sensor * image_mm * 0.7).extend(system.sensor_z_mm);
            let target = if i % 2 == 0 {
                (at_target * semi).extend(last.pose.vertex_mm.z)
            } else {
                (at_target * paraxial.exit_pupil_semi_mm).extend(paraxial.exit_pupil_z_mm)
            };
            let direction = (target - origin_mm).normalize();
            Ray {
                origin_mm,
                direction: -direction * direction.z.signum(),
            }
        })
        .collect()
}

fn batch(rays: &[Ray]) -> RayBatch {
    let mut batch = RayBatch::with_capacity(rays.len());
    for ray in rays {
        batch.push(ray.origin_mm, ray.direction);
    }
    batch
}

/// Returns how many passed.
fn assert_agrees(name: &str, system: &OpticalSystem, rays: &[Ray]) -> usize {
    let tracer = PacketTracer::new(system);
    let mut traced = batch(rays);
    tracer.trace_backward(&mut traced, SimdLevel::detect());
    let mut passed = Vec::new();
    let mut told_differently = 0;
    for (i, ray) in rays.iter().enumerate() {
        match (trace_backward(system, *ray), traced.get(i)) {
            (Ok(a), Ok(b)) => {
                assert!(
                    (a.origin_mm - b.origin_mm).length() < 1e-9,
                    "{name} {i}: {a:?} {b:?}"
                );
                assert!(
                    (a.direction - b.direction).length() < 1e-9,
                    "{name} {i}: {a:?} {b:?}"
                );
                passed.push(Ray {
                    origin_mm: a.origin_mm,
                    direction: -a.direction,
                });
            }
            (a, b) if a == b => {}
            // Far outside the clear aperture the polynomial bends over and Newton's path hangs on rounding: such a ray
            // is lost at the same surface, but whether it met it there or not may be told differently.
            (Err(RayFailure::Missed { surface: a }), Err(RayFailure::Vignetted { surface: b }))
            | (Err(RayFailure::Vignetted { surface: a }), Err(RayFailure::Missed { surface: b }))
                if a == b =>
            {
                told_differently += 1;
            }
            (a, b) => panic!("{name} {i}: {a:?} {b:?}"),
        }
    }
    assert!(
        told_differently * 1000 <= rays.len(),
        "{name}: {told_differently}"
    );
    let mut forward = batch(&passed);
    tracer.trace_forward(&mut forward, SimdLevel::detect());
    for (i, ray) in passed.iter().enumerate() {
        // A ray that just passed one way may be clipped by rounding the other way; both tracers must say so alike.
        match (trace_forward(system, *ray), forward.get(i)) {
            (Ok(a), Ok(b)) => assert!((a.origin_mm - b.origin_mm).length() < 1e-9, "{name} {i}"),
            (a, b) => assert_eq!(a, b, "{name} {i}"),
        }
    }
    passed.len()
}

#[test]
fn packets_agree_with_the_plain_tracer_on_every_builtin_lens() {
    for name in builtin_names() {
        let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
        let system = lens.at(550.0).unwrap();
        let image = 0.5 * lens.paraxial(550.0).unwrap().efl_mm;
        let passed = assert_agrees(name, &system, &backward_rays(&system, image, 4000));
        assert!(passed > 40, "{name}: {passed}");
    }
}

#[test]
fn packets_agree_with_the_plain_tracer_on_misaligned_lenses() {
    let folded = Prescription::builtin("tele_US10571665B2_220b").unwrap();
    let lens = Lens::new(&folded)
        .unwrap()
        .perturbed(&table1_defects())
        .unwrap();
    let system = lens.at(550.0).unwrap();
    assert!(assert_agrees("table 1", &system, &backward_rays(&system, 3.0, 4000)) > 40);

    let mut bent = tilted(
        asphere(conic(0.9, -0.4, -2.0, (1.6, 1.0)), &[0.001, 0.03, -0.01]),
        0.1,
        -0.2,
    );
    bent.pose.vertex_mm.y = 0.1;
    let hand_made = self::system(
        vec![
            stop(0.2, 1.2),
            tilted(conic(0.0, 0.5, 0.7, (1.0, 1.6)), 0.05, 0.0),
            bent,
        ],
        4.0,
    );
    let rays: Vec<Ray> = backward_rays(&hand_made, 1.5, 4000);
    assert!(assert_agrees("hand made", &hand_made, &rays) > 100);
}

#[test]
fn every_level_and_every_grouping_gives_the_same_bits() {
    let lens = Lens::new(&Prescription::builtin("wide_US20120327520A1_emb3").unwrap()).unwrap();
    let system = lens.at(550.0).unwrap();
    let tracer = PacketTracer::new(&system);
    let rays = backward_rays(&system, 2.8, if cfg!(miri) { 70 } else { 1500 });
    let mut reference = batch(&rays);
    tracer.trace_backward(&mut reference, SimdLevel::Scalar);
    for level in SimdLevel::ALL {
        for size in [1, 7, 64, 100, 1500] {
            let mut joined = RayBatch::default();
            for part in rays.chunks(size) {
                let mut traced = batch(part);
                tracer.trace_backward(&mut traced, level);
                for i in 0..part.len() {
                    joined.push(
                        DVec3::new(traced.ox[i], traced.oy[i], traced.oz[i]),
                        DVec3::new(traced.dx[i], traced.dy[i], traced.dz[i]),
                    );
                    let last = joined.len() - 1;
                    joined.status[last] = traced.status[i];
                    joined.surface[last] = traced.surface[i];
                }
            }
            // No NaN comes back, so equality is equality of bits but for the sign of zero.
            assert_eq!(joined, reference, "{level:?} in groups of {size}");
        }
    }
}

#[test]
fn lens_without_surfaces_leaves_rays_alone() {
    let empty = system(Vec::new(), 1.0);
    let ray = Ray {
        origin_mm: DVec3::new(0.1, 0.2, 1.0),
        direction: DVec3::NEG_Z,
    };
    let mut rays = batch(&[ray]);
    PacketTracer::new(&empty).trace_backward(&mut rays, SimdLevel::detect());
    assert_eq!(rays.get(0), Ok(ray));
}
