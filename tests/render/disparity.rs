use glam::{DVec2, DVec3};
use quadpixel::image::Image;
use quadpixel::render::truth::{Defocus, DisparityField};
use quadpixel::render::{Camera, disparity_ratio, disparity_ratio_in};
use quadpixel::scene::Scene;
use quadpixel_datasets::RatioField;

use super::shots::{PHONE, bare, camera, focused, shoot};
use super::{card, geometric};

/// Column and row of the centroid of the green channel.
fn centroid(image: &Image) -> DVec2 {
    let (mut sum, mut total) = (DVec2::ZERO, 0.0);
    for y in 0..image.height() {
        for x in 0..image.width() {
            let w = f64::from(image.pixel(x, y)[1]);
            sum += w * DVec2::new(x as f64, y as f64);
            total += w;
        }
    }
    sum / total
}

/// The place of a small bright card in each view minus its place in the sum, px, and the card's place in the sum.
fn measured(camera: &Camera, centre_mm: DVec3, side_mm: f64) -> (Vec<DVec2>, DVec2) {
    let scene = Scene::new(vec![card(centre_mm, side_mm, None)], [0.0; 3]);
    let image = shoot(camera, &scene, 4096, 1).image;
    let reference = centroid(&image.sum());
    let shifts = (0..image.subpixels.count())
        .map(|i| centroid(&image.view(i)) - reference)
        .collect();
    (shifts, reference)
}

#[test]
fn a_near_point_lies_farther_right_in_the_left_view() {
    let lens = focused(PHONE, 1000.0);
    let camera = camera(&lens, &geometric(2, 1, 5.0), (48, 48), DVec2::ZERO);
    let (near, _) = measured(&camera, DVec3::new(0.0, 0.0, -100.0), 0.2);
    let (far, _) = measured(&camera, DVec3::new(0.0, 0.0, -20_000.0), 40.0);
    assert!(near[0].x - near[1].x > 1.0, "near: {near:?}");
    assert!(far[0].x - far[1].x < -0.5, "far: {far:?}");
    assert!(near[0].y.abs() < 0.05);
}

#[test]
fn the_photographers_right_and_up_are_stored_right_and_up() {
    let lens = focused(PHONE, 300.0);
    let camera = camera(&lens, &geometric(1, 1, 1.0), (64, 64), DVec2::ZERO);
    let (_, place) = measured(&camera, DVec3::new(2.0, 1.0, -300.0), 0.4);
    assert!(place.x > 33.0 && place.y < 30.0, "{place:?}");
}

#[test]
fn rendered_shifts_are_the_traced_disparity_on_and_off_axis() {
    let lens = focused(PHONE, 500.0);
    for (place, depth) in [
        (DVec2::ZERO, 150.0),
        (DVec2::ZERO, 3000.0),
        (DVec2::new(1.2, 0.8), 200.0),
    ] {
        let camera = camera(&lens, &geometric(2, 2, 5.0), (40, 40), place);
        let field = DisparityField::new(&camera, 1).unwrap();
        // A card about 5 px wide where the window's middle looks at that depth.
        let system = camera.system(1);
        let pupil = camera.pupil_at(place).unwrap();
        let origin = quadpixel::frames::camera_from_sensor_mm(place, system.sensor_z_mm);
        let ray = quadpixel::rays::Ray {
            origin_mm: origin,
            direction: (pupil.centre_mm - origin).normalize(),
        };
        let ray = quadpixel::lens::trace_backward(system, ray).unwrap();
        let centre = ray.origin_mm + (-depth - ray.origin_mm.z) / ray.direction.z * ray.direction;
        let (shifts, reference) = measured(&camera, centre, 5.0 * depth * 2e-3 / 4.2);
        let mut told = vec![DVec2::ZERO; 4];
        field.traced_px(
            camera.sensor().position_mm(reference.x, reference.y),
            depth,
            &mut told,
        );
        for (i, (m, t)) in shifts.iter().zip(&told).enumerate() {
            // A card of finite size in pixels of finite size: a hundredth of a pixel is what centroids are good for.
            assert!(
                m.distance(*t) < 0.02 + 0.01 * t.length(),
                "{place} {depth}: sub-pixel {i}: image {m}, truth {t}"
            );
        }
    }
}

#[test]
fn half_disk_disparity_is_four_over_three_pi_of_the_circle_of_confusion() {
    // Each half of an evenly filled disk of diameter d has its centroid 4/(3π) · d/2 from the middle: x_L − x_R = 0.424
    // d.
    let lens = focused("lib_double_gauss_100mm_glass", 5000.0);
    let response = geometric(2, 1, 2.0);
    let camera = camera(&lens, &response, (4, 4), DVec2::ZERO);
    let field = DisparityField::new(&camera, 1).unwrap();
    let defocus = Defocus::new(&camera).unwrap();
    for depth in [2000.0, 20_000.0, f64::INFINITY] {
        let mut shift = vec![DVec2::ZERO; 2];
        field.paraxial_px(DVec2::ZERO, depth, &mut shift);
        let coc = defocus.circle_of_confusion_mm(depth) / camera.sensor().pitch_mm();
        let ratio = (shift[0].x - shift[1].x) / -coc;
        assert!(
            (ratio - 4.0 / (3.0 * std::f64::consts::PI)).abs() < 0.005,
            "{depth}: {ratio}"
        );
        // This lens is nearly free of aberrations at F/5: the traced value is near the paraxial one.
        let mut traced = vec![DVec2::ZERO; 2];
        field.traced_px(DVec2::ZERO, depth, &mut traced);
        let difference = (traced[0].x - shift[0].x).abs();
        assert!(
            difference < 0.06 * coc.abs() + 3.0,
            "{depth}: traced {traced:?}, paraxial {shift:?}"
        );
    }
}

#[test]
fn the_ratio_of_disparity_to_defocus_is_that_of_half_disks_and_needs_no_scene() {
    let half_disk = 4.0 / (3.0 * std::f64::consts::PI);
    let lens = focused("lib_double_gauss_100mm_glass", 5000.0);
    for (m, n) in [(2, 1), (1, 2), (2, 2)] {
        let camera = camera(&lens, &geometric(m, n, 2.0), (4, 4), DVec2::ZERO);
        let ratio = disparity_ratio(&camera).unwrap();
        for (parts, field) in [(m, &ratio.left_right), (n, &ratio.top_bottom)] {
            assert_eq!(field.is_some(), parts > 1);
            for value in field.iter().flat_map(|f| &f.values) {
                // Slopes weighted by cos⁴ θ over a pupil of F/5 (0.3 %), summed over 4096 rays.
                assert!((value / half_disk - 1.0).abs() < 0.005, "{m}x{n}: {value}");
            }
        }
        assert!(camera.paraxial().is_some());
    }
    let pixels = bare(
        &geometric(2, 1, 2.0),
        (4, 4),
        [1.0, 10.0],
        Default::default(),
    );
    assert!(disparity_ratio(&pixels).is_none());
}

#[test]
fn the_ratio_is_the_paraxial_disparity_over_the_circle_of_confusion_at_any_depth_and_place() {
    let lens = focused(PHONE, 500.0);
    let place = DVec2::new(1.2, 0.8);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (40, 24), place);
    let ratio = disparity_ratio(&camera).unwrap();
    let field = DisparityField::new(&camera, 1).unwrap();
    let defocus = Defocus::new(&camera).unwrap();
    for [x, y] in [[0.0, 0.0], [19.5, 11.5], [39.0, 7.0]] {
        let at = |field: &Option<RatioField>| field.as_ref().unwrap().at([x, y], [40, 24]);
        for depth in [150.0, 3000.0, f64::INFINITY] {
            let mut d = [DVec2::ZERO; 4];
            field.paraxial_px(camera.sensor().position_mm(x, y), depth, &mut d);
            let coc = defocus.circle_of_confusion_mm(depth) / camera.sensor().pitch_mm();
            // Stored as B A over D C.
            let [b, a, d, c] = d;
            let across = 0.5 * (b.x + d.x - a.x - c.x) / -coc;
            let down = 0.5 * (b.y + a.y - d.y - c.y) / -coc;
            // 1024 rays against 4096, at nodes of other grids.
            assert!(
                (across / at(&ratio.left_right) - 1.0).abs() < 0.01,
                "{across}"
            );
            assert!((down / at(&ratio.top_bottom) - 1.0).abs() < 0.01, "{down}");
            assert!(across > 0.1 && down > 0.1);
        }
    }
}

#[test]
fn the_ratio_in_a_field_of_disparity_is_that_of_rays_at_its_nodes() {
    for (name, place) in [
        (PHONE, DVec2::new(1.2, 0.8)),
        ("lib_wide_22mm", DVec2::new(6.0, 4.0)),
    ] {
        let lens = focused(name, 500.0);
        let camera = camera(&lens, &geometric(2, 2, 5.0), (300, 200), place);
        let traced = disparity_ratio(&camera).unwrap();
        let field = DisparityField::new(&camera, 1).unwrap();
        let known = disparity_ratio_in(&camera, &field).unwrap();
        for (traced, known) in [
            (traced.left_right, known.left_right),
            (traced.top_bottom, known.top_bottom),
        ] {
            let pairs = traced
                .unwrap()
                .values
                .into_iter()
                .zip(known.unwrap().values);
            for (traced, known) in pairs {
                // By as many points through boxes' edges as either has.
                assert!(
                    (known / traced - 1.0).abs() < 2e-3,
                    "{name}: {known} {traced}"
                );
            }
        }
    }
}

#[test]
fn circle_of_confusion_is_that_of_the_cone_through_the_entrance_pupil() {
    // The cone from a point at d to the entrance pupil (diameter A) has diameter A |d − d_f|/d in the plane of focus,
    // which is imaged with the magnification of the focused depth (SPEC.md).
    for name in [
        PHONE,
        "lib_double_gauss_100mm_glass",
        "wide_US11940605B2_emb1",
    ] {
        let lens = focused(name, 700.0);
        let camera = camera(&lens, &geometric(1, 1, 1.0), (4, 4), DVec2::ZERO);
        let defocus = Defocus::new(&camera).unwrap();
        let p = camera.paraxial().unwrap();
        let (df, a) = (
            700.0 + p.entrance_pupil_z_mm,
            2.0 * p.entrance_pupil_semi_mm,
        );
        // Newton: magnification of the focused plane = f/(z_F + Z).
        let magnification = p.efl_mm / (p.front_focal_z_mm + 700.0);
        for depth in [150.0, 700.0, 1500.0, 1e9] {
            let d = depth + p.entrance_pupil_z_mm;
            let cone = a * (d - df) / d * magnification;
            let told = defocus.circle_of_confusion_mm(depth);
            assert!(
                (told - cone).abs() < 1e-9 + 1e-6 * cone.abs(),
                "{name} {depth}: {told} against {cone}"
            );
        }
    }
}

#[test]
fn paraxial_disparity_vanishes_in_focus_and_changes_sign_there() {
    let lens = focused(PHONE, 500.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (4, 4), DVec2::new(0.5, 0.0));
    let field = DisparityField::new(&camera, 1).unwrap();
    let at = |depth: f64| {
        let mut shift = vec![DVec2::ZERO; 4];
        field.paraxial_px(DVec2::new(0.5, 0.0), depth, &mut shift);
        shift[0]
    };
    assert!(at(500.0).length() < 1e-9, "{:?}", at(500.0));
    assert!(
        at(250.0).x > 0.1 && at(250.0).y > 0.1 && at(2000.0).x < -0.1,
        "{:?} {:?}",
        at(250.0),
        at(2000.0)
    );
}
