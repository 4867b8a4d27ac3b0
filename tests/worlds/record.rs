//! Rays kept once serve other pixels: to the bit what rendering anew gives.

use quadpixel::render::{Camera, RayRecord, RecordError, Render, RenderSettings, Rendered};
use quadpixel::sensor::ShiftRule;

use super::{camera, scene};

const SETTINGS: RenderSettings = RenderSettings {
    rays_per_pixel: 48,
    seed: 9,
};

fn anew(camera: &Camera, surfaces: &[u16]) -> Rendered {
    Render::new(camera, &scene(), &SETTINGS)
        .occlusion(surfaces)
        .run()
}

#[test]
fn developing_kept_rays_equals_rendering_anew() {
    let surfaces: Vec<u16> = (0..32 * 24).map(|k| 10 + k % 3).collect();
    let quad = camera((2, 2), 15.0, ShiftRule::ChiefRay);
    let (first, record) = Render::new(&quad, &scene(), &SETTINGS)
        .occlusion(&surfaces[..])
        .run_recorded()
        .unwrap();
    assert_eq!(first.image, anew(&quad, &surfaces).image);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rays.npz");
    let about = serde_json::json!({"who": "a test"});
    record.write_npz(&path, &about).unwrap();
    let (read, said) = RayRecord::read_npz(&path).unwrap();
    assert_eq!((&read, said), (&record, about));
    // Dual, quad and 4×4 pixels, a longer microlens, centred microlenses.
    for (subpixels, focal_um, rule) in [
        ((2, 2), 15.0, ShiftRule::ChiefRay),
        ((2, 1), 15.0, ShiftRule::ChiefRay),
        ((4, 4), 21.0, ShiftRule::ChiefRay),
        ((1, 2), 12.0, ShiftRule::Centred),
    ] {
        let other = camera(subpixels, focal_um, rule);
        let new = anew(&other, &surfaces);
        let developed = read.develop(&other).unwrap();
        assert_eq!(developed.image, new.image, "{subpixels:?}");
        assert_eq!(developed.occlusion, new.occlusion);
        assert_eq!(developed.stats.rays, first.stats.rays);
    }
}

#[test]
fn rays_of_another_camera_and_broken_files_are_refused() {
    let quad = camera((2, 2), 15.0, ShiftRule::ChiefRay);
    let settings = RenderSettings {
        rays_per_pixel: 2,
        ..SETTINGS
    };
    let (_, record) = Render::new(&quad, &scene(), &settings)
        .run_recorded()
        .unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rays.npz");
    record.write_npz(&path, &serde_json::Value::Null).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for length in [0, 10, bytes.len() / 2, bytes.len() - 5] {
        std::fs::write(&path, &bytes[..length]).unwrap();
        let error = RayRecord::read_npz(&path).unwrap_err().to_string();
        assert!(error.contains("rays.npz"), "{error}");
    }
    let huge = RenderSettings {
        rays_per_pixel: 1 << 24,
        ..SETTINGS
    };
    let error = Render::new(&quad, &scene(), &huge)
        .run_recorded()
        .unwrap_err();
    assert!(matches!(error, RecordError::TooLarge { .. }));
    let far = quadpixel::sensor::Sensor::new(
        6.0,
        quad.sensor().subpixels(),
        (32, 24),
        glam::DVec2::new(0.04, 0.02),
    );
    let lens = quadpixel::lens::Prescription::builtin("wide_US20120327520A1_emb3").unwrap();
    let lens = quadpixel::lens::Lens::new(&lens)
        .unwrap()
        .focused_at(750.0, quadpixel::lens::FocusBy::Sensor, 550.0)
        .unwrap();
    let response =
        quadpixel::response::GeometricResponse::new(quad.sensor().subpixels(), 6.0, 15.0);
    let other = Camera::new(
        &lens,
        far.unwrap(),
        ShiftRule::ChiefRay,
        &quadpixel::response::Response::Geometric(response.unwrap()),
        quadpixel::spectrum::ChannelWavelengths::default(),
    )
    .unwrap();
    let error = record.develop(&other).unwrap_err().to_string();
    assert!(error.contains("centre x_mm"), "{error}");
}
