//! Objects at infinity, at the hyperfocal distance and inside the near limit; corners without light.

use glam::DVec2;
use quadpixel::lens::{FocusBy, Lens, builtin_names};
use quadpixel::render::truth::{Defocus, DisparityField};
use quadpixel::render::{Camera, CameraError, RenderSettings, render};
use quadpixel::response::{GeometricResponse, Response};
use quadpixel::scene::Scene;
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;

use crate::{PHONE, builtin};

fn pixel() -> Response {
    Response::Geometric(GeometricResponse::new(Subpixels::DUAL_X, 2.0, 5.0).unwrap())
}

fn camera(lens: &Lens, size: (usize, usize), centre: DVec2) -> Result<Camera, CameraError> {
    let response = pixel();
    let sensor = Sensor::new(2.0, response.subpixels(), size, centre).unwrap();
    let bands = ChannelWavelengths::default();
    Camera::new(lens, sensor, ShiftRule::ChiefRay, &response, bands)
}

/// Focused at the hyperfocal distance H, infinity and H/2 (counted from the entrance pupil) are blurred alike, to 1e-9
/// of the blur; the depth in focus is not, to 1e-12 mm; and the blur of 1e15 mm is that of infinity to 1e-9.
#[test]
fn blur_at_infinity_at_the_hyperfocal_distance_and_at_half_of_it() {
    for name in [PHONE, "lib_dgauss_50mm", "tele_US10571665B2_220b"] {
        let lens = builtin(name);
        let p = lens.paraxial(550.0).unwrap();
        // f²/(N c) for a blur of 2 µm, from the entrance pupil.
        let from_pupil = p.efl_mm * p.efl_mm / (p.f_number * 2e-3);
        let focus = from_pupil - p.entrance_pupil_z_mm;
        let focused = lens.focused_at(focus, FocusBy::Sensor, 550.0).unwrap();
        let camera = camera(&focused, (8, 8), DVec2::ZERO).unwrap();
        let defocus = Defocus::new(&camera).unwrap();
        let coc = |depth: f64| defocus.circle_of_confusion_mm(depth);
        let infinity = coc(f64::INFINITY);
        let half = coc(0.5 * from_pupil - p.entrance_pupil_z_mm);
        assert!((infinity / 2e-3 - 1.0).abs() < 0.05, "{name}: {infinity}");
        assert!(
            (infinity + half).abs() < 1e-9 * infinity,
            "{name}: {infinity} {half}"
        );
        assert!(coc(focus).abs() < 1e-12, "{name}: {}", coc(focus));
        assert!((coc(1e15) / infinity - 1.0).abs() < 1e-9, "{name}");
        let field = DisparityField::new(&camera, 1).unwrap();
        let (mut at, mut near) = ([DVec2::ZERO; 2], [DVec2::ZERO; 2]);
        field.traced_px(DVec2::ZERO, f64::INFINITY, &mut at);
        field.traced_px(DVec2::ZERO, 1e15, &mut near);
        assert!(
            (at[0] - near[0]).length() < 1e-9 && at[0].is_finite(),
            "{name}: {at:?}"
        );
    }
}

/// Inside the near limit every lens refuses; 1 µm beyond it focuses, with a finite sensor.
#[test]
fn inside_the_near_limit() {
    for name in builtin_names() {
        let lens = builtin(name);
        let p = lens.paraxial(550.0).unwrap();
        let sensor_limit = -p.front_focal_z_mm;
        for inside in [sensor_limit - 1e-3, -1e9, f64::NAN, f64::NEG_INFINITY] {
            let error = lens.focused_at(inside, FocusBy::Sensor, 550.0);
            assert!(error.is_err(), "{name} at {inside}");
        }
        let near = lens.focused_at(sensor_limit + 1e-3, FocusBy::Sensor, 550.0);
        assert!(near.unwrap().sensor_z_mm().is_finite(), "{name}");
        let lens_limit = 3.0 * p.efl_mm - p.front_principal_z_mm;
        for (distance, allowed) in [(lens_limit - 1e-3, false), (lens_limit + 1e-3, true)] {
            let focused = lens.focused_at(distance, FocusBy::Lens, 550.0);
            assert_eq!(focused.is_ok(), allowed, "{name} at {distance}");
        }
    }
}

/// A window that reaches out of the image circle is refused with the dark place; one just inside is rendered: finite, 0
/// or more, and no corner brighter than the middle.
#[test]
fn a_vignetted_corner() {
    let lens = builtin(PHONE);
    let (mut lit, mut dark) = (0.5, 6.0);
    // To a thousandth of a millimetre.
    for _ in 0..12 {
        let place = 0.5 * (lit + dark);
        match camera(&lens, (16, 16), DVec2::splat(place)) {
            Ok(_) => lit = place,
            Err(CameraError::OutsideImageCircle { height_mm, .. }) => {
                assert!(height_mm > place);
                dark = place;
            }
            Err(other) => panic!("{other}"),
        }
    }
    let camera_at = |place: f64| camera(&lens, (16, 16), DVec2::splat(place)).unwrap();
    let settings = RenderSettings {
        rays_per_pixel: 64,
        seed: 1,
    };
    let white = Scene::new(Vec::new(), [1.0; 3]);
    let shot = |c: &Camera| render(c, &white, &settings).image.sum();
    let (corner, middle) = (shot(&camera_at(lit)), shot(&camera_at(0.0)));
    let brightest = middle.data().iter().cloned().fold(0.0, f32::max);
    assert!(
        corner
            .data()
            .iter()
            .all(|x| x.is_finite() && *x >= 0.0 && *x <= brightest)
    );
}
