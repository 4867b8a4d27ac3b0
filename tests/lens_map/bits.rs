//! The same bits whatever the instructions and the company, and the exact tracer's where a map does not hold.

use glam::{DVec2, DVec3};
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{PacketTracer, PlaceBuffers};
use quadpixel::rays::RayBatch;
use quadpixel::simd::SimdLevel;

use crate::support::{Case, rays};

fn same_bits(a: &RayBatch, b: &RayBatch) {
    let bits = |x: &RayBatch| -> Vec<u64> {
        let columns = [&x.ox, &x.oy, &x.oz, &x.dx, &x.dy, &x.dz];
        columns
            .iter()
            .flat_map(|c| c.iter().map(|v| v.to_bits()))
            .collect()
    };
    assert_eq!(bits(a), bits(b));
    assert_eq!((&a.status, &a.surface), (&b.status, &b.surface));
}

#[test]
fn levels_groupings_and_threads_give_the_same_bits() {
    let case = Case::phone("wide_US20120327520A1_emb3", [1.0, 0.4]);
    let (system, pupils, map) = case.map().unwrap();
    // Made by one thread, it is the same map.
    let alone = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let (_, _, again) = alone.install(|| case.map()).unwrap();
    for place in [[0.9, 0.3], [1.2, 0.6]].map(DVec2::from) {
        let start = rays(&case, &pupils, system.sensor_z_mm, place, 300);
        let mut first = start.clone();
        let mut buffers = PlaceBuffers::default();
        map.trace_backward(&mut first, place, &mut buffers, SimdLevel::Scalar);
        assert!(first.status.iter().any(|s| *s != 0) && first.status.contains(&0));
        for level in SimdLevel::ALL {
            for (map, buffers) in [(&map, &mut buffers), (&again, &mut PlaceBuffers::default())] {
                let mut other = start.clone();
                map.trace_backward(&mut other, place, buffers, level);
                same_bits(&first, &other);
                let mut together = RayBatch::default();
                for chunk in (0..start.len()).collect::<Vec<_>>().chunks(7) {
                    let mut few = RayBatch::default();
                    chunk
                        .iter()
                        .for_each(|&i| few.push(start.ray(i).origin_mm, start.ray(i).direction));
                    map.trace_backward(&mut few, place, buffers, level);
                    for i in 0..few.len() {
                        together.push(few.ray(i).origin_mm, few.ray(i).direction);
                        *together.status.last_mut().unwrap() = few.status[i];
                        *together.surface.last_mut().unwrap() = few.surface[i];
                    }
                }
                same_bits(&first, &together);
            }
        }
    }
}

/// Farther than any map of these pixels reaches.
const FAR_OFF_MM: f64 = 0.4;

#[test]
fn rays_from_farther_off_and_rays_that_are_none_are_traced_exactly() {
    let case = Case::phone("wide_US20120327520A1_emb3", [1.0, 0.4]);
    let (system, pupils, map) = case.map().unwrap();
    let place = DVec2::new(1.05, 0.31);
    let mut start = rays(
        &case,
        &pupils,
        system.sensor_z_mm,
        place + DVec2::splat(FAR_OFF_MM),
        100,
    );
    let origin = start.ray(0).origin_mm;
    for direction in [DVec3::X, DVec3::NAN, DVec3::Z, -DVec3::Z] {
        start.push(origin, direction);
    }
    let mut exact = start.clone();
    PacketTracer::new(&system).trace_backward(&mut exact, SimdLevel::detect());
    let mut buffers = PlaceBuffers::default();
    let traced = map.trace_backward(&mut start, place, &mut buffers, SimdLevel::detect());
    assert_eq!(traced, 104);
    same_bits(&start, &exact);
    // From the place itself: along the sensor, nowhere, and away from the scene.
    let mut odd = RayBatch::default();
    for direction in [DVec3::X, DVec3::NAN, DVec3::Z] {
        odd.push(camera_from_sensor_mm(place, system.sensor_z_mm), direction);
    }
    let mut exact = odd.clone();
    PacketTracer::new(&system).trace_backward(&mut exact, SimdLevel::detect());
    map.trace_backward(&mut odd, place, &mut buffers, SimdLevel::detect());
    same_bits(&odd, &exact);
}
