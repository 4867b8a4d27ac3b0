//! Worlds through a lens: the same scene as a card, the same bytes at any number of threads, the clamp.

use std::sync::Arc;

use glam::{DAffine3, DVec2, DVec3};
use quadpixel::render::truth::{SightRays, WhiteField};
use quadpixel::render::{Camera, Render, RenderSettings};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::world::{
    Encoding, Light, Material, PathSettings, TextureMap, TextureRef, TriangleMesh, World,
    WorldDescription, Wrap,
};
use quadpixel::scene::{NO_SURFACE, Scene, TexturedPlane};

use super::shots::{self, PHONE, boxes, focused, on_threads, shoot};
use super::{bounces, mean};

fn camera(side: usize) -> Camera {
    let lens = focused(PHONE, 750.0);
    shots::camera(&lens, &boxes(2, 2, 60.0, 150.0), (side, side), DVec2::ZERO)
}

#[test]
fn a_shining_rectangle_is_the_same_picture_as_a_card() {
    // Same rays, same texture lookups up to f32; so the images agree far below their noise. Rows of the picture tell
    // mirroring and turning apart.
    let picture = Texture::from_fn(64, 64, |x, y| {
        [0.2 + x as f32 / 64.0, 0.1 + y as f32 / 64.0, 0.5]
    })
    .unwrap();
    let picture = Arc::new(picture);
    let (side, z) = (900.0, -750.0);
    let card = TexturedPlane::new(
        DVec3::new(0.0, 0.0, z),
        (side, side),
        (0.0, 0.0, 0.0),
        picture.clone(),
        None,
    )
    .unwrap();
    let cards = Scene::new(vec![card], [0.0; 3]);
    let mut world = WorldDescription {
        textures: vec![TextureMap::from_texture(&picture, [Wrap::Clamp; 2])],
        materials: vec![Material {
            emission_texture: Some(TextureRef::new(0)),
            ..Material::emitter([1.0; 3])
        }],
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-0.5 * side, 0.5 * side, z);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * side, DVec3::Y * -side, 0),
        7,
    );
    let world = Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    );
    let camera = camera(24);
    let (a, b) = (shoot(&camera, &cards, 64, 5), shoot(&camera, &world, 64, 5));
    assert_eq!(a.stats.rays, b.stats.rays);
    for (x, y) in a.image.mosaic.data().iter().zip(b.image.mosaic.data()) {
        assert!((x - y).abs() < 1e-4 * x.abs().max(0.01), "{x} and {y}");
    }
    let chief = SightRays::chief_rays(&camera);
    let (flat, deep) = (
        chief.geometry(&camera, &cards),
        chief.geometry(&camera, &world),
    );
    for i in 0..24 * 24 {
        assert!((flat.depth_mm.data()[i] - deep.depth_mm.data()[i]).abs() < 1e-3);
        assert_eq!(
            (flat.surfaces[i] == NO_SURFACE, deep.surfaces[i]),
            (false, 7)
        );
    }
    let white = WhiteField::new(&camera);
    let settings = RenderSettings {
        rays_per_pixel: 16,
        seed: 1,
    };
    let [a, b] = [&cards, &world].map(|s| chief.target(&camera, s, &white, &settings));
    for (x, y) in a.data().iter().zip(b.data()) {
        assert!((x - y).abs() < 1e-4 * x.abs().max(0.01), "{x} and {y}");
    }
}

#[test]
fn a_path_traced_picture_has_the_same_bytes_at_any_number_of_threads() {
    let mut world = WorldDescription::cornell_box();
    world.lights.push(Light::Point {
        position_mm: DVec3::new(0.0, 0.0, -650.0),
        intensity_m2: [0.01; 3],
    });
    let scene = Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    );
    let camera = camera(20);
    let of = |threads: usize| on_threads(threads, || shoot(&camera, &scene, 8, 5).image);
    let one = of(1);
    assert!(one.mosaic.data().iter().any(|x| *x > 0.0));
    assert_eq!(one.mosaic, of(2).mosaic);
    assert_eq!(one.mosaic, of(5).mosaic);
}

#[test]
fn the_clamp_only_takes_light_away_and_is_off_by_default() {
    assert_eq!(PathSettings::default().clamp, None);
    let world = World::new(WorldDescription::cornell_box()).unwrap();
    let ray = (DVec3::ZERO, DVec3::new(0.1, -0.15, -1.0).normalize());
    let free = mean(&world, ray, &bounces(8), 500);
    let cut = PathSettings {
        clamp: Some(0.2),
        ..bounces(8)
    };
    let cut = mean(&world, ray, &cut, 500);
    for c in 0..3 {
        assert!(cut[c].0 <= free[c].0 && cut[c].0 <= 0.2 + 1e-6);
    }
}

#[test]
fn a_texture_far_away_is_filtered_to_its_mean() {
    // A checkerboard of 1024² texels within a few pixels: with a pixel's spread a single path sees grey, with none
    // black or white.
    let texels = (0..1024 * 1024)
        .map(|i| {
            let white = (i % 1024 + i / 1024) % 2 == 0;
            [if white { 255 } else { 0 }; 4].map(|v: u8| v.max(1))
        })
        .collect();
    let map = TextureMap::from_rgba8((1024, 1024), texels, Encoding::Linear, [Wrap::Repeat; 2]);
    let mut world = WorldDescription {
        textures: vec![map.unwrap()],
        materials: vec![Material {
            emission_texture: Some(TextureRef::new(0)),
            ..Material::emitter([1.0; 3])
        }],
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-50.0, 50.0, -1000.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * 100.0, DVec3::Y * -100.0, 0),
        0,
    );
    let world = World::new(world).unwrap();
    // The row's middle: v · 1024 = 433.5.
    let sample = |spread: f32, k: u32| {
        let d = DVec3::new(0.0123 + 1.01e-5 * f64::from(k), 0.007_666, -1.0).normalize();
        let key = quadpixel::scene::world::PathKey {
            key: 1,
            number: k,
            spread,
        };
        world.radiance_along(DVec3::ZERO, d, &PathSettings::default(), &key)[0]
    };
    let spread_of = |spread: f32| {
        let l: Vec<f32> = (0..64).map(|k| sample(spread, k)).collect();
        l.iter().fold(0.0f32, |m, x| m.max((x - 0.5).abs()))
    };
    assert!(spread_of(0.0) > 0.3);
    assert!(spread_of(1e-3) < 0.02, "{}", spread_of(1e-3));
}

#[test]
fn a_slanted_texture_is_blurred_along_the_view_and_not_across_it() {
    // A floor seen at 8°, a texel per mm: the cone of a ray is 4 mm wide there and 28 mm long. Stripes of 16 mm along
    // the view keep what a filter of 4 mm leaves of them: sinc(1/4) of the box times sinc²(1/4) of the interpolation,
    // 0.73. Stripes across it lose all but about sinc(28/16) = 0.13.
    let contrast = |is_across: bool| {
        let stripes = Texture::from_fn(1024, 1024, |x, y| {
            let place = if is_across { y } else { x };
            [0.5 + 0.5 * (std::f32::consts::TAU * (place as f32 + 0.5) / 16.0).cos()]
        });
        let map = TextureMap::from_texture(&stripes.unwrap(), [Wrap::Repeat; 2]);
        let mut world = WorldDescription {
            textures: vec![map],
            materials: vec![Material {
                emission_texture: Some(TextureRef::new(0)),
                two_sided: true,
                ..Material::emitter([1.0; 3])
            }],
            ..WorldDescription::default()
        };
        let corner = DVec3::new(-512.0, -100.0, -1212.0);
        world.add(
            TriangleMesh::rectangle(corner, DVec3::X * 1024.0, DVec3::Z * 1024.0, 0),
            0,
        );
        let world = World::new(world).unwrap();
        let key = quadpixel::scene::world::PathKey {
            key: 1,
            number: 0,
            spread: 4.0 / 707.0,
        };
        let seen = (0..16).map(|k| {
            let step = f64::from(k);
            let target = match is_across {
                true => DVec3::new(0.3, -100.0, -700.0 - step),
                false => DVec3::new(step, -100.0, -700.3),
            };
            let d = target.normalize();
            world.radiance_along(DVec3::ZERO, d, &PathSettings::default(), &key)[0]
        });
        let (low, high) = seen.fold((1.0f32, 0.0f32), |(a, b), l| (a.min(l), b.max(l)));
        high - low
    };
    assert!(contrast(false) > 0.6, "{}", contrast(false));
    assert!(contrast(true) < 0.25, "{}", contrast(true));
}

/// A ball that shines in front of a grey wall.
fn lamp(radius_mm: f64, z_mm: f64) -> Scene {
    let strength = 9.0 / (radius_mm * radius_mm) as f32;
    let mut world = WorldDescription {
        materials: vec![
            Material::diffuse([0.5; 3]),
            Material::emitter([1.0, 0.75, 0.5].map(|c| strength * c)),
        ],
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-600.0, 600.0, -900.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * 1200.0, DVec3::Y * -1200.0, 0),
        1,
    );
    world.add(TriangleMesh::sphere(radius_mm, 8, 1), 2);
    if let Some(instance) = world.instances.last_mut() {
        let place = DVec3::new(1.0, -2.0, z_mm);
        instance.camera_from_mesh = DAffine3::from_translation(place);
    }
    Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    )
}

/// Mean and standard error of a picture's sum over seeds, and the variance of its values.
struct Spread {
    sum: f64,
    error: f64,
    variance: f64,
}

fn spread(pictures: &[Vec<f32>]) -> Spread {
    let count = pictures.len() as f64;
    let variance = |values: &dyn Fn(&Vec<f32>) -> f64| {
        let mean = pictures.iter().map(values).sum::<f64>() / count;
        let square: f64 = pictures.iter().map(|p| (values(p) - mean).powi(2)).sum();
        (mean, square / (count - 1.0))
    };
    let (sum, of_sum) = variance(&|p| p.iter().map(|v| f64::from(*v)).sum());
    Spread {
        sum,
        error: (of_sum / count).sqrt(),
        variance: (0..pictures[0].len())
            .map(|i| variance(&|p| f64::from(p[i])).1)
            .sum(),
    }
}

#[test]
fn rays_towards_small_lamps_take_their_speckles_and_no_light() {
    // Kept rays are drawn without those towards lamps: the plain estimator.
    const SEEDS: u64 = 24;
    let lens = focused(PHONE, 750.0);
    let camera = shots::camera(&lens, &boxes(2, 2, 2.8, 6.0), (32, 32), DVec2::ZERO);
    let blurred = Camera::clone(&camera).with_lens_diffraction();
    // Radius, depth, whether by waves, error of the plain sum and ratio of variances at most.
    for (radius_mm, z_mm, camera, plain_error, most) in [
        (0.15, -300.0, &camera, 0.015, 0.3),
        (0.15, -300.0, &blurred, 0.015, 0.6),
        (0.03, -300.0, &camera, 0.15, 0.05),
        (0.1, -750.0, &camera, 0.05, 0.8),
        (0.1, -750.0, &blurred, 0.05, 0.9),
    ] {
        let scene = lamp(radius_mm, z_mm);
        let render = |seed, keeps_rays| {
            let settings = RenderSettings {
                rays_per_pixel: 64,
                seed,
            };
            let render = Render::new(camera, &scene, &settings);
            let rendered = match keeps_rays {
                true => render.run_recorded().unwrap().0,
                false => render.run(),
            };
            rendered.image.mosaic.data().to_vec()
        };
        let [plain, aimed] = [true, false].map(|keeps_rays| {
            let pictures: Vec<_> = (1..=SEEDS).map(|seed| render(seed, keeps_rays)).collect();
            spread(&pictures)
        });
        let ratio = aimed.variance / plain.variance;
        let text = format!(
            "{radius_mm} at {z_mm}: {} ± {} and {} ± {}, variance {ratio}",
            plain.sum, plain.error, aimed.sum, aimed.error
        );
        println!("{text}");
        let off = (plain.sum - aimed.sum).abs();
        assert!(off < 4.0 * plain.error.hypot(aimed.error), "{text}");
        assert!(plain.error < plain_error * plain.sum, "{text}");
        assert!(ratio < most, "{text}");
    }
}
