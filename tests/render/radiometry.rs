use glam::{DVec2, DVec3};
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::trace_backward;
use quadpixel::rays::Ray;
use quadpixel::render::Camera;
use quadpixel::render::truth::WhiteField;

use super::shots::{PHONE, bare, camera, focused, shoot, white};
use super::{card, geometric};
use quadpixel::scene::Scene;
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;

#[test]
fn white_wall_on_the_axis_gives_pi_sin_squared_of_the_marginal_ray() {
    let lens = focused(PHONE, f64::INFINITY);
    let camera = camera(&lens, &geometric(1, 1, 1.0), (1, 1), DVec2::ZERO);
    let rendered = shoot(&camera, &white(), 4096, 3);
    for (channel, &e) in rendered.image.mosaic.pixel(0, 0).iter().enumerate() {
        let system = camera.system(channel);
        let origin = camera_from_sensor_mm(DVec2::ZERO, system.sensor_z_mm);
        let passes = |sin: f64| {
            let direction = DVec3::new(sin, 0.0, -(1.0 - sin * sin).sqrt());
            trace_backward(
                system,
                Ray {
                    origin_mm: origin,
                    direction,
                },
            )
            .is_ok()
        };
        let (mut low, mut high) = (0.0, 0.9);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if passes(middle) {
                low = middle
            } else {
                high = middle
            }
        }
        let closed_form = std::f64::consts::PI * low * low;
        let error = f64::from(e) / closed_form - 1.0;
        assert!(
            error.abs() < 2e-3,
            "channel {channel}: {e} against {closed_form}"
        );
    }
}

#[test]
fn irradiance_falls_by_the_projected_solid_angle_of_the_vignetted_pupil() {
    // Off axis: direct integration of cos θ dω over a fine grid of directions, without the pupil's ellipse.
    let lens = focused(PHONE, f64::INFINITY);
    let place = DVec2::new(1.5, 1.0);
    let camera = camera(&lens, &geometric(1, 1, 1.0), (1, 1), place);
    let rendered = shoot(&camera, &white(), 4096, 3);
    let system = camera.system(1);
    let origin = camera_from_sensor_mm(place, system.sensor_z_mm);
    let n = 1500;
    let step = 2.0 / n as f64;
    let mut sum = 0.0;
    for i in 0..n * n {
        let (u, v) = (
            (i % n) as f64 * step - 1.0 + 0.5 * step,
            (i / n) as f64 * step - 1.0 + 0.5 * step,
        );
        let w = 1.0 - u * u - v * v;
        if w > 0.2
            && trace_backward(
                system,
                Ray {
                    origin_mm: origin,
                    direction: DVec3::new(u, v, -w.sqrt()),
                },
            )
            .is_ok()
        {
            sum += step * step;
        }
    }
    let e = f64::from(rendered.image.mosaic.pixel(0, 0)[1]);
    assert!((e / sum - 1.0).abs() < 5e-3, "{e} against {sum}");
    let field = WhiteField::new(&camera).reference_sr();
    assert!(
        (field / sum - 1.0).abs() < 5e-3,
        "white field {field} against {sum}"
    );
}

#[test]
fn a_bare_pixel_sees_a_disk_by_its_projected_solid_angle() {
    // Disk of radius a at distance z on the axis: E = π a²/(a² + z²).
    let response = geometric(1, 1, 0.5);
    let camera = bare(
        &response,
        (1, 1),
        [4.0, 10.0],
        ChannelWavelengths::default(),
    );
    let e = shoot(&camera, &white(), 4096, 3).image.mosaic.pixel(0, 0)[0];
    let closed_form = std::f64::consts::PI * 16.0 / 116.0;
    assert!(
        (f64::from(e) / closed_form - 1.0).abs() < 1e-3,
        "{e} against {closed_form}"
    );
}

#[test]
fn the_sub_pixels_of_an_ideal_pixel_share_the_light_of_a_white_wall() {
    let lens = focused(PHONE, 500.0);
    let whole = camera(&lens, &geometric(1, 1, 1.0), (2, 2), DVec2::new(0.7, -0.4));
    let total = shoot(&whole, &white(), 4096, 3).image.sum();
    for (m, n) in [(2, 1), (1, 2), (2, 2), (3, 3), (4, 4)] {
        let parted = camera(&lens, &geometric(m, n, 1.0), (2, 2), DVec2::new(0.7, -0.4));
        let sum = shoot(&parted, &white(), 4096, 3).image.sum();
        for (a, b) in sum.data().iter().zip(total.data()) {
            assert!((a / b - 1.0).abs() < 1e-3, "{m}×{n}: {a} against {b}");
        }
    }
}

#[test]
fn spread_is_the_standard_deviation_over_seeds() {
    let lens = focused(PHONE, 300.0);
    let camera = camera(&lens, &geometric(2, 2, 5.0), (32, 32), DVec2::ZERO);
    // A small card far out of focus: most pixels see an edge of it.
    let scene = Scene::new(vec![card(DVec3::new(0.0, 0.0, -60.0), 1.0, None)], [0.0; 3]);
    let shot = |seed| shoot(&camera, &scene, 64, seed);
    let shots: Vec<_> = (0..12).map(shot).collect();
    let n = shots[0].image.mosaic.data().len();
    let (mut variance, mut mean) = (0.0, 0.0);
    for i in 0..n {
        let x: Vec<f64> = shots
            .iter()
            .map(|s| f64::from(s.image.mosaic.data()[i]))
            .collect();
        let m = x.iter().sum::<f64>() / x.len() as f64;
        variance += x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (x.len() - 1) as f64;
        mean += m;
    }
    let truth = (variance / n as f64).sqrt() / (mean / n as f64);
    let told = shots
        .iter()
        .map(|s| s.stats.errors.unwrap().rms_over_mean)
        .sum::<f64>()
        / shots.len() as f64;
    assert!(
        (told / truth - 1.0).abs() < 0.35,
        "told {told}, true {truth}"
    );
}

#[test]
fn microlenses_shifted_for_the_chief_ray_keep_the_views_equally_bright() {
    // The chief ray arrives at some 20° here. Under a centred microlens the bundle falls beside the middle of the
    // pixel.
    let lens = focused(PHONE, f64::INFINITY);
    let place = DVec2::new(1.3, 0.0);
    let response = geometric(2, 1, 5.0);
    let shares = |rule: ShiftRule| {
        let sensor = Sensor::new(2.0, response.subpixels(), (1, 1), place).unwrap();
        let camera = Camera::new(
            &lens,
            sensor,
            rule,
            &response,
            ChannelWavelengths::default(),
        )
        .unwrap();
        let image = shoot(&camera, &white(), 4096, 3).image;
        (image.mosaic.pixel(0, 0)[1], image.mosaic.pixel(1, 0)[1])
    };
    let (left, right) = shares(ShiftRule::ChiefRay);
    assert!((left / right - 1.0).abs() < 0.15, "{left} {right}");
    // Light travels away from the axis (u > 0 at x > 0), towards the right sub-pixel and out of the ideal box.
    let (left, right) = shares(ShiftRule::Centred);
    assert!(left < 0.2 * right || left + right < 1e-3, "{left} {right}");
    // The linear rule with the right slope does the same as the chief ray's own: s = −H t, here −5 µm · tan of the
    // chief ray.
    let tan = 0.3646; // 20.03° at 1.2911 mm, `qpgen lens info`
    let (left, right) = shares(ShiftRule::Linear {
        um_per_mm: 5.0 * tan / 1.2911,
    });
    assert!((left / right - 1.0).abs() < 0.15, "{left} {right}");
}
