//! Scenes whose light calls for effects: points, small stops, wide fields, colour. All see diffraction at the lens.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::effects::{Effect, Shot};
use quadpixel::render::Camera;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::spectrum::{Bands, ChannelWavelengths};

use super::scenes::{Case, Make, card};
use super::shots::{boxes, wave_pixel_at};

use Effect::{Aberrations, CraVariation, Dispersion, LensDiffraction, Vignetting, Wavelengths};

/// A white square of a third of a pixel in the dark, on the axis, at a multiple of the focused depth.
pub fn point(camera: &Camera, over_focus: f64) -> Scene {
    let depth = over_focus * camera.focus_distance_mm();
    let pixel = camera.sensor().pitch_mm() * depth / camera.paraxial().unwrap().efl_mm;
    let texture = Arc::new(Texture::from_fn(2, 2, |_, _| [1.0; 3]).unwrap());
    let centre = DVec3::new(0.0, 0.0, -depth);
    let side = (0.34 * pixel, 0.34 * pixel);
    let plane = TexturedPlane::new(centre, side, (0.0, 0.0, 0.0), texture, None);
    Scene::new(vec![plane.unwrap()], [1e-3; 3])
}

/// A card of one hue after another that fills the picture, in focus.
fn hues(camera: &Camera) -> Scene {
    let depth = camera.focus_distance_mm();
    let w = camera.sensor().window_mm();
    let side = 3.0 * w.half_width * depth / camera.paraxial().unwrap().efl_mm;
    let hue = |x: usize, y: usize, c: usize| if (x / 8 + y / 8) % 3 == c { 0.9 } else { 0.1 };
    let texture = Texture::from_fn(96, 96, |x, y| [0, 1, 2].map(|c| hue(x, y, c)));
    let texture = Arc::new(texture.unwrap());
    let centre = DVec3::new(0.0, 0.0, -depth);
    let plane = TexturedPlane::new(centre, (side, side), (0.0, 0.0, 0.0), texture, None);
    Scene::new(vec![plane.unwrap()], [0.5; 3])
}

fn bands(width_nm: f64, wavelengths: usize) -> ChannelWavelengths {
    let bands = Bands {
        width_nm: [width_nm; 3],
        wavelengths,
        ..Bands::default()
    };
    ChannelWavelengths::from_bands(bands).unwrap()
}

fn case(
    name: &'static str,
    make: &Make<'_>,
    scene: impl FnOnce(&Camera) -> Scene,
    leaves_out: &[Effect],
) -> Case {
    let camera = make.camera().with_lens_diffraction();
    let scene = scene(&camera);
    Case {
        name,
        shot: Shot { camera, scene },
        leaves_out: leaves_out.to_vec(),
        by_chance: &[],
    }
}

/// All of them.
pub fn all() -> Vec<Case> {
    let quad = || boxes(2, 2, 2.8, 7.0);
    let small = |make: Make<'static>| Make { side: 12, ..make };
    let (four, narrow) = (bands(90.0, 4), bands(10.0, 2));
    vec![
        case(
            "phone, a point of light in focus",
            &small(Make::phone(boxes(1, 1, 1.6, 1.0)).on_axis()),
            |camera| point(camera, 1.0),
            &[CraVariation],
        ),
        case(
            "phone, a point of light out of focus",
            &small(Make::phone(quad()).on_axis()),
            |camera| point(camera, 0.8),
            &[],
        ),
        Case {
            by_chance: &[Aberrations, Vignetting],
            ..case(
                "f/22, a point of light on small pixels",
                &small(Make::simple(boxes(1, 1, 4.0, 4.0))),
                |camera| point(camera, 1.0),
                &[CraVariation],
            )
        },
        case(
            "phone at f/11, a card in focus",
            &small(Make {
                f_number: Some(11.0),
                ..Make::phone(quad())
            }),
            |camera| card(camera, 1.0, 1.0),
            &[],
        ),
        case(
            "f/22, large pixels, a faint card",
            &small(Make::simple(boxes(1, 1, 40.0, 40.0))),
            |camera| card(camera, 1.0, 0.01),
            &[
                LensDiffraction,
                CraVariation,
                Dispersion,
                Aberrations,
                Vignetting,
            ],
        ),
        case(
            "a field of 80 degrees, far off the axis",
            &small(Make {
                lens: "wide_deeplens_cellphone80deg",
                centre: DVec2::new(1.6, 1.2),
                ..Make::phone(quad())
            }),
            |camera| card(camera, 1.0, 1.0),
            &[],
        ),
        case(
            "a wide phone, in the corner, out of focus",
            &small(Make {
                lens: "wide_US11940605B2_emb1",
                centre: DVec2::new(1.5, 1.1),
                ..Make::phone(boxes(2, 1, 2.0, 4.0))
            }),
            |camera| card(camera, 0.6, 1.0),
            &[],
        ),
        case(
            "phone, coloured card, four wavelengths a channel, a pixel of its own at each",
            &small(Make {
                wavelengths: four,
                ..Make::phone(wave_pixel_at(four.all_response_nm())).on_axis()
            }),
            hues,
            &[CraVariation],
        ),
        case(
            "f/22, coloured card, bands of 10 nm",
            &small(Make {
                wavelengths: narrow,
                ..Make::simple(boxes(1, 1, 40.0, 40.0))
            }),
            hues,
            &[CraVariation, Aberrations, Vignetting, Wavelengths],
        ),
        case(
            "phone, a point of light, bands of 90 nm",
            &small(Make {
                wavelengths: four,
                ..Make::phone(boxes(2, 2, 2.8, 7.0)).on_axis()
            }),
            |camera| point(camera, 1.0),
            &[],
        ),
    ]
}
