//! A dozen small scenes that call for different effects.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use quadpixel::effects::{Effect, Shot};
use quadpixel::em::PixelStack;
use quadpixel::lens::{FocusBy, Lens, Prescription, table1_defects};
use quadpixel::render::Camera;
use quadpixel::response::{AngularResponse, Provenance, Response, ResponseAxes, ResponseMeta};
use quadpixel::sampling::uniform;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::world::{
    Environment, Light, Material, PathSettings, TriangleMesh, World, WorldDescription,
};
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::MovingFrame;
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::{Bands, ChannelWavelengths};

use super::shots::{PHONE, boxes, wave_pixel};

use Effect::{
    Aberrations, CraVariation, Dispersion, GlobalIllumination, PixelDiffraction, Vignetting,
    Wavelengths,
};

/// A scene and what `auto` is to leave out of it.
pub struct Case {
    pub name: &'static str,
    pub shot: Shot,
    pub leaves_out: Vec<Effect>,
    /// What it may leave out besides: so few rays meet the light that the estimate is noise, of either sign.
    pub by_chance: &'static [Effect],
}

/// How a camera is put together.
pub struct Make<'a> {
    pub lens: &'a str,
    pub f_number: Option<f64>,
    pub focus_mm: f64,
    pub centre: DVec2,
    pub side: usize,
    pub rule: ShiftRule,
    pub response: Response,
    pub wavelengths: ChannelWavelengths,
}

const SLOW: &str = "lib_double_gauss_100mm_glass";

impl Make<'_> {
    pub fn phone(response: Response) -> Make<'static> {
        Make {
            lens: PHONE,
            f_number: None,
            focus_mm: 500.0,
            centre: DVec2::new(1.0, 0.6),
            side: 24,
            rule: ShiftRule::ChiefRay,
            response,
            wavelengths: ChannelWavelengths::default(),
        }
    }

    /// A telephoto of a phone at f/22 on large pixels, on the axis: its colours agree, and so do its rays with
    /// first-order optics.
    pub fn simple(response: Response) -> Make<'static> {
        Make {
            lens: "tele_US10571665B2_220b",
            ..Make::slow(response)
        }
    }

    /// A long lens at f/22 on large pixels, on the axis. Its focal length, and with it the light, differs by 0.06 %
    /// from channel to channel's.
    pub fn slow(response: Response) -> Make<'static> {
        Make {
            lens: SLOW,
            f_number: Some(22.0),
            focus_mm: 3000.0,
            centre: DVec2::ZERO,
            side: 16,
            rule: ShiftRule::ChiefRay,
            response,
            wavelengths: ChannelWavelengths::default(),
        }
    }

    pub fn on_axis(self) -> Self {
        Self {
            centre: DVec2::ZERO,
            ..self
        }
    }

    fn lens(&self) -> Lens {
        let mut lens = Lens::new(&Prescription::builtin(self.lens).unwrap()).unwrap();
        if let Some(f) = self.f_number {
            lens = lens.with_f_number(f).unwrap();
        }
        lens.focused_at(self.focus_mm, FocusBy::Sensor, 550.0)
            .unwrap()
    }

    fn camera_of(&self, lens: &Lens) -> Camera {
        let r = &self.response;
        let size = (self.side, self.side);
        let sensor = Sensor::new(r.pitch_um(), r.subpixels(), size, self.centre).unwrap();
        Camera::new(lens, sensor, self.rule, r, self.wavelengths).unwrap()
    }

    pub fn camera(&self) -> Camera {
        self.camera_of(&self.lens())
    }
}

/// A card of coloured noise that fills the picture, at a multiple of the focused depth.
pub fn card(camera: &Camera, over_focus: f64, contrast: f32) -> Scene {
    let texel = |x: usize, y: usize, c: u64| {
        0.6 + contrast * (uniform(3, &[x as u64 / 2, y as u64 / 2, c]) as f32 - 0.5)
    };
    let texture = Texture::from_fn(256, 256, |x, y| [0, 1, 2].map(|c| texel(x, y, c)));
    let depth = over_focus * camera.focus_distance_mm();
    let w = camera.sensor().window_mm();
    // As a pinhole at the entrance pupil would have it; upright, so that the sensor's place is the card's.
    let scale = depth / camera.paraxial().unwrap().efl_mm;
    let side = 3.0 * scale * w.half_width + 0.1 * depth * f64::from(u8::from(w.centre.x != 0.0));
    let centre = DVec3::new(w.centre.x * scale, -w.centre.y * scale, -depth);
    let texture = Arc::new(texture.unwrap());
    let plane = TexturedPlane::new(centre, (side, side), (0.0, 0.0, 0.0), texture, None);
    Scene::new(vec![plane.unwrap()], [0.6; 3])
}

/// A floor and a wall of the given reflectance under a sun, before the camera.
fn corner_in_the_sun(camera: &Camera, reflectance: f32) -> Scene {
    let depth = camera.focus_distance_mm();
    let mut world = WorldDescription {
        materials: vec![Material::diffuse([reflectance; 3])],
        lights: vec![Light::Sun {
            direction: DVec3::new(0.2, -1.0, -1.0),
            irradiance: [3.0; 3],
            half_angle_deg: 0.0,
        }],
        environment: Environment::Even([0.0; 3]),
        ..WorldDescription::default()
    };
    let wall = TriangleMesh::rectangle(
        DVec3::new(-depth, -depth, -1.2 * depth),
        DVec3::X * 2.0 * depth,
        DVec3::Y * 2.0 * depth,
        0,
    );
    let floor = TriangleMesh::rectangle(
        DVec3::new(-depth, -0.02 * depth, -0.5 * depth),
        DVec3::X * 2.0 * depth,
        DVec3::Z * -depth,
        0,
    );
    world.add(wall, 1);
    world.add(floor, 2);
    Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    )
}

/// An undivided pixel that absorbs 60 % from everywhere: ideal but for its loss, which the exposure takes up.
fn even_pixel(pitch_um: f64, height_um: f64) -> Response {
    let axis = vec![-0.8, -0.4, 0.0, 0.4, 0.8];
    let meta = ResponseMeta {
        model: "made up".into(),
        settings: Provenance::Imported {
            file: "made up".into(),
            symmetric: false,
        },
        pixel: PixelStack::builtin("1.6um").unwrap(),
        pitch_um,
        subpixels: Subpixels::SINGLE,
        frame: MovingFrame::new(1.5, height_um).unwrap(),
        key: String::new(),
        shift_grid: None,
        chief_ray_shifts: None,
        corrections: Vec::new(),
        charge: Default::default(),
    };
    let axes = ResponseAxes {
        wavelengths_nm: vec![550.0],
        shifts_um: vec![[0.0, 0.0]],
        u: axis.clone(),
        v: axis,
    };
    Response::Table(AngularResponse::new(axes, meta, vec![0.6; 25]).unwrap())
}

fn on_card(name: &'static str, make: &Make<'_>, over_focus: f64, leaves_out: &[Effect]) -> Case {
    let camera = make.camera();
    let scene = card(&camera, over_focus, 1.0);
    Case {
        name,
        shot: Shot { camera, scene },
        leaves_out: leaves_out.to_vec(),
        by_chance: &[],
    }
}

fn in_the_sun(
    name: &'static str,
    make: &Make<'_>,
    reflectance: f32,
    leaves_out: &[Effect],
) -> Case {
    let camera = make.camera();
    let scene = corner_in_the_sun(&camera, reflectance);
    Case {
        name,
        shot: Shot { camera, scene },
        leaves_out: leaves_out.to_vec(),
        by_chance: &[],
    }
}

/// Calls for everything that it has.
pub fn demanding() -> Case {
    let make = Make::phone(boxes(2, 2, 2.8, 7.0));
    on_card(
        "phone, quad pixel, off the axis, out of focus",
        &make,
        0.7,
        &[],
    )
}

/// Calls for next to nothing.
pub fn simple() -> Case {
    let leaves_out = [CraVariation, Dispersion, Aberrations, Vignetting];
    on_card(
        "f/22, large pixels, on the axis",
        &Make::simple(boxes(1, 1, 40.0, 40.0)),
        1.0,
        &leaves_out,
    )
}

/// All of them. The first calls for everything that it has, the second for next to nothing.
pub fn all() -> Vec<Case> {
    let quad = || boxes(2, 2, 2.8, 7.0);
    let wide = || boxes(1, 1, 40.0, 40.0);
    let mut defective = Make::phone(quad());
    defective.lens = "tele_US10571665B2_220b";
    defective.centre = DVec2::ZERO;
    let perturbed = defective.lens().perturbed(&table1_defects()).unwrap();
    let perturbed_camera = defective.camera_of(&perturbed);
    vec![
        demanding(),
        simple(),
        on_card(
            "long lens at f/22, large pixels, on the axis: channels differ in light",
            &Make::slow(wide()),
            1.0,
            &[CraVariation, Aberrations, Vignetting],
        ),
        on_card(
            "the same in a far corner: lateral colour, distortion",
            &Make {
                centre: DVec2::new(12.0, 9.0),
                ..Make::slow(wide())
            },
            1.0,
            &[CraVariation],
        ),
        on_card(
            "phone, undivided wide pixels, on the axis",
            &Make::phone(boxes(1, 1, 2.8, 1.0)).on_axis(),
            1.0,
            &[CraVariation],
        ),
        on_card(
            "phone, centred microlenses",
            &Make {
                rule: ShiftRule::Centred,
                ..Make::phone(quad()).on_axis()
            },
            1.0,
            &[],
        ),
        on_card("phone, wave pixel", &Make::phone(wave_pixel()), 1.2, &[]),
        on_card(
            "f/22, pixels ideal but for their loss",
            &Make::simple(even_pixel(40.0, 60.0)),
            1.0,
            &[
                PixelDiffraction,
                CraVariation,
                Dispersion,
                Aberrations,
                Vignetting,
            ],
        ),
        on_card(
            "f/22, large pixels, four wavelengths a channel",
            &Make {
                wavelengths: ChannelWavelengths::from_bands(Bands::default()).unwrap(),
                ..Make::simple(wide())
            },
            1.0,
            &[
                CraVariation,
                Dispersion,
                Aberrations,
                Vignetting,
                Wavelengths,
            ],
        ),
        on_card(
            "f/22, quad pixels, out of focus",
            &Make::slow(boxes(2, 2, 40.0, 800.0)),
            0.8,
            &[Aberrations, Vignetting],
        ),
        Case {
            name: "folded telephoto with the paper's defects",
            shot: Shot {
                scene: card(&perturbed_camera, 1.0, 1.0),
                camera: perturbed_camera,
            },
            leaves_out: vec![],
            by_chance: &[],
        },
        in_the_sun(
            "a dark corner in the sun",
            &Make::simple(wide()),
            0.004,
            &[
                CraVariation,
                Dispersion,
                Aberrations,
                Vignetting,
                GlobalIllumination,
            ],
        ),
        in_the_sun(
            "a white corner in the sun",
            &Make::simple(wide()),
            0.8,
            &[CraVariation, Dispersion, Aberrations, Vignetting],
        ),
        in_the_sun(
            "a white corner in the sun, phone",
            &Make::phone(quad()),
            0.8,
            &[],
        ),
    ]
}
