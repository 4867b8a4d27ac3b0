use glam::{DVec2, DVec3};
use quadpixel::render::{Execution, Render, RenderSettings};
use quadpixel::scene::Scene;
use quadpixel::simd::SimdLevel;

use super::shots::{PHONE, camera, focused, on_threads, shoot};
use super::{card, geometric};

#[test]
fn bytes_do_not_depend_on_threads_or_instructions() {
    let lens = focused(PHONE, 400.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (24, 17), DVec2::new(1.0, 0.5));
    let scene = Scene::new(
        vec![
            card(DVec3::new(-80.0, -40.0, -300.0), 15.0, None),
            card(DVec3::new(0.0, 0.0, -900.0), 2000.0, None),
        ],
        [0.2, 0.3, 0.4],
    );
    let settings = RenderSettings {
        rays_per_pixel: 48,
        seed: 11,
    };
    let surfaces = vec![1; 24 * 17];
    let shot = |threads: usize, simd: SimdLevel| {
        let (execution, surfaces) = (Execution { simd }, Some(&surfaces[..]));
        on_threads(threads, || {
            Render::new(&camera, &scene, &settings)
                .execution(execution)
                .occlusion(surfaces)
                .run()
        })
    };
    let reference = shot(1, SimdLevel::Scalar);
    for (threads, simd) in [
        (1, SimdLevel::detect()),
        (2, SimdLevel::detect()),
        (7, SimdLevel::Avx2),
    ] {
        let other = shot(threads, simd);
        assert!(
            other.image == reference.image,
            "{threads} threads, {simd:?}"
        );
        assert_eq!(other.stats, reference.stats);
        assert_eq!(other.occlusion, reference.occlusion);
    }
}

#[test]
fn a_window_within_a_window_shows_the_same_scene() {
    // The inner window's middle is the outer one's: with enough rays the pictures agree within their spread.
    let lens = focused(PHONE, 400.0);
    let scene = Scene::new(
        vec![card(DVec3::new(0.0, 0.0, -400.0), 1.0, None)],
        [0.1; 3],
    );
    let shot = |size: usize| {
        let camera = camera(&lens, &geometric(2, 2, 5.0), (size, size), DVec2::ZERO);
        shoot(&camera, &scene, 2048, 5).image.sum()
    };
    let (inner, outer) = (shot(8), shot(16));
    let peak = outer.data().iter().copied().fold(0.0, f32::max);
    for (x, y) in (0..64).map(|i| (i % 8, i / 8)) {
        let (a, b) = (inner.pixel(x, y)[1], outer.pixel(x + 4, y + 4)[1]);
        assert!((a - b).abs() < 0.01 * peak, "{x} {y}: {a} against {b}");
    }
}
