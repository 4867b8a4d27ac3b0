//! Radiance that is known exactly.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use quadpixel::image::Image;
use quadpixel::scene::world::{
    Alpha, Environment, Light, Material, PathSettings, TriangleMesh, World, WorldDescription,
};

use super::{add_at, bounces, mean, random_direction, room};

const MIDDLE: DVec3 = DVec3::new(0.0, 0.0, -200.0);

#[test]
fn a_closed_shining_room_has_the_exact_radiance_at_every_depth() {
    // Walls of emission e and reflectance ρ: paths of up to n bounces bring e (1 + ρ + … + ρⁿ).
    let (e, rho) = ([1.0f32, 0.5, 0.25], [0.8f32, 0.5, 0.2]);
    let material = Material {
        emission: e,
        ..Material::diffuse(rho)
    };
    let world = World::new(room(material)).unwrap();
    for n in [0u32, 1, 2, 3, 8] {
        let settings = bounces(n);
        for k in 0..3 {
            let origin = MIDDLE + 50.0 * random_direction(k);
            let found = mean(&world, (origin, random_direction(90 + k)), &settings, 4000);
            for c in 0..3 {
                let exact: f64 = (0..=n)
                    .map(|i| f64::from(e[c] * rho[c].powi(i as i32)))
                    .sum();
                let (value, error) = found[c];
                // Four standard errors, and f32.
                assert!(
                    (value - exact).abs() < 4.0 * error + 1e-5,
                    "{n} bounces, channel {c}: {value} ± {error}, exact {exact}"
                );
            }
        }
    }
}

#[test]
fn white_bodies_in_even_light_cannot_be_seen() {
    // Whatever returns all light shows its surroundings' radiance: each material in turn, seen from all around.
    let plastic = |roughness| Material {
        roughness,
        ..Material::default()
    };
    let bodies = [
        ("diffuse", Material::diffuse([1.0; 3]), 0.0),
        // The table of the layer's reflectance is interpolated: 0.003 a bounce, and a sphere has one.
        ("plastic 0.3", plastic(0.3), 0.004),
        ("plastic 0.9", plastic(0.9), 0.004),
        ("smooth plastic", plastic(0.0), 0.001),
        ("mirror", Material::metal([1.0; 3], 0.0), 0.0),
        ("glass", Material::glass(1.5), 0.0),
        (
            "pane",
            Material {
                thin_walled: true,
                ..Material::glass(1.5)
            },
            0.0,
        ),
        (
            "veil",
            Material {
                alpha: Alpha::Blend { alpha: 0.5 },
                ..Material::diffuse([1.0; 3])
            },
            0.0,
        ),
    ];
    for (name, material, tolerance) in bodies {
        let mut world = WorldDescription {
            materials: vec![material],
            environment: Environment::Even([2.0, 1.0, 0.5]),
            ..WorldDescription::default()
        };
        add_at(&mut world, TriangleMesh::sphere(50.0, 32, 0), MIDDLE, 0);
        // Flat facets: a shading normal that differs from the true one loses light at the rim.
        world.meshes[0].normals = None;
        let world = World::new(world).unwrap();
        // Light that total reflection keeps inside needs long paths.
        let settings = bounces(200);
        for k in 0..4 {
            let origin = MIDDLE + 150.0 * random_direction(k);
            let aim = MIDDLE + 40.0 * random_direction(40 + k);
            let found = mean(
                &world,
                (origin, (aim - origin).normalize()),
                &settings,
                2000,
            );
            for (c, exact) in [2.0, 1.0, 0.5].into_iter().enumerate() {
                let (value, error) = found[c];
                assert!(
                    (value / exact - 1.0).abs() < 4.0 * error / exact + tolerance + 1e-4,
                    "{name}, channel {c}: {value} ± {error}, exact {exact}"
                );
            }
        }
    }
}

#[test]
fn a_lambertian_sphere_under_a_sun_has_the_cosine_law() {
    // L = ρ E cos θ / π on the lit side; parallel light and a real disc (whose mean cosine differs by its angle
    // squared, 5e-6).
    for half_angle_deg in [0.0, 0.266] {
        let to_sun = DVec3::new(1.0, 2.0, 2.0).normalize();
        let mut world = WorldDescription {
            materials: vec![Material::diffuse([0.6; 3])],
            lights: vec![Light::Sun {
                direction: -3.0 * to_sun,
                irradiance: [5.0, 4.0, 3.0],
                half_angle_deg,
            }],
            ..WorldDescription::default()
        };
        add_at(&mut world, TriangleMesh::sphere(50.0, 64, 0), MIDDLE, 0);
        let world = World::new(world).unwrap();
        for k in 0..40 {
            let n = random_direction(k);
            let cos = n.dot(to_sun);
            // The rim of a disc, and of the facets, is neither lit nor dark.
            if cos.abs() < 0.1 {
                continue;
            }
            let origin = MIDDLE + 150.0 * n;
            let hit = world.first_hit(origin, -n).unwrap();
            let found = mean(&world, (origin, -n), &PathSettings::default(), 64);
            // The smooth normal is interpolated: its own cosine is what counts.
            let exact = 0.6 * 5.0 * hit.normal.dot(to_sun).max(0.0) / std::f64::consts::PI;
            assert!(hit.normal.dot(n) > 0.9999);
            assert!(
                (found[0].0 - exact).abs() < 2e-3 * exact.max(0.01),
                "{} where {exact}, cos {cos}, disc {half_angle_deg}",
                found[0].0
            );
        }
    }
}

#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    for height_mm in [50.0, 500.0, 5000.0] {
        let mut world = WorldDescription {
            materials: vec![Material::diffuse([0.5; 3])],
            lights: vec![Light::Point {
                position_mm: DVec3::new(0.0, height_mm, -300.0),
                intensity_m2: [0.2, 0.1, 0.05],
            }],
            ..WorldDescription::default()
        };
        let corner = DVec3::new(-1e4, 0.0, -1.03e4);
        let floor = TriangleMesh::rectangle(corner, DVec3::X * 2e4, DVec3::Z * 2e4, 0);
        world.add(floor, 0);
        let world = World::new(world).unwrap();
        for x_mm in [0.0, 100.0, 700.0] {
            let place = DVec3::new(x_mm, 0.0, -300.0);
            let eye = DVec3::new(30.0, 200.0, 0.0);
            let found = mean(&world, (eye, (place - eye).normalize()), &bounces(1), 4);
            let d2 = height_mm * height_mm + x_mm * x_mm;
            let exact = 0.5 / std::f64::consts::PI * 0.2 / (d2 * 1e-6) * (height_mm / d2.sqrt());
            assert!(
                (found[0].0 / exact - 1.0).abs() < 1e-4,
                "{} where {exact}: {height_mm} mm up, {x_mm} mm off",
                found[0].0
            );
        }
    }
}

#[test]
fn a_spot_is_full_within_the_inner_cone_and_dark_beyond_the_outer() {
    let mut world = WorldDescription {
        materials: vec![Material::diffuse([1.0; 3])],
        lights: vec![Light::Spot {
            position_mm: DVec3::new(0.0, 0.0, -100.0),
            direction: DVec3::NEG_Z,
            intensity_m2: [1.0; 3],
            inner_deg: 10.0,
            outer_deg: 20.0,
        }],
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-500.0, 500.0, -1100.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * 1e3, DVec3::Y * -1e3, 0),
        0,
    );
    let world = World::new(world).unwrap();
    let at = |deg: f64| {
        let angle = deg.to_radians();
        let place = DVec3::new(1000.0 * angle.tan(), 0.0, -1100.0);
        let l = mean(&world, (DVec3::ZERO, place.normalize()), &bounces(1), 4)[0].0;
        // Without the cone: cos³ of the angle at one metre.
        l * std::f64::consts::PI / angle.cos().powi(3)
    };
    assert!((at(0.0) - 1.0).abs() < 1e-3 && (at(9.0) - 1.0).abs() < 1e-3);
    let ramp = (15f64.to_radians().cos() - 20f64.to_radians().cos())
        / (10f64.to_radians().cos() - 20f64.to_radians().cos());
    assert!((at(15.0) - ramp * ramp).abs() < 1e-3);
    assert!(at(21.0) == 0.0);
}

/// Irradiance / π of a white floor that looks up (+y) at what is above it.
fn floor_under(mut world: WorldDescription) -> (f64, f64) {
    world.materials.insert(0, Material::diffuse([1.0; 3]));
    let corner = DVec3::new(-50.0, 0.0, -250.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * 100.0, DVec3::Z * 100.0, 0),
        0,
    );
    let world = World::new(world).unwrap();
    let eye = DVec3::new(20.0, 30.0, -100.0);
    let place = DVec3::new(0.0, 0.0, -200.0);
    mean(
        &world,
        (eye, (place - eye).normalize()),
        &bounces(1),
        20_000,
    )[0]
}

#[test]
fn a_square_lamp_lights_a_floor_by_its_form_factor() {
    // A parallel square of half side a at height h, on the axis: F = 4/(2π) · 2 · (X/√(1+X²)) atan(X/√(1+X²)), X = a/h
    // (J. R. Howell's catalogue, C-11... four corners), here checked against a sum over the lamp as well.
    let (a, h) = (80.0, 100.0);
    let mut world = WorldDescription {
        materials: vec![Material::emitter([3.0; 3])],
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-a, h, -200.0 - a);
    let mut lamp = TriangleMesh::rectangle(corner, DVec3::X * 2.0 * a, DVec3::Z * 2.0 * a, 1);
    // Its front looks down.
    for [_, b, c] in &mut lamp.triangles {
        std::mem::swap(b, c);
    }
    world.add(lamp, 1);
    let x: f64 = a / h;
    let root = (1.0 + x * x).sqrt();
    let form = 4.0 / std::f64::consts::PI * (x / root) * (x / root).atan();
    let (value, error) = floor_under(world);
    assert!(
        (value - 3.0 * form).abs() < 4.0 * error + 1e-4,
        "{value} ± {error}, exact {}",
        3.0 * form
    );
}

#[test]
fn a_lamp_close_to_a_floor_far_away_lights_it_by_its_form_factor() {
    // As above, 8 mm above a floor 3 m away: rounding of places is thousands of times that of their distance.
    let (a, h, far) = (5.0, 8.0, DVec3::new(300.0, -900.0, -3000.0));
    let mut world = WorldDescription {
        materials: vec![Material::emitter([3.0; 3]), Material::diffuse([0.5; 3])],
        ..WorldDescription::default()
    };
    let corner = far + DVec3::new(-a, h, -a);
    let mut lamp = TriangleMesh::rectangle(corner, DVec3::X * 2.0 * a, DVec3::Z * 2.0 * a, 0);
    for [_, b, c] in &mut lamp.triangles {
        std::mem::swap(b, c);
    }
    world.add(lamp, 1);
    let corner = far + DVec3::new(-50.0, 0.0, -50.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::Z * 100.0, DVec3::X * 100.0, 1),
        2,
    );
    let world = World::new(world).unwrap();
    let x: f64 = a / h;
    let root = (1.0 + x * x).sqrt();
    let form = 4.0 / std::f64::consts::PI * (x / root) * (x / root).atan();
    // From between lamp and floor.
    let eye = far + DVec3::new(7.0, 1.0, 0.0);
    let direction = (far - eye).normalize();
    let [(value, error), ..] = mean(&world, (eye, direction), &bounces(1), 20_000);
    let exact = 0.5 * 3.0 * form;
    assert!(
        (value - exact).abs() < 4.0 * error + 1e-3 * exact && error < 0.01 * exact,
        "{value} ± {error}, exact {exact}"
    );
}

#[test]
fn a_panorama_lights_a_floor_by_the_integral_over_its_cells() {
    // A dark sky with one bright cell and a gradient; the sum over cells is the closed form of the interpolated picture
    // within 1 %, so the map is fine and smooth.
    let (width, height) = (256, 128);
    let mut image = Image::zeros(width, height, 3);
    let radiance = |u: f64, v: f64| {
        let bump = (-((u - 0.3).powi(2) + (v - 0.2).powi(2)) / (2.0 * 0.03 * 0.03)).exp();
        50.0 * bump + 0.2 * (1.0 + (std::f64::consts::TAU * u).cos())
    };
    for y in 0..height {
        for x in 0..width {
            let l = radiance(
                (x as f64 + 0.5) / width as f64,
                (y as f64 + 0.5) / height as f64,
            );
            image.pixel_mut(x, y).fill(l as f32);
        }
    }
    // Turned about x and y: the map's up is the camera's direction (R · y).
    let camera_from_map = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_y(1.1);
    let mut exact = 0.0;
    let (fine_w, fine_h) = (4 * width, 4 * height);
    for y in 0..fine_h {
        let v = (y as f64 + 0.5) / fine_h as f64;
        let theta = v * std::f64::consts::PI;
        for x in 0..fine_w {
            let u = (x as f64 + 0.5) / fine_w as f64;
            let phi = (u - 0.5) * std::f64::consts::TAU;
            // The middle column is −z, columns go on to +x, row 0 is +y.
            let local = DVec3::new(
                theta.sin() * phi.sin(),
                theta.cos(),
                -theta.sin() * phi.cos(),
            );
            let d = camera_from_map * local;
            let solid = theta.sin()
                * (std::f64::consts::PI / fine_h as f64)
                * (std::f64::consts::TAU / fine_w as f64);
            exact += radiance(u, v) * d.y.max(0.0) * solid / std::f64::consts::PI;
        }
    }
    let world = WorldDescription {
        environment: Environment::Map {
            image: Arc::new(image),
            camera_from_map,
            scale: 1.0,
        },
        ..WorldDescription::default()
    };
    let (value, error) = floor_under(world);
    assert!(
        (value - exact).abs() < 4.0 * error + 0.01 * exact,
        "{value} ± {error}, exact {exact}"
    );
    assert!(
        error < 0.01 * exact,
        "drawn by brightness: {error} of {exact}"
    );
}

#[test]
fn light_through_a_veil_and_a_thin_pane_arrives_straight() {
    // A sun through a veil of alpha 0.25 and a pane: 0.75 × the plate's transmittance, (1 − R)/(1 + R) with R = 0.04 at
    // normal incidence.
    let to_sun = DVec3::Y;
    let mut world = WorldDescription {
        materials: vec![
            Material {
                alpha: Alpha::Blend { alpha: 0.25 },
                ..Material::diffuse([0.0; 3])
            },
            Material {
                thin_walled: true,
                ..Material::glass(1.5)
            },
        ],
        lights: vec![Light::Sun {
            direction: -to_sun,
            irradiance: [std::f32::consts::PI; 3],
            half_angle_deg: 0.0,
        }],
        ..WorldDescription::default()
    };
    for (y, material) in [(60.0, 1), (80.0, 2)] {
        let corner = DVec3::new(-310.0, y, -540.0);
        world.add(
            TriangleMesh::rectangle(corner, DVec3::X * 600.0, DVec3::Z * 600.0, material),
            1,
        );
    }
    let (value, _) = floor_under(world);
    let exact = 0.75 * (1.0 - 0.04) / (1.0 + 0.04);
    assert!((value - exact).abs() < 1e-4, "{value} where {exact}");
}
