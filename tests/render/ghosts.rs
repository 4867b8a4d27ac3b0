//! Ghosts: a thin lens's by paraxial optics, veiling glare by plain sums, and bytes that do not hang on threads.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::frames::sensor_from_camera;
use quadpixel::lens::{Coating, FocusBy, Lens, Prescription, ReflectionSettings, Reflections};
use quadpixel::rays::Ray;
use quadpixel::render::{Camera, GhostLook, ghost_blocks};
use quadpixel::sampling::uniform;
use quadpixel::scene::Scene;
use quadpixel::scene::world::{Material, PathSettings, TriangleMesh, World, WorldDescription};

use super::shots::{self, boxes, shoot};

/// Two thin surfaces of power 1/50 mm and index 1.5, with a stop of 0.5 mm.
const THIN: &str = r#"{
  "name": "thin", "source": "none", "wavelengths": [587.56],
  "surfaces": [
    {"radius_mm": 50, "thickness_mm": 0.006, "nd": 1.5, "vd": null, "conic": 0, "coefficients": {}, "semi_aperture_mm": 0.5, "is_stop": true},
    {"radius_mm": -50, "thickness_mm": 50, "nd": null, "conic": 0, "coefficients": {}, "semi_aperture_mm": 0.6, "is_stop": false}
  ]
}"#;

/// A square that shines towards the camera, in the dark.
fn lamp(centre_mm: DVec3, side_mm: f64, radiance: f32) -> Scene {
    let mut world = WorldDescription {
        materials: vec![Material {
            emission: [radiance; 3],
            ..Material::default()
        }],
        environment: quadpixel::scene::world::Environment::Even([0.0; 3]),
        ..WorldDescription::default()
    };
    let corner = centre_mm + DVec3::new(-0.5 * side_mm, 0.5 * side_mm, 0.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * side_mm, DVec3::NEG_Y * side_mm, 0),
        1,
    );
    Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    )
}

fn settings(coating: f64, sensor: f64) -> ReflectionSettings {
    ReflectionSettings {
        coating: Coating::Reflectance(coating),
        sensor,
    }
}

fn mean_and_spread(values: &[f32]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / n;
    let square = values.iter().map(|v| (f64::from(*v) - mean).powi(2));
    (mean, (square.sum::<f64>() / n).sqrt())
}

/// Irradiance of a far lamp's ghost: L Ω R_1 R_2 over the ghost's magnification squared, (1 − s/f_g)², with
/// 1/f_g = (3n − 1)/(n − 1)/f: over a disk around the lamp's own image, and nothing beside it.
#[test]
fn a_thin_lenss_ghost_has_the_light_and_the_size_of_paraxial_optics() {
    let lens = Lens::new(&Prescription::from_json(THIN, "thin").unwrap()).unwrap();
    let (distance, side, radiance) = (2000.0, 4.0, 1e4);
    let lens = lens.focused_at(distance, FocusBy::Sensor, 550.0).unwrap();
    let response = boxes(1, 1, 8.0, 1.0);
    let reflections = Reflections::new(&lens, &settings(0.1, 0.0)).unwrap();
    let s = lens.sensor_z_mm();
    let sine = 0.03f64;
    let at = DVec3::new(-sine * distance, 0.0, -distance);
    let scene = lamp(at, side, radiance);
    let ghost_power = 3.5 / 0.5 / 50.0;
    // Light from `distance` away: 1/s' = 1/f_g − 1/distance, magnified by 1 − s/s'.
    let magnified = 1.0 - s * (ghost_power - 1.0 / distance);
    let radius = 0.5 * magnified.abs();
    let solid = side * side / (distance * distance) / (1.0 + sine * sine).powi(2);
    let expected = f64::from(radiance) * solid * 0.1f64.powi(2) / magnified.powi(2);
    let image = sensor_from_camera(DVec3::new(sine * s, 0.0, 0.0)).x;
    // On the way from the middle of the ghost to its rim, and beyond.
    for (part, inside) in [(0.5, true), (-0.8, true), (1.08, false)] {
        let place = DVec2::new(image + part * radius, 0.0);
        let camera =
            shots::camera(&lens, &response, (32, 32), place).with_reflections(reflections.clone());
        let direct = camera.without_reflections().unwrap();
        assert_eq!(
            shoot(&direct, &scene, 64, 1)
                .image
                .mosaic
                .data()
                .iter()
                .sum::<f32>(),
            0.0
        );
        let shot = shoot(&camera, &scene, 4096, 1);
        let (mean, spread) = mean_and_spread(shot.image.mosaic.data());
        println!(
            "{part}: {:.4} of the closed form, noise {:.3}",
            mean / expected,
            spread / expected
        );
        if inside {
            let error = spread / expected / 32.0;
            assert!(
                error < 0.015 && (mean / expected - 1.0).abs() < 3.0 * error,
                "{part}: {mean} {expected}, error {error}"
            );
        } else {
            assert!(mean < 1e-3 * expected, "{part}: {mean} {expected}");
        }
    }
}

fn phone(size: usize, pitch_um: f64, reflections: &ReflectionSettings) -> Camera {
    let lens = shots::focused(shots::PHONE, 500.0);
    let reflections = Reflections::new(&lens, reflections).unwrap();
    let response = boxes(1, 1, pitch_um, 0.01 * pitch_um);
    shots::camera(&lens, &response, (size, size), DVec2::new(0.4, 0.2))
        .with_reflections(reflections)
}

/// Under an even sky, the mean of the window against a plain sum: rays drawn evenly over pairs, front disk and all
/// directions.
#[test]
fn veiling_glare_of_an_even_sky_is_that_of_a_plain_sum() {
    let lens = Lens::new(&Prescription::from_json(THIN, "thin").unwrap()).unwrap();
    let given = settings(0.05, 0.1);
    let reflections = Reflections::new(&lens, &given).unwrap();
    let response = boxes(1, 1, 400.0, 4.0);
    let thin = shots::camera(&lens, &response, (16, 16), DVec2::new(1.0, 0.5));
    for (name, camera, rays) in [
        ("thin lens", thin.with_reflections(reflections), 2_000_000),
        ("phone", phone(16, 100.0, &given), 2_000_000),
    ] {
        let sky = shots::white();
        let (plain, plain_error) = plain_sum(&camera, rays);
        for (look, seeds) in [(GhostLook::Short, 240), (GhostLook::Long, 60)] {
            let blocks = |seed| ghost_blocks(&camera, &sky, seed, look).unwrap();
            let sets = (0..seeds).flat_map(|seed| blocks(seed).values);
            let means: Vec<f32> = (sets.map(|set| set.iter().sum::<f64>() / set.len() as f64))
                .map(|mean| mean as f32)
                .collect();
            let (mean, spread) = mean_and_spread(&means);
            let error = spread / (means.len() as f64).sqrt();
            println!(
                "{name}, {look:?}: {mean:.4e} ± {error:.2e}, of one {:.2}, plainly {plain:.4e} ± {plain_error:.2e}",
                spread / mean
            );
            let both = error.hypot(plain_error);
            assert!(
                (mean - plain).abs() < 4.0 * both && both < 0.04 * plain,
                "{name}, {look:?}"
            );
            // One look errs by less than the room that is left for it.
            assert!(spread < 0.75 * mean, "{name}, {look:?}");
        }
    }
}

/// Mean ghosts of a camera's window under a sky of radiance 1, and its standard error.
fn plain_sum(camera: &Camera, rays: u64) -> (f64, f64) {
    let reflections = camera.reflections().unwrap();
    let window = camera.sensor().window_mm();
    let area = 4.0 * window.half_width * window.half_height;
    let system = camera.system(1);
    let pairs = reflections.pairs(system);
    let first = &system.surfaces[0];
    let semi = first.aperture.semi_mm;
    let rim = first.pose.vertex_mm.z + first.sag_mm(semi * semi).unwrap();
    let (mut sum, mut squares) = (0.0, 0.0);
    for ray in 0..rays {
        let random = |k: u64| 2.0 * uniform(9, &[ray, k]) - 1.0;
        let pair = pairs[ray as usize % pairs.len()];
        let p = semi * DVec2::new(random(0), random(1));
        let d = DVec2::new(random(2), random(3));
        if p.length() > semi || d.length() > 0.999 {
            continue;
        }
        let light = Ray {
            origin_mm: p.extend(rim),
            direction: d.extend((1.0 - d.length_squared()).sqrt()),
        };
        let Some(landed) = reflections.trace_pair(system, pair, light) else {
            continue;
        };
        let at = (sensor_from_camera(landed.ray.origin_mm).truncate() - window.centre).abs();
        if at.x < window.half_width && at.y < window.half_height {
            sum += landed.share;
            squares += landed.share * landed.share;
        }
    }
    let scale = 16.0 * semi * semi * pairs.len() as f64
        / (rays as f64 * area * reflections.transmission_on_axis(system));
    (scale * sum, scale * squares.sqrt())
}

#[test]
fn ghosts_have_the_same_bytes_on_one_thread_and_more_noise_by_fewer_rays() {
    let camera = phone(32, 8.0, &ReflectionSettings::default());
    let scene = lamp(DVec3::new(40.0, 150.0, -600.0), 10.0, 3e3);
    let first = shoot(&camera, &scene, 16, 3).image.mosaic;
    let again = shots::on_threads(1, || shoot(&camera, &scene, 16, 3).image.mosaic);
    assert_eq!(first.data(), again.data());
    for rays in [64, 4096] {
        let (mean, spread) = mean_and_spread(shoot(&camera, &scene, rays, 3).image.mosaic.data());
        println!(
            "{rays} rays per pixel: mean {mean:.3e}, spread over it {:.3}",
            spread / mean
        );
    }
}
