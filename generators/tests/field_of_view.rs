//! Windows by chief-ray angle, and cards that fill what a window sees.

// because tests fail by panicking
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use quadpixel::render::{RenderSettings, render};
use quadpixel_generators::assemble::{Responses, camera, scene};
use quadpixel_generators::recipe::Recipe;

/// A recipe with a window and the text of its cards.
fn recipe(lens: &str, window: &str, planes: &str) -> Recipe {
    let text = format!(
        r#"
        environment = [50, 50, 50]
        {planes}
        [lens]
        {lens}
        [sensor]
        pitch_um = 3.0
        subpixels = "2x2"
        width = 24
        height = 16
        window = {window}
        [response]
        model = "geometric"
        [render]
        rays_per_pixel = 64
        seed = 1
        "#
    );
    toml::from_str(&text).unwrap()
}

const PHONE: &str = "name = \"wide_US20120327520A1_emb3\"\nfocus_mm = 500";

#[test]
fn a_window_at_a_chief_ray_angle_has_that_angle_and_azimuth() {
    let recipe = recipe(
        PHONE,
        "{ at = \"chief-ray-angle\", theta_deg = 10, phi_deg = 45 }",
        "planes = []",
    );
    let response = Responses::new().get(&recipe, &|_, _| ()).unwrap();
    let camera = camera(&recipe, &response).unwrap();
    let centre = camera.sensor().centre_mm();
    assert!((camera.chief_ray_angle_deg(centre).unwrap() - 10.0).abs() < 1e-6);
    // Behind an exit pupil in front of the sensor light travels away from the axis: the azimuth is that of the place.
    assert!((centre.y.atan2(centre.x).to_degrees() - 45.0).abs() < 1e-9);
}

#[test]
fn a_filling_card_is_all_that_the_window_sees_tilted_or_not_near_or_far() {
    // The environment is a hundred times brighter than the card: one ray past the card would show.
    let tele = "name = \"tele_US10571665B2_220b\"\nfocus_mm = 2000";
    for (lens, window) in [
        (PHONE, "{ at = \"centre\" }"),
        (PHONE, "{ at = \"position\", x_mm = 1.2, y_mm = -0.9 }"),
        (tele, "{ at = \"position\", x_mm = -1.0, y_mm = 0.5 }"),
    ] {
        for (distance, tilts) in [
            (120.0, (0.0, 0.0, 0.0)),
            (3000.0, (40.0, -25.0, 10.0)),
            (600.0, (-55.0, 0.0, 80.0)),
        ] {
            let planes = format!(
                "planes = [{{ chart = {{ kind = \"constant\", color = [0.5, 0.5, 0.5] }}, texture_px = 4, distance_mm = {distance}, \
                 tilt_x_deg = {}, tilt_y_deg = {}, roll_deg = {} }}]",
                tilts.0, tilts.1, tilts.2
            );
            let recipe = recipe(lens, window, &planes);
            let response = Responses::new().get(&recipe, &|_, _| ()).unwrap();
            let camera = camera(&recipe, &response).unwrap();
            // Diffraction sees past the card, and so do ghosts.
            let camera = camera.without_lens_diffraction().unwrap();
            let camera = camera.without_reflections().unwrap();
            let scene = scene(&recipe, &camera).unwrap();
            let settings = RenderSettings {
                rays_per_pixel: 256,
                seed: 1,
            };
            let seen = render(&camera, &scene, &settings).image.sum();
            let brightest = seen.data().iter().copied().fold(0.0, f32::max);
            // Radiance 0.5 over the solid angle of an F/2.5 lens is 0.06; one ray of the environment adds 50/256 of
            // that.
            assert!(
                brightest > 0.01 && brightest < 0.065,
                "{lens} {window} {distance} {tilts:?}: {brightest}"
            );
        }
    }
}
