//! `qpgen render --scene FILE`: a recipe from a scene file and a few arguments.

use crate::exit::CommandError;
use crate::number::number;
use clap::Args;
use quadpixel::effects::{Choice, Tolerance};
use quadpixel::lens::ReflectionSettings;
use quadpixel::render::{LensTracing, RenderSettings};
use quadpixel::scene::world::PathSettings;
use quadpixel::sensor::{MicrolensLaw, ShiftRule, Subpixels};
use quadpixel_datasets::Registration;

use quadpixel::em::Level;
use quadpixel_generators::recipe::{
    LensRecipe, Recipe, ResponseSource, SensorRecipe, TableRecipe, WindowRecipe,
};
use quadpixel_generators::scenes::{FileWorld, WorldRecipe, WorldSource};

/// A scene file before a lens. Everything else than the file has a default.
#[derive(Args)]
pub struct SceneArgs {
    /// Scene to render instead of a recipe: .gltf, .glb (metres) or .obj with its .mtl.
    #[arg(
        long = "scene",
        id = "scene_file",
        value_name = "FILE",
        conflicts_with = "scene"
    )]
    pub file: Option<String>,
    /// Main lens: a name of `qpgen lens list`, or a .json, .zmx or .seq file.
    #[arg(
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value = "wide_US20120327520A1_emb3"
    )]
    lens: String,
    /// Depth in focus, mm from the first lens vertex.
    #[arg(
        value_parser = number,
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value_t = 750.0
    )]
    focus_mm: f64,
    /// Stops the lens down to this F-number, such as 4; absent: wide open.
    #[arg(value_parser = number, long, requires = "scene_file", conflicts_with = "scene")]
    f_number: Option<f64>,
    /// Number of microlenses, columns x rows, such as 640x480.
    #[arg(
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value = "512x384"
    )]
    size: String,
    /// Pitch of the microlenses, µm; absent: as --pixel has it, or 8 for the ideal box.
    #[arg(value_parser = number, long, requires = "scene_file", conflicts_with = "scene")]
    pitch_um: Option<f64>,
    /// Sub-pixels below each microlens: 1x1, 2x1, 1x2, 2x2, 3x3, 4x4 (columns x rows).
    #[arg(
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value = "2x2"
    )]
    subpixels: Subpixels,
    /// Pixel of the wave-optics response, a built-in name or .toml file; absent: the ideal box.
    #[arg(long, requires = "scene_file", conflicts_with = "scene")]
    pixel: Option<String>,
    /// Rays per microlens and colour channel.
    #[arg(
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value_t = 128
    )]
    rays_per_pixel: usize,
    /// Seed of the rays.
    #[arg(
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value_t = 1
    )]
    seed: u64,
    /// Length of the file's unit, mm; absent: 1000 (glTF's metre).
    #[arg(value_parser = number, long, requires = "scene_file", conflicts_with = "scene")]
    unit_mm: Option<f64>,
    /// Name of a camera of the file to look from; absent: the first one, or --distance-mm.
    #[arg(
        long = "scene-camera",
        value_name = "NAME",
        requires = "scene_file",
        conflicts_with = "scene"
    )]
    scene_camera: Option<String>,
    /// Puts the middle of everything at this depth on the axis, mm; absent (and no camera in the file): in focus.
    #[arg(value_parser = number, long, requires = "scene_file", conflicts_with = "scene")]
    distance_mm: Option<f64>,
    /// Scales everything so that the longest side of its box has this length, mm; absent: as it is.
    #[arg(value_parser = number, long, requires = "scene_file", conflicts_with = "scene")]
    size_mm: Option<f64>,
    /// Turns the scene about the upright axis, deg: positive shows more of its left side.
    #[arg(
        value_parser = number,
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    yaw_deg: f64,
    /// Turns the scene about the horizontal axis, deg: positive shows it from above.
    #[arg(
        value_parser = number,
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pitch_deg: f64,
    /// Equirectangular panorama (.exr, .hdr) that lights it.
    #[arg(long, requires = "scene_file", conflicts_with = "scene")]
    panorama: Option<String>,
    /// Even radiance of the surroundings, or factor on the panorama; absent: 1 where nothing in the file shines,
    /// else 0.
    #[arg(long, requires = "scene_file", conflicts_with = "scene")]
    sky: Option<f32>,
    /// Largest number of surfaces that a path of light may meet.
    #[arg(long, requires = "scene_file", conflicts_with = "scene", default_value_t = PathSettings::default().max_bounces)]
    max_bounces: u32,
    /// Exposure in stops (0: a white wall of radiance 1 gives a sum of 1); absent: so that 95 % of the picture is below
    /// 0.8.
    #[arg(
        value_parser = number,
        long,
        requires = "scene_file",
        conflicts_with = "scene",
        allow_negative_numbers = true
    )]
    pub exposure_ev: Option<f64>,
}

/// Columns and rows of `--size`.
///
/// # Errors
/// Words that are none.
pub fn size(text: &str) -> Result<(usize, usize), CommandError> {
    let side = |text: &str| text.parse().ok().filter(|n| (1..=1 << 16).contains(n));
    let sides = text.split_once('x');
    sides
        .and_then(|(w, h)| Some((side(w)?, side(h)?)))
        .ok_or_else(|| CommandError::input(format!("--size is {text}; allowed: such as 640x480")))
}

impl SceneArgs {
    /// The recipe of a scene file. Its exposure is 0 where it is to be found.
    ///
    /// # Errors
    /// A size that is none, an unknown pixel, a file that cannot be read.
    pub fn recipe(&self, file: &str) -> Result<Recipe, CommandError> {
        let (width, height) = size(&self.size)?;
        let pixel_pitch = self
            .pixel
            .as_ref()
            .map(|name| quadpixel_generators::assemble::pixel(name))
            .transpose()?
            .map_or(8.0, |pixel| pixel.pitch_um);
        let world = FileWorld {
            unit_mm: self.unit_mm,
            camera: self.scene_camera.clone(),
            distance_mm: self.distance_mm,
            size_mm: self.size_mm,
            yaw_deg: self.yaw_deg,
            pitch_deg: self.pitch_deg,
            panorama: self.panorama.clone(),
            sky: self.sky,
            ..FileWorld::new(file)
        };
        let world = FileWorld {
            blake3: Some(world.hash()?),
            ..world
        };
        Ok(Recipe {
            camera_pictures: None,
            lens: LensRecipe {
                name: self.lens.clone(),
                focal_length_mm: None,
                // Infinity is absent in a recipe; what is no number is refused there.
                focus_mm: (self.focus_mm != f64::INFINITY).then_some(self.focus_mm),
                f_number: self.f_number,
                misalignments: Vec::new(),
                deviations: Vec::new(),
                reflections: ReflectionSettings::default(),
                focus_error_um: 0.0,
            },
            sensor: SensorRecipe {
                pitch_um: self.pitch_um.unwrap_or(pixel_pitch),
                subpixels: self.subpixels,
                width,
                height,
                window: WindowRecipe::Centre,
                microlens_shift: ShiftRule::ChiefRay,
                microlens_offset_um: [0.0; 2],
                microlens_law: MicrolensLaw::default(),
                mosaic: None,
            },
            response: match &self.pixel {
                Some(pixel) => ResponseSource::Simulated(TableRecipe::new(Level::default(), pixel)),
                None => ResponseSource::Ideal {
                    focal_length_um: None,
                },
            },
            spectrum: None,
            planes: Vec::new(),
            world: Some(WorldRecipe {
                source: WorldSource::File(world),
                paths: PathSettings {
                    max_bounces: self.max_bounces,
                    ..PathSettings::default()
                },
            }),
            rgbd: None,
            framing_focus_mm: None,
            environment: [0.0; 3],
            exposure_ev: self.exposure_ev.unwrap_or(0.0),
            footprints: true,
            lens_tracing: LensTracing::default(),
            registration: Registration::default(),
            render: RenderSettings {
                rays_per_pixel: self.rays_per_pixel,
                seed: self.seed,
            },
            effects: Choice::default(),
            tolerance: Tolerance::default(),
            readout: None,
        })
    }
}
