use glam::{DVec2, DVec3};
use quadpixel::render::truth::{SightRays, WhiteField};
use quadpixel::render::{Render, RenderSettings};
use quadpixel::scene::coverage::Coverage;
use quadpixel::scene::{NO_SURFACE, Scene};

use super::shots::{PHONE, camera, focused, shoot};
use super::{card, geometric};

#[test]
fn depth_is_along_the_axis_and_distance_along_the_line_of_sight() {
    let lens = focused(PHONE, 500.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (33, 33), DVec2::new(1.0, 0.6));
    let scene = Scene::new(
        vec![card(DVec3::new(0.0, 0.0, -800.0), 3000.0, None)],
        [0.0; 3],
    );
    let truth = SightRays::chief_rays(&camera).geometry(&camera, &scene);
    for (&z, &d) in truth.depth_mm.data().iter().zip(truth.distance_mm.data()) {
        assert!((z - 800.0).abs() < 1e-3 && d > 800.0 / 0.98, "{z} {d}");
    }
    assert!(truth.surfaces.iter().all(|&s| s == 0));
}

#[test]
fn nothing_met_is_the_sky_at_infinity() {
    let lens = focused(PHONE, 500.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (9, 9), DVec2::ZERO);
    let truth = SightRays::chief_rays(&camera).geometry(&camera, &Scene::new(Vec::new(), [0.5; 3]));
    assert!(truth.depth_mm.data().iter().all(|d| *d == f32::INFINITY));
    assert!(truth.surfaces.iter().all(|&s| s == NO_SURFACE));
}

#[test]
fn in_focus_the_sum_is_the_target_and_an_even_wall_is_equal_everywhere() {
    let lens = focused(PHONE, 500.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (16, 16), DVec2::new(0.8, 0.0));
    let scene = Scene::new(
        vec![card(DVec3::new(0.0, 0.0, -500.0), 3000.0, None)],
        [0.0; 3],
    );
    let white = WhiteField::new(&camera);
    let settings = RenderSettings {
        rays_per_pixel: 16,
        seed: 2,
    };
    let target = SightRays::chief_rays(&camera).target(&camera, &scene, &white, &settings);
    let sum = shoot(&camera, &scene, 1024, 2).image.sum();
    for (a, b) in sum.data().iter().zip(target.data()) {
        assert!((a / b - 1.0).abs() < 0.01, "{a} against {b}");
    }
}

#[test]
fn occlusion_at_a_straight_edge_is_half_and_falls_to_nothing_within_the_blur() {
    // A near card covers the photographer's left half; the background is in focus, so the card's edge is blurred over
    // its circle of confusion. At the edge's own pixel the chief ray grazes the card and half of the pupil sees the
    // other surface.
    let lens = focused(PHONE, 1000.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (48, 8), DVec2::ZERO);
    let half = Coverage::new(2, vec![1, 0, 1, 0]).unwrap();
    let near = card(DVec3::new(0.0, 0.0, -150.0), 400.0, Some(half));
    let far = card(DVec3::new(0.0, 0.0, -1000.0), 3000.0, None);
    let scene = Scene::new(vec![near, far], [0.0; 3]);
    let geometry = SightRays::chief_rays(&camera).geometry(&camera, &scene);
    let settings = RenderSettings {
        rays_per_pixel: 2048,
        seed: 2,
    };
    let rendered = Render::new(&camera, &scene, &settings)
        .occlusion(&geometry.surfaces[..])
        .run();
    let map = rendered.occlusion.unwrap();
    let row: Vec<f32> = (0..48).map(|x| map.pixel(x, 4)[0]).collect();
    assert_eq!(geometry.surfaces[4 * 48], 0);
    assert_eq!(geometry.surfaces[4 * 48 + 47], 1);
    let edge = (0..48)
        .find(|&x| geometry.surfaces[4 * 48 + x] == 1)
        .unwrap();
    // The two pixels beside the edge see it from either side.
    assert!((row[edge] + row[edge - 1] - 1.0).abs() < 0.15, "{row:?}");
    assert!(row[0] < 0.01 && row[47] < 0.01, "{row:?}");
}
