//! What `meta.json` says of a sample: camera, response, exposure.

mod colours;

use glam::DVec2;
use quadpixel::em::{Level, Preset};
use quadpixel::hash::settings_hash;
use quadpixel::lens::{ElementRef, Misalignment};
use quadpixel::render::truth::DisparityField;
use quadpixel::render::{
    Camera, RenderStats, SamplingErrors, blur_rays, disparity_curves, disparity_ratio_in,
    matching_curves,
};
use quadpixel::response::{Response, ResponseLookup};
use quadpixel::sensor::ShiftRule;
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel::units::M_PER_MM;
use quadpixel_datasets as spec;

use crate::assemble;
use crate::lens_tracing;
use crate::recipe::{Recipe, RecipeError, ResponseSource, SampleId};
use crate::rgbd::RgbdRecipe;

/// Name of the scene by its content, so that the same cards in front of two cameras are one scene (and in one split).
fn scene_id(recipe: &Recipe) -> Result<String, RecipeError> {
    let hash = match (&recipe.world, &recipe.rgbd) {
        (Some(world), _) => settings_hash(world),
        (None, Some(rgbd)) => settings_hash(&(&rgbd.image, &rgbd.depth, &rgbd.meaning)),
        (None, None) => settings_hash(&(&recipe.planes, recipe.environment)),
    }
    .map_err(RecipeError::unwritten("recipe"))?;
    Ok(format!("scene-{}", &hash[..16]))
}

/// What only the renderer knows of a sample; the writer adds files, ranges and counts to make [`spec::SampleMeta`].
#[derive(Clone, Debug)]
pub struct Description {
    /// Number of the sample; its name has six digits.
    pub index: u32,
    /// Hash of the run's configuration, [`quadpixel::hash::json_hash`].
    pub configuration_blake3: String,
    /// The sample's own seed.
    pub seed: u64,
    /// The scene.
    pub scene: spec::Scene,
    /// The main lens.
    pub lens: spec::Lens,
    /// Focus.
    pub focus: spec::Focus,
    /// Sensor window and sub-pixels.
    pub sensor: spec::Sensor,
    /// Angular response.
    pub response: spec::Response,
    /// Colour channels of raw and target.
    pub channels: Vec<spec::Channel>,
    /// Exposure.
    pub exposure: spec::Exposure,
    /// Noise.
    pub noise: spec::Noise,
    /// Colours of the microlenses, where their mosaic is asked for; then the raw mosaic is a PNG of R, G, B.
    pub mosaic: Option<spec::MosaicPattern>,
    /// Camera-like pictures, where they are asked for.
    pub camera_pictures: Option<spec::CameraPictures>,
    /// Pinhole camera.
    pub intrinsics: spec::Intrinsics,
    /// Curves of the camera, for `camera.json`.
    pub curves: spec::CameraCurves,
    /// What the truth is the truth of.
    pub truth: spec::Truth,
    /// Effects simulated and left out.
    pub effects: spec::Effects,
    /// Rays a pixel and channel.
    pub rays_per_pixel: u32,
    /// Rays in all.
    pub rays: u64,
    /// Lost rays.
    pub lost: spec::LostRays,
    /// Errors that sampling leaves.
    pub errors: Option<SamplingErrors>,
    /// How rays went through the lens.
    pub lens_tracing: spec::LensTracing,
}

/// What was exposed: how light became linear values, and what became of the light.
pub(crate) struct RenderedLight<'a> {
    /// Linear value a sr of absorbed white light.
    pub gain: f64,
    /// What a white wall gives in the sum in the middle of the window, per channel, sr.
    pub white_sr: [f64; 3],
    /// Rays of the render.
    pub stats: &'a RenderStats,
    /// Whether the channels have a disparity each.
    pub channels_differ: bool,
    /// See [`curves`].
    pub curves: spec::CameraCurves,
    /// The ledger of effects.
    pub effects: spec::Effects,
    /// The readout, where there is one.
    pub noise: spec::Noise,
}

/// What `camera.json` says of disparity; `None` for bare pixels.
pub(crate) fn curves(camera: &Camera, fields: &[DisparityField]) -> Option<spec::CameraCurves> {
    let field = (fields.get(ChannelWavelengths::REFERENCE)).or(fields.first())?;
    Some(spec::CameraCurves {
        disparity_ratio: disparity_ratio_in(camera, field)?,
        disparity: disparity_curves(camera, fields)?,
        matching: matching_curves(camera)?,
        blur: blur_rays(camera).map(spec::BlurRays::rounded),
    })
}

/// Everything about a sample that is not a pixel.
///
/// # Errors
/// A lens that cannot be built, or a recipe that is not JSON.
pub(crate) fn describe(
    recipe: &Recipe,
    id: SampleId,
    camera: &Camera,
    response: &Response,
    exposed: RenderedLight<'_>,
) -> Result<Description, RecipeError> {
    let stats = exposed.stats;
    let charts = recipe.planes.iter().map(|p| p.chart.name());
    let worlds = recipe.world.iter().map(|w| w.name());
    let pictures = recipe.rgbd.iter().map(RgbdRecipe::name);
    Ok(Description {
        index: id.index,
        configuration_blake3: id.configuration_blake3,
        seed: recipe.render.seed,
        scene: spec::Scene {
            id: scene_id(recipe)?,
            charts: charts
                .chain(worlds)
                .chain(pictures)
                .map(str::to_string)
                .collect(),
            parameters: serde_json::to_value(recipe).map_err(RecipeError::unwritten("recipe"))?,
        },
        lens: lens(recipe, camera)?,
        focus: spec::Focus {
            distance_m: (camera.focus_distance_mm().is_finite())
                .then(|| camera.focus_distance_mm() * M_PER_MM),
            by: spec::FocusBy::Sensor,
        },
        sensor: sensor(recipe, camera),
        response: described_response(recipe, camera, response),
        channels: colours::channels(
            camera,
            response,
            exposed.white_sr.map(|sr| sr * exposed.gain),
        ),
        exposure: spec::Exposure {
            gain: exposed.gain,
            ev: recipe.exposure_ev,
        },
        noise: exposed.noise,
        mosaic: recipe.sensor.mosaic,
        camera_pictures: (recipe.camera_pictures.as_ref()).map(|pictures| {
            pictures.described(
                exposed.white_sr.map(|sr| sr * exposed.gain),
                recipe.sensor.subpixels.count(),
            )
        }),
        intrinsics: intrinsics(camera),
        curves: exposed.curves,
        truth: spec::Truth {
            registration: recipe.registration,
            channel: "G".to_owned(),
            channels_differ: exposed.channels_differ,
        },
        effects: exposed.effects,
        rays_per_pixel: recipe.render.rays_per_pixel as u32,
        rays: stats.rays,
        lost: spec::LostRays {
            missed: stats.lost.missed,
            vignetted: stats.lost.vignetted,
            total_internal_reflection: stats.lost.total_internal_reflection,
        },
        errors: stats.errors,
        lens_tracing: lens_tracing::described(camera, stats),
    })
}

fn lens(recipe: &Recipe, camera: &Camera) -> Result<spec::Lens, RecipeError> {
    let lens = assemble::lens(&recipe.lens)?;
    let hash =
        settings_hash(&lens.prescription().surfaces).map_err(RecipeError::unwritten("lens"))?;
    let paraxial = camera
        .paraxial()
        .unwrap_or_else(|| unreachable!("a camera with a lens"));
    let misalignment = |m: &Misalignment| spec::Misalignment {
        element: match m.element {
            ElementRef::Element(number) => spec::Element::Number(number as u32),
            ElementRef::Mirror => spec::Element::Part(spec::Part::Mirror),
        },
        dx_um: m.dx_um,
        dy_um: m.dy_um,
        dz_um: m.dz_um,
        tip_deg: m.tip_deg,
        tilt_deg: m.tilt_deg,
    };
    Ok(spec::Lens {
        name: recipe.lens.name.clone(),
        hash,
        efl_mm: paraxial.efl_mm,
        f_number: paraxial.f_number,
        misalignments: recipe.lens.misalignments.iter().map(misalignment).collect(),
    })
}

/// The response that the pictures were made with: an ideal pixel may have taken the place of a table's.
fn described_response(recipe: &Recipe, camera: &Camera, response: &Response) -> spec::Response {
    let ideal = match (camera.response(), response) {
        (ResponseLookup::Geometric(g), _) | (_, Response::Geometric(g)) => Some(g),
        _ => None,
    };
    let table = match (ideal, response) {
        (None, Response::Table(table)) => Some(table),
        _ => None,
    };
    let (model, simulated, file) = match &recipe.response {
        _ if ideal.is_some() => (Level::IDEAL.name(), None, None),
        ResponseSource::Ideal { .. } => (Level::IDEAL.name(), None, None),
        ResponseSource::Simulated(table) => (table.level.name(), Some(table.choice), None),
        ResponseSource::File { file } => ("table", None, Some(file.clone())),
    };
    let ideal_name = |um: f64| format!("ideal, focal length {um} µm");
    let focal_length_um = ideal.map(|g| g.focal_length_um());
    spec::Response {
        model: model.to_owned(),
        preset: simulated.map(|choice| match choice.preset {
            Preset::Draft => spec::TablePreset::Draft,
            Preset::Standard => spec::TablePreset::Standard,
            Preset::Reference => spec::TablePreset::Reference,
        }),
        file,
        pixel: match (table, focal_length_um) {
            (Some(table), _) => table.meta().pixel.name.clone(),
            (None, um) => um.map_or(String::new(), ideal_name),
        },
        focal_length_um,
        key: table.map(|t| t.meta().key.clone()),
        shifts: simulated.and_then(|choice| choice.shifts).map(|n| n as u32),
        colour: simulated.and_then(|choice| choice.colour),
        wavelengths_nm: table.map_or(Vec::new(), |t| t.axes().wavelengths_nm.clone()),
    }
}

fn sensor(recipe: &Recipe, camera: &Camera) -> spec::Sensor {
    let sensor = camera.sensor();
    let (width, height) = (sensor.width(), sensor.height());
    let corner = |x: usize, y: usize| {
        camera.shift_at_um(sensor.position_mm((x * (width - 1)) as f64, (y * (height - 1)) as f64))
    };
    let max_shift_um = (0..4)
        .map(|k| corner(k % 2, k / 2).length())
        .fold(0.0, f64::max);
    spec::Sensor {
        pitch_um: sensor.pitch_um(),
        subpixels: sensor.subpixels(),
        width_px: width as u32,
        height_px: height as u32,
        centre_mm: sensor.centre_mm().to_array(),
        cra_shift: spec::CraShift {
            rule: match recipe.sensor.microlens_shift {
                ShiftRule::Centred => spec::MicrolensRule::Centred,
                ShiftRule::Linear { .. } => spec::MicrolensRule::Linear,
                ShiftRule::ChiefRay => spec::MicrolensRule::ChiefRay,
            },
            max_shift_um,
        },
    }
}

/// The pinhole that the lens paraxially is.
fn intrinsics(camera: &Camera) -> spec::Intrinsics {
    let p = camera
        .paraxial()
        .copied()
        .unwrap_or_else(|| unreachable!("a camera with a lens"));
    let sensor = camera.sensor();
    let pupil_distance_mm = camera.sensor_z_mm() - p.exit_pupil_z_mm;
    let focal_px = colours::focal_mm(pupil_distance_mm, &p) / sensor.pitch_mm();
    let axis = DVec2::new((sensor.width() - 1) as f64, (sensor.height() - 1) as f64) * 0.5
        - sensor.centre_mm() / sensor.pitch_mm();
    spec::Intrinsics {
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: axis.x,
        cy_px: axis.y,
        pinhole_behind_vertex_m: p.entrance_pupil_z_mm * M_PER_MM,
        entrance_pupil_diameter_m: 2.0 * p.entrance_pupil_semi_mm * M_PER_MM,
        exit_pupil: spec::ExitPupil {
            distance_mm: pupil_distance_mm,
            diameter_mm: 2.0 * p.exit_pupil_semi_mm,
        },
    }
}
