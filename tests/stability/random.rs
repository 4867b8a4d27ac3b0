//! Invariants on random lenses, stacks, poses, pictures and directions: finite, 0 ≤ P, Σ P ≤ 1, energy, determinism.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};
use proptest::prelude::*;
use quadpixel::em::PixelStack;
use quadpixel::em::multilayer::{FlatStack, Polarization};
use quadpixel::em::wave::{WaveModel, WaveSettings};
use quadpixel::lens::PupilEllipse;
use quadpixel::lens::{OpticalSystem, PacketTracer, trace_backward, trace_forward};
use quadpixel::rays::RaySlices;
use quadpixel::rays::{Ray, RayBatch};
use quadpixel::render::{Camera, RenderSettings, render};
use quadpixel::response::{GeometricResponse, Response};
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Hits, NO_SURFACE, Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, Subpixels};
use quadpixel::simd::SimdLevel;
use quadpixel::spectrum::ChannelWavelengths;
use rustfft::num_complex::Complex64;

use crate::support::{asphere, conic, stop, system, tilted};

/// One to four elements of random shape, a stop before them, every surface a little out of place.
fn lenses() -> impl Strategy<Value = OpticalSystem> {
    let surface = (
        -0.5..0.5f64,
        -3.0..1.0f64,
        -0.02..0.02f64,
        -0.03..0.03f64,
        -0.03..0.03f64,
    );
    let element = (surface.clone(), surface, 1.4..1.9f64);
    prop::collection::vec(element, 1..4).prop_map(|elements| {
        let mut surfaces = vec![stop(-0.2, 0.8)];
        let mut z = 0.0;
        for (front, back, n) in elements {
            for ((c, k, a4, tip, tilt), indices) in [(front, (1.0, n)), (back, (n, 1.0))] {
                let mut s = tilted(asphere(conic(z, c, k, indices), &[0.0, a4]), tip, tilt);
                s.aperture.semi_mm = 1.2;
                surfaces.push(s);
                z += 0.9;
            }
        }
        system(surfaces, z + 3.0)
    })
}

fn unit(n: f64) -> impl Strategy<Value = f64> {
    -n..n
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// A ray that passes is finite and of unit length (1e-12), comes back along itself (1e-8), and is the packets' ray
    /// (1e-9), at every SIMD level to the last bit.
    #[test]
    fn rays_through_random_lenses(lens in lenses(), x in unit(1.0), y in unit(1.0), dx in unit(0.4), dy in unit(0.4)) {
        let ray = Ray { origin_mm: DVec3::new(x, y, -3.0), direction: DVec3::new(dx, dy, 1.0).normalize() };
        let tracer = PacketTracer::new(&lens);
        let packet = |level| {
            let mut batch = RayBatch::default();
            batch.push(ray.origin_mm, ray.direction);
            tracer.trace_forward(&mut batch, level);
            batch.get(0)
        };
        let fast = packet(SimdLevel::detect());
        prop_assert_eq!(fast, packet(SimdLevel::Scalar));
        if let Ok(end) = trace_forward(&lens, ray) {
            prop_assert!(end.origin_mm.is_finite() && (end.direction.length() - 1.0).abs() < 1e-12);
            let fast = fast.unwrap();
            prop_assert!((fast.origin_mm - end.origin_mm).length() < 1e-9);
            prop_assert!((fast.direction - end.direction).length() < 1e-9);
            if end.direction.z > 0.05
                && let Ok(back) = trace_backward(&lens, Ray { direction: -end.direction, ..end })
            {
                prop_assert!((back.direction + ray.direction).length() < 1e-8);
                prop_assert!((back.origin_mm - ray.origin_mm).cross(ray.direction).length() < 1e-8);
            }
        } else {
            prop_assert!(fast.is_err());
        }
    }

    /// Of a flat stack: reflected + entering = 1 to 1e-11, no layer gives light back, nothing is negative.
    #[test]
    fn light_in_random_flat_stacks(
        layers in prop::collection::vec((1.0..4.5f64, 0.0..2.0f64, 0.0..3.0f64), 0..8),
        below in (1.0..5.0f64, 0.0..3.0f64), sine in unit(0.999), nm in 350.0..1100.0f64, s in any::<bool>(),
    ) {
        let stack = FlatStack {
            above: 1.0,
            layers: layers.into_iter().map(|(n, k, d)| (Complex64::new(n, k), d)).collect(),
            below: Complex64::new(below.0, below.1),
        };
        let p = stack.solve(nm, sine, if s { Polarization::S } else { Polarization::P }).unwrap();
        prop_assert!((0.0..=1.0 + 1e-12).contains(&p.reflected));
        prop_assert!((p.reflected + p.entering[0] - 1.0).abs() < 1e-11, "{:?}", p);
        prop_assert!(p.entering.windows(2).all(|w| w[1] <= w[0] + 1e-11), "{:?}", p);
        prop_assert!(p.transmitted() >= -1e-12);
    }

    /// A ray that is said to meet a card at a distance is there on the card; the card in any pose.
    #[test]
    fn cards_in_random_poses(
        place in (unit(50.0), unit(50.0), 1.0..1000.0f64), size in (0.1..100.0f64, 0.1..100.0f64),
        turns in (unit(79.0), unit(79.0), unit(180.0)), aim in (unit(0.5), unit(0.5)),
    ) {
        let centre = DVec3::new(place.0, place.1, -place.2);
        let texture = Arc::new(Texture::from_fn(1, 1, |_, _| [1.0]).unwrap());
        let card = TexturedPlane::new(centre, size, turns, texture, None).unwrap();
        let turn: DMat3 = TexturedPlane::orientation(turns);
        let on_card = centre + turn * DVec3::new(aim.0 * size.0, aim.1 * size.1, 0.0);
        let origin = DVec3::new(0.3, -0.2, 0.0);
        let direction = (on_card - origin).normalize();
        let mut batch = RayBatch::default();
        batch.push(origin, direction);
        let mut hits = Hits::default();
        Scene::new(vec![card], [0.0; 3]).intersect(RaySlices::from_batch(&batch), &mut hits);
        let along = direction.dot(turn * DVec3::Z).abs();
        // Edges belong to the card but for rounding; a ray in its plane meets it at no certain place.
        if along > 1e-3 && on_card.z < -0.01 && aim.0.abs() < 0.499 && aim.1.abs() < 0.499 {
            prop_assert_ne!(hits.surface[0], NO_SURFACE);
            let met = origin + hits.distance_mm[0] * direction;
            prop_assert!((met - on_card).length() < 1e-9 * (1.0 + on_card.length() / along), "{} {}", met, on_card);
            prop_assert!((f64::from(hits.cards.s[0]) - 0.5 - aim.0).abs() < 1e-5);
            prop_assert!((f64::from(hits.cards.t[0]) - 0.5 + aim.1).abs() < 1e-5);
        }
    }

    /// Between texels a picture is between its texels.
    #[test]
    fn random_pictures_are_read_between_their_texels(
        texels in prop::collection::vec(0.0..1e6f32, 12), s in 0.0..=1.0f32, t in 0.0..=1.0f32,
    ) {
        let texture = Texture::from_fn(4, 3, |x, y| [texels[4 * y + x]]).unwrap();
        let low = texels.iter().cloned().fold(f32::MAX, f32::min);
        let high = texels.iter().cloned().fold(0.0, f32::max);
        let value = texture.sample_channel(s, t, 0);
        prop_assert!(value >= low * (1.0 - 1e-6) && value <= high * (1.0 + 1e-6), "{}", value);
    }

    /// The ideal pixel under any microlens shift: each direction goes to one sub-pixel or none.
    #[test]
    fn random_directions_on_ideal_pixels(
        which in 0..6usize, focal in 0.1..20.0f64, shift in (unit(5.0), unit(5.0)), u in unit(1.0), v in unit(1.0),
    ) {
        let ideal = GeometricResponse::new(Subpixels::SIMULATED[which], 2.0, focal).unwrap();
        let lookup = Response::Geometric(ideal).at(550.0);
        let mut p = vec![-1.0; Subpixels::SIMULATED[which].count()];
        lookup.weights_under([shift.0, shift.1], &mut [u as f32], &mut [v as f32], &mut p);
        prop_assert!(p.iter().all(|p| *p == 0.0 || *p == 1.0) && p.iter().sum::<f32>() <= 1.0, "{:?}", p);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// A random picture before bare pixels: finite, 0 or more, no more light than an even wall of its brightest texel,
    /// and the same again.
    #[test]
    fn renders_of_random_pictures(
        texels in prop::collection::vec(0.0..100.0f32, 16), rays in 1..40usize, seed in any::<u64>(),
    ) {
        let response = Response::Geometric(GeometricResponse::new(Subpixels::QUAD, 2.0, 3.0).unwrap());
        let sensor = Sensor::new(2.0, Subpixels::QUAD, (5, 3), DVec2::ZERO).unwrap();
        let target = PupilEllipse { centre_mm: DVec3::new(0.1, 0.0, -4.0), axis_a_mm: DVec2::X, axis_b_mm: DVec2::Y };
        let camera = Camera::bare(sensor, &response, ChannelWavelengths::default(), target).unwrap();
        let texture = Arc::new(Texture::from_fn(4, 4, |x, y| [texels[4 * y + x]]).unwrap());
        let card = TexturedPlane::new(DVec3::new(0.0, 0.0, -9.0), (3.0, 3.0), (10.0, 5.0, 3.0), texture, None).unwrap();
        let scene = Scene::new(vec![card], [0.0; 3]);
        let settings = RenderSettings { rays_per_pixel: rays, seed };
        let shot = |scene| render(&camera, scene, &settings).image.mosaic;
        let (image, again) = (shot(&scene), shot(&scene));
        prop_assert_eq!(image.data(), again.data());
        let brightest = texels.iter().cloned().fold(0.0, f32::max) * 1.000_01;
        let wall = shot(&Scene::new(Vec::new(), [brightest; 3]));
        for (a, b) in image.data().iter().zip(wall.data()) {
            prop_assert!(a.is_finite() && *a >= 0.0 && a <= b, "{} {}", a, b);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    /// Pixels of random layers, by the wave level: no part is negative, all parts together are the light that came in
    /// (1e-9). Pixels as small as these, below the wavelength, are hard: what the lens, the layers and the silicon find
    /// or lose before that is up to 0.17 (of 72,000 such pixels).
    #[test]
    fn plane_waves_on_random_pixels(
        pitch in 0.6..1.4f64, lens in 1.05..2.0f64, filter in 0.0..1.0f64,
        u in unit(0.5), v in unit(0.5), nm in 420.0..680.0f64,
    ) {
        let radius = pitch * std::f64::consts::FRAC_1_SQRT_2 * lens;
        let stack = PixelStack::paper(pitch, radius, radius, filter);
        let settings = WaveSettings { tolerance: 2e-3, ..WaveSettings::draft() };
        let model = WaveModel::new(&stack, nm, &settings).unwrap();
        let p = model.solve(u, v).unwrap();
        let mean = &p.mean;
        let absorbed: f64 = mean.absorbed.iter().sum();
        prop_assert!(mean.absorbed.iter().all(|p| *p >= 0.0) && absorbed <= 1.0 + 1e-9, "{:?}", p);
        let parts = [mean.reflected, mean.transmitted, mean.elsewhere];
        prop_assert!(parts.iter().all(|p| *p >= -1e-12), "{:?}", p);
        prop_assert!((mean.balance() - 1.0).abs() < 1e-9, "{:?}", p);
        prop_assert!(p.imbalance.abs() < 0.25, "{:?}", p);
    }
}
