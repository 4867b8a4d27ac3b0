//! Bands of wavelengths: their mean against closed forms, each ray's own wavelength in lens and pixel, and bytes.

use glam::{DVec2, DVec3};
use quadpixel::em::PixelStack;
use quadpixel::lens::Lens;
use quadpixel::render::truth::{DisparityField, WhiteField};
use quadpixel::render::{Camera, Execution, Render, RenderSettings};
use quadpixel::response::{AngularResponse, Provenance, Response, ResponseAxes, ResponseMeta};
use quadpixel::scene::Scene;
use quadpixel::sensor::MovingFrame;
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::simd::SimdLevel;
use quadpixel::spectrum::{Bands, ChannelWavelengths};

use super::shots::{self, PHONE, focused, on_threads, shoot, white};
use super::{card, geometric};

/// ∫ π a²/(a² + z²): what [`bare`] sees of its disk where it absorbs all.
const DISK_SR: f64 = std::f64::consts::PI * 16.0 / 116.0;

fn bands(bands: Bands) -> ChannelWavelengths {
    ChannelWavelengths::from_bands(bands).unwrap()
}

/// A pixel of `subpixels` that share p(λ) evenly, whatever the direction.
fn even(subpixels: Subpixels, nm: Vec<f64>, p: impl Fn(f64) -> f64) -> Response {
    let count = subpixels.count();
    let at = |nm: &f64| vec![(p(*nm) / count as f64) as f32; 9 * count];
    let table = nm.iter().flat_map(at).collect();
    let meta = ResponseMeta {
        model: "made-up".into(),
        settings: Provenance::Imported {
            file: "made up".into(),
            symmetric: false,
        },
        pixel: PixelStack::builtin("1.6um").unwrap(),
        pitch_um: 2.0,
        subpixels,
        frame: MovingFrame::new(1.5, 3.0).unwrap(),
        key: String::new(),
        shift_grid: None,
        chief_ray_shifts: None,
        corrections: Vec::new(),
        charge: Default::default(),
    };
    let axes = ResponseAxes {
        wavelengths_nm: nm,
        shifts_um: vec![[0.0, 0.0]],
        u: vec![-1.0, 0.0, 1.0],
        v: vec![-1.0, 0.0, 1.0],
    };
    Response::Table(AngularResponse::new(axes, meta, table).unwrap())
}

/// A bare pixel that sees a disk of radius 4 mm, 10 mm away.
fn bare(response: &Response, side: usize, wavelengths: ChannelWavelengths) -> Camera {
    shots::bare(response, (side, side), [4.0, 10.0], wavelengths)
}

fn banded(lens: &Lens, response: &Response, place: DVec2, w: ChannelWavelengths) -> Camera {
    let sensor = Sensor::new(2.0, response.subpixels(), (24, 20), place).unwrap();
    Camera::new(lens, sensor, ShiftRule::ChiefRay, response, w).unwrap()
}

#[test]
fn a_response_linear_in_wavelength_gives_its_value_at_each_bands_middle() {
    // Between two nodes the table is linear. 4096 rays of a smooth integrand: below 1e-3, as in `radiometry`;
    // wavelengths rounded by 0.05 nm of 165 nm at least: 3e-4.
    let p = |nm: f64| (nm - 300.0) / 500.0;
    let one = Subpixels::new(1, 1).unwrap();
    let response = even(one, vec![380.0, 720.0], p);
    for count in [1, 3, 4] {
        let of = Bands {
            wavelengths: count,
            ..Bands::default()
        };
        let camera = bare(&response, 1, bands(of));
        let e = shoot(&camera, &white(), 4096, 3).image;
        for (channel, &middle) in of.middle_nm.iter().enumerate() {
            let e = f64::from(e.mosaic.pixel(0, 0)[channel]);
            let exact = DISK_SR * p(middle);
            assert!(
                (e / exact - 1.0).abs() < 1.3e-3,
                "{count}, {channel}: {e} {exact}"
            );
        }
    }
}

#[test]
fn a_response_quadratic_in_wavelength_converges_to_the_band_integral() {
    // ∫ f(λ) ((λ − λ₀)/150 nm)² dλ = (w/150 nm)² (1/3 − 2/π²); M wavelengths leave out the variance within their
    // shares, 10.5 % (M = 4) and 1.1 % (M = 16) of it; rounding to 0.1 nm and 8192 rays add 0.3 %.
    let p = |nm: f64| ((nm - 550.0) / 150.0).powi(2);
    let nm = (440..=660).map(f64::from).collect();
    let response = even(Subpixels::new(1, 1).unwrap(), nm, p);
    let exact = DISK_SR * 0.36 * (1.0 / 3.0 - 2.0 / std::f64::consts::PI.powi(2));
    let missing = |wavelengths| {
        let of = Bands {
            middle_nm: [550.0; 3],
            width_nm: [90.0; 3],
            wavelengths,
        };
        let e = shoot(&bare(&response, 1, bands(of)), &white(), 8192, 3).image;
        1.0 - f64::from(e.mosaic.pixel(0, 0)[1]) / exact
    };
    let (coarse, fine) = (missing(4), missing(16));
    assert!((0.102..0.108).contains(&coarse), "{coarse}");
    assert!((0.008..0.014).contains(&fine), "{fine}");
}

#[test]
fn few_rays_over_many_wavelengths_stay_unbiased() {
    // The pixel absorbs the first of four wavelengths alone: a quarter of the light, though 6 rays cannot be parted
    // evenly.
    let of = bands(Bands::default());
    let nm = of.traced_nm(1);
    let first = nm[0];
    let response = even(Subpixels::new(1, 1).unwrap(), nm, |nm| {
        f64::from(u8::from(nm == first))
    });
    let image = shoot(&bare(&response, 64, of), &white(), 6, 3).image.mosaic;
    let values: Vec<f64> = image.data().chunks(3).map(|p| f64::from(p[1])).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let error = (mean - DISK_SR / 4.0) / (variance / n).sqrt();
    assert!(error.abs() < 4.0, "{error} standard errors");
}

#[test]
fn a_bands_image_lies_where_the_images_of_its_wavelengths_do_on_average() {
    // Lateral colour: the flux-weighted mean column of a small card in focus, off the axis. 1024 rays per pixel leave
    // some 0.001 px.
    let lens = focused(PHONE, 400.0);
    let response = geometric(1, 1, 2.0);
    let place = DVec2::new(1.4, 0.0);
    let of = Bands {
        middle_nm: [500.0; 3],
        width_nm: [200.0; 3],
        wavelengths: 4,
    };
    let camera = banded(&lens, &response, place, bands(of));
    let chief = quadpixel::lens::chief_ray(camera.system(1), place.x, place.y).unwrap();
    let ray = quadpixel::lens::trace_backward(
        camera.system(1),
        quadpixel::rays::Ray {
            origin_mm: quadpixel::frames::camera_from_sensor_mm(place, camera.sensor_z_mm()),
            direction: chief.direction,
        },
    )
    .unwrap();
    let depth = 400.0;
    let at = ray.origin_mm + (-depth - ray.origin_mm.z) / ray.direction.z * ray.direction;
    let scene = Scene::new(vec![card(at, 1.5, None)], [0.0; 3]);
    let moments = |camera: &Camera, channel: usize| {
        let image = shoot(camera, &scene, 1024, 7).image.sum();
        let (mut flux, mut first) = (0.0, 0.0);
        for y in 0..image.height() {
            for x in 0..image.width() {
                let e = f64::from(image.pixel(x, y)[channel]);
                (flux, first) = (flux + e, first + e * x as f64);
            }
        }
        (flux, first)
    };
    let channel = 1;
    let whole = moments(&camera, channel);
    let alone: Vec<(f64, f64)> = (bands(of).traced_nm(channel).into_iter())
        .map(|nm| {
            let line = Bands {
                middle_nm: [nm; 3],
                width_nm: [0.0; 3],
                wavelengths: 1,
            };
            moments(&banded(&lens, &response, place, bands(line)), channel)
        })
        .collect();
    let sum = alone.iter().fold((0.0, 0.0), |s, a| (s.0 + a.0, s.1 + a.1));
    let centre = |m: (f64, f64)| m.1 / m.0;
    let spread = (centre(alone[0]) - centre(alone[3])).abs();
    assert!(spread > 0.03, "no lateral colour to speak of: {spread}");
    let off = (centre(whole) - centre(sum)).abs();
    assert!(off < 0.006, "{off} px of {spread}");
    assert!(
        (4.0 * whole.0 / sum.0 - 1.0).abs() < 5e-3,
        "{whole:?} {sum:?}"
    );
}

#[test]
fn one_wavelength_a_channel_and_one_table_give_the_lines_bytes() {
    let lens = focused(PHONE, 400.0);
    let quad = Subpixels::new(2, 2).unwrap();
    let response = even(quad, vec![550.0], |_| 0.7);
    let line = Bands {
        width_nm: [0.0; 3],
        wavelengths: 1,
        ..Bands::default()
    };
    let place = DVec2::new(1.0, 0.5);
    let scene = Scene::new(
        vec![card(DVec3::new(-80.0, -40.0, -300.0), 15.0, None)],
        [0.3; 3],
    );
    let of = |w| {
        let camera = banded(&lens, &response, place, w);
        let field = DisparityField::new(&camera, 1).unwrap();
        let mut shift = vec![DVec2::ZERO; 4];
        field.traced_px(place, 300.0, &mut shift);
        (
            shoot(&camera, &scene, 48, 5),
            WhiteField::new(&camera).middle_sr(),
            shift,
        )
    };
    let (a, b) = (of(bands(line)), of(ChannelWavelengths::default()));
    assert!(a.0.image == b.0.image && a.0.stats == b.0.stats);
    assert_eq!((a.1, a.2), (b.1, b.2));
}

#[test]
fn the_white_field_is_that_of_the_bands() {
    // As the white wall's own test: 4096 and 1024 rays of a smooth integrand, 5e-3.
    let response = even(Subpixels::new(2, 2).unwrap(), vec![380.0, 720.0], |nm| {
        nm / 800.0
    });
    let place = DVec2::new(0.8, -0.3);
    let lens = focused(PHONE, f64::INFINITY);
    let sensor = Sensor::new(2.0, response.subpixels(), (2, 2), place).unwrap();
    let of = bands(Bands::default());
    let camera = Camera::new(&lens, sensor, ShiftRule::ChiefRay, &response, of).unwrap();
    let field = WhiteField::new(&camera).middle_sr();
    let image = shoot(&camera, &white(), 4096, 3).image.sum();
    for (channel, white) in field.into_iter().enumerate() {
        let e = f64::from(image.pixel(1, 1)[channel]);
        assert!((e / white - 1.0).abs() < 5e-3, "{channel}: {e} {white}");
    }
    // Red is absorbed more: 610/465.
    assert!(
        (field[0] / field[2] / (610.0 / 465.0) - 1.0).abs() < 0.02,
        "{field:?}"
    );
}

#[test]
fn bands_keep_their_bytes_at_any_thread_count_and_from_kept_rays() {
    let lens = focused(PHONE, 400.0);
    let response = even(Subpixels::new(2, 2).unwrap(), vec![400.0, 700.0], |nm| {
        nm / 800.0
    });
    let camera = banded(
        &lens,
        &response,
        DVec2::new(1.0, 0.5),
        bands(Bands::default()),
    );
    let scene = Scene::new(
        vec![card(DVec3::new(0.0, 0.0, -900.0), 2000.0, None)],
        [0.2; 3],
    );
    let settings = RenderSettings {
        rays_per_pixel: 50,
        seed: 11,
    };
    let shot = |threads: usize, simd: SimdLevel| {
        let execution = Execution { simd };
        on_threads(threads, || {
            Render::new(&camera, &scene, &settings)
                .execution(execution)
                .run()
        })
    };
    let reference = shot(1, SimdLevel::Scalar);
    let other = shot(3, SimdLevel::detect());
    assert!(other.image == reference.image && other.stats == reference.stats);
    let kept = Render::new(&camera, &scene, &settings).run_recorded();
    let (_, record) = kept.unwrap();
    assert!(record.develop(&camera).unwrap().image == reference.image);
    let lines = banded(
        &lens,
        &response,
        DVec2::new(1.0, 0.5),
        ChannelWavelengths::default(),
    );
    let refused = record.develop(&lines).unwrap_err().to_string();
    assert!(refused.contains("wavelengths"), "{refused}");
}
