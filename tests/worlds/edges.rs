//! Depth, object, normal and occlusion at depth edges, and the blurred image itself, against an array of pinholes in
//! the exit pupil: each pinhole's picture by the plain ray trace and the closed form of a ray and a rectangle, neither
//! of which the renderer uses.

use glam::{DVec2, DVec3};
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{chief_ray, trace_backward};
use quadpixel::rays::Ray;
use quadpixel::render::truth::SightRays;
use quadpixel::render::{Camera, Render, RenderSettings};
use quadpixel::sensor::ShiftRule;

use super::{Sheet, camera, scene, sheets};

/// Pinholes along the pupil's side, and places along a pixel's side. Each pinhole has the places moved by a part of
/// their spacing of its own, so that an edge in focus, which only the places resolve, meets 113 grids and not one.
const PINHOLES: usize = 12;
const PLACES: usize = 8;
/// Every other pixel of every other row: the plain trace is slow.
const STEP: usize = 2;

/// The nearest sheet on a ray: its number and the point.
fn seen(sheets: &[Sheet], ray: &Ray) -> Option<(usize, DVec3)> {
    let hits = sheets.iter().enumerate().filter_map(|(k, sheet)| {
        let to_sheet = sheet.camera_from_sheet.inverse();
        let o = to_sheet.transform_point3(ray.origin_mm);
        let d = to_sheet.transform_vector3(ray.direction);
        let tau = -o.z / d.z;
        let p = (o + tau * d).truncate().abs();
        (tau > 0.0 && p.x <= sheet.half_mm.x && p.y <= sheet.half_mm.y).then_some((
            k,
            tau,
            ray.origin_mm + tau * ray.direction,
        ))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|(k, _, p)| (k, p))
}

/// Share of the pinholes that see another sheet than `chief`, and the mean radiance over all: weighted by the solid
/// angle that a pinhole stands for.
fn by_pinholes(
    camera: &Camera,
    sheets: &[Sheet],
    (column, row): (usize, usize),
    chief: usize,
) -> [f64; 2] {
    let (mut all, mut other, mut light) = (0.0, 0.0, 0.0);
    let centred = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
    let middle = camera.sensor().position_mm(column as f64, row as f64);
    let pupil = camera.pupil_at(middle).unwrap();
    for h in 0..PINHOLES * PINHOLES {
        let p = 2.0 * centred(h % PINHOLES, PINHOLES) - 1.0;
        let q = 2.0 * centred(h / PINHOLES, PINHOLES) - 1.0;
        if p * p + q * q > 1.0 {
            continue;
        }
        // Evenly spread pairs: multiples of 1/g and 1/g², g³ = g + 1 (M. Roberts' generalised golden ratio).
        let shift =
            [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|a| (a * h as f64).fract());
        for k in 0..PLACES * PLACES {
            let place = |i: usize, shift: f64| (i as f64 + shift) / PLACES as f64 - 0.5;
            let x = column as f64 + place(k % PLACES, shift[0]);
            let y = row as f64 + place(k / PLACES, shift[1]);
            let origin_mm =
                camera_from_sensor_mm(camera.sensor().position_mm(x, y), camera.sensor_z_mm());
            let hole = pupil.centre_mm + (p * pupil.axis_a_mm + q * pupil.axis_b_mm).extend(0.0);
            let e = hole - origin_mm;
            let ray = Ray {
                origin_mm,
                direction: e.normalize(),
            };
            let Ok(ray) = trace_backward(camera.system(1), ray) else {
                continue;
            };
            let weight = e.z * e.z / e.length_squared().powi(2);
            let (sheet, _) = seen(sheets, &ray).unwrap();
            all += weight;
            other += weight * f64::from(u8::from(sheet != chief));
            light += weight * f64::from(sheets[sheet].radiance);
        }
    }
    [other / all, light / all]
}

#[test]
fn truth_at_depth_edges_is_that_of_an_array_of_pinholes() {
    let camera = camera((2, 2), 15.0, ShiftRule::ChiefRay);
    let (scene, sheets) = (scene(), sheets());
    let truth = SightRays::chief_rays(&camera).geometry(&camera, &scene);
    let settings = RenderSettings {
        rays_per_pixel: 1024,
        seed: 3,
    };
    let surfaces = Some(truth.surfaces.as_slice());
    let rendered = Render::new(&camera, &scene, &settings)
        .occlusion(surfaces)
        .run();
    let occlusion = rendered.occlusion.unwrap();
    let sum = rendered.image.sum();
    let (mut on_edges, mut worst, mut squares, mut n) = (0, [0.0f64; 2], [0.0; 2], 0.0);
    let mut white = Vec::new();
    for row in (0..24).step_by(STEP) {
        for column in (0..32).step_by(STEP) {
            let place: DVec2 = camera.sensor().position_mm(column as f64, row as f64);
            let chief = chief_ray(camera.system(1), place.x, place.y)
                .unwrap()
                .direction;
            let ray = Ray {
                origin_mm: camera_from_sensor_mm(place, camera.sensor_z_mm()),
                // Away from the sensor, whichever way it was found.
                direction: chief * -chief.z.signum(),
            };
            let ray = trace_backward(camera.system(1), ray);
            let (sheet, point) = seen(&sheets, &ray.unwrap()).unwrap();
            let index = row * 32 + column;
            // Chief directions are tabulated over the window (to 1e-6 or so): a pixel whose chief ray runs along an
            // edge may fall either way.
            if truth.surfaces[index] != 10 + sheet as u16 {
                let [other, _] = by_pinholes(&camera, &sheets, (column, row), sheet);
                assert!((0.2..0.8).contains(&other), "object at {column}, {row}");
                continue;
            }
            let depth = f64::from(truth.depth_mm.pixel(column, row)[0]);
            assert!((depth / -point.z - 1.0).abs() < 1e-4, "{depth} {point}");
            let distance = f64::from(truth.distance_mm.pixel(column, row)[0]);
            assert!((distance / point.length() - 1.0).abs() < 1e-4);
            let normal = sheets[sheet].camera_from_sheet.matrix3.z_axis;
            let normal = normal * -normal.dot(point).signum();
            let stored = truth.normals.pixel(column, row);
            let stored = DVec3::new(stored[0].into(), stored[1].into(), stored[2].into());
            assert!(stored.distance(normal) < 1e-5, "{stored} {normal}");

            let [other, light] = by_pinholes(&camera, &sheets, (column, row), sheet);
            let own = f64::from(occlusion.pixel(column, row)[0]);
            on_edges += usize::from(other > 0.05);
            let green = f64::from(sum.pixel(column, row)[1]);
            if other == 0.0 {
                white.push(green / light);
            }
            let level = white.first().copied().unwrap_or(green / light);
            for (k, error) in [own - other, green / level / light - 1.0]
                .into_iter()
                .enumerate()
            {
                worst[k] = worst[k].max(error.abs());
                squares[k] += error * error;
            }
            n += 1.0;
        }
    }
    assert!(on_edges > 25, "{on_edges} pixels with two depths");
    let rms = squares.map(|s: f64| (s / n).sqrt());
    // The array's own error: an edge in focus crosses 113 grids of places, each half a spacing off at most (1/16 of the
    // pixel) and evenly spread within that, so 1/16/√113 or less; a blurred one is half a row of pinholes off, at each
    // of 64 places otherwise: 1/12/√64. Both about 0.01. The render's: 1024 random rays would have a standard error of
    // 0.5/√1024 = 0.016 at most, stratified ones less; among 150 pixels on edges the largest is within 2.5 of them,
    // 0.04. Radiances differ by a factor of up to 4, so an error of the share is thrice that of the light.
    assert!(
        worst[0] < 0.05 && rms[0] < 0.01,
        "occlusion: worst {} rms {}",
        worst[0],
        rms[0]
    );
    assert!(
        worst[1] < 3.0 * 0.05 && rms[1] < 0.03,
        "light: worst {} rms {}",
        worst[1],
        rms[1]
    );
}
