//! What `meta.json` says of a sample: camera, response, exposure, effects simulated and left out.

mod colours;

use glam::DVec2;
use quadpixel::em::Level;
use quadpixel::render::{Camera, RenderStats, disparity_ratio};
use quadpixel::response::{Response, ResponseLookup};
use quadpixel::sensor::ShiftRule;
use quadpixel::units::M_PER_MM;
use quadpixel_datasets as spec;

use crate::assemble;
use crate::recipe::{Recipe, ResponseRecipe};
use crate::sample::SampleId;
use crate::writer::Description;
use quadpixel::command::CommandError;

/// Name of the scene by its content, so that the same cards in front of two cameras are one scene (and in one split).
fn scene_id(recipe: &Recipe) -> Result<String, CommandError> {
    let cards = match &recipe.world {
        None => serde_json::to_string(&(&recipe.planes, recipe.environment)),
        Some(world) => serde_json::to_string(world),
    }
    .map_err(|e| CommandError::failed(format!("recipe: {e}")))?;
    let hash = blake3::hash(cards.as_bytes()).to_hex();
    Ok(format!("scene-{}", &hash[..16]))
}

/// How light became linear values.
pub(crate) struct Exposed {
    /// Linear value a sr of absorbed white light.
    pub gain: f64,
    /// What a white wall gives in the sum in the middle of the window, per channel, sr.
    pub white_sr: [f64; 3],
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
    exposure: Exposed,
    stats: &RenderStats,
) -> Result<Description, CommandError> {
    let json =
        serde_json::to_value(recipe).map_err(|e| CommandError::failed(format!("recipe: {e}")))?;
    let lens = assemble::lens(&recipe.lens)?;
    let lens_hash = blake3::hash(format!("{:?}", lens.prescription().surfaces).as_bytes())
        .to_hex()
        .to_string();
    // An ideal pixel may have taken the place of a table's.
    let ideal = match (camera.response(), response) {
        (ResponseLookup::Geometric(g), _) | (_, Response::Geometric(g)) => Some(g),
        _ => None,
    };
    let (pixel, hash, table_nm) = match (ideal, response) {
        (None, Response::Table(t)) => (
            t.meta().pixel.name.clone(),
            t.meta().key.clone(),
            t.axes().wavelengths_nm.clone(),
        ),
        (Some(g), _) | (_, Response::Geometric(g)) => (
            format!("ideal, focal length {} µm", g.focal_length_um()),
            String::new(),
            Vec::new(),
        ),
    };
    let model = match &recipe.response {
        _ if ideal.is_some() => "geometric".to_string(),
        ResponseRecipe::Wave { .. } => Level::Wave.to_string(),
        ResponseRecipe::Fdtd(_) => Level::Fdtd.to_string(),
        ResponseRecipe::Rcwa(_) => Level::Rcwa.to_string(),
        ResponseRecipe::Corrected(_) => Level::Corrected.to_string(),
        ResponseRecipe::Geometric { .. } => "geometric".to_string(),
        ResponseRecipe::Table { file } => format!("table {file}"),
    };
    let paraxial = camera
        .paraxial()
        .copied()
        .unwrap_or_else(|| unreachable!("a camera with a lens"));
    Ok(Description {
        index: id.index,
        configuration_blake3: id.configuration_blake3,
        seed: recipe.render.seed,
        scene: spec::Scene {
            id: scene_id(recipe)?,
            charts: recipe
                .planes
                .iter()
                .map(|p| p.chart.name().to_string())
                .chain(recipe.world.iter().map(|w| w.name().to_string()))
                .collect(),
            parameters: json,
        },
        lens: spec::Lens {
            name: recipe.lens.name.clone(),
            hash: lens_hash,
            efl_mm: paraxial.efl_mm,
            f_number: paraxial.f_number,
            misalignments: recipe
                .lens
                .misalignments
                .iter()
                .map(|m| format!("{m:?}"))
                .collect(),
        },
        focus: spec::Focus {
            distance_m: (camera.focus_distance_mm().is_finite())
                .then(|| camera.focus_distance_mm() * M_PER_MM),
            by: "sensor".to_string(),
        },
        sensor: sensor(recipe, camera),
        response: spec::Response {
            model,
            pixel,
            hash,
            wavelengths_nm: table_nm.clone(),
        },
        channels: colours::channels(camera, response, &exposure),
        exposure: spec::Exposure {
            gain: exposure.gain,
            ev: recipe.exposure_ev,
        },
        noise: spec::Noise::None,
        mosaic: recipe.sensor.mosaic,
        intrinsics: intrinsics(camera),
        disparity_ratio: disparity_ratio(camera)
            .unwrap_or_else(|| unreachable!("a camera with a lens")),
        effects: effects(
            recipe,
            camera,
            response,
            lens.prescription().is_dispersive(),
        ),
        rays_per_pixel: recipe.render.rays_per_pixel as u32,
        rays: stats.rays,
        lost: spec::LostRays {
            missed: stats.lost.missed,
            vignetted: stats.lost.vignetted,
            total_internal_reflection: stats.lost.total_internal_reflection,
        },
        mean_relative_standard_error: stats.relative_spread,
    })
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
        subpixels: spec::Subpixels {
            columns: sensor.subpixels().m() as u32,
            rows: sensor.subpixels().n() as u32,
        },
        width_px: width as u32,
        height_px: height as u32,
        centre_mm: sensor.centre_mm().to_array(),
        cra_shift: spec::CraShift {
            rule: match recipe.sensor.microlens_shift {
                ShiftRule::Centred => "centred",
                ShiftRule::Linear { .. } => "linear",
                ShiftRule::ChiefRay => "chief_ray",
            }
            .to_string(),
            max_shift_um,
        },
    }
}

/// The pinhole that the lens paraxially is. With the entrance pupil at z_e and the exit pupil D in front of the sensor, a point at
/// depth Z and height X images at X · f_px/(Z + z_e); f_px follows from the magnification at the focused depth.
fn intrinsics(camera: &Camera) -> spec::Intrinsics {
    let p = camera
        .paraxial()
        .copied()
        .unwrap_or_else(|| unreachable!("a camera with a lens"));
    let sensor = camera.sensor();
    // A chief ray of slope m in object space leaves the exit pupil with slope m · (pupil magnification)⁻¹ (Lagrange), so
    // the height on the sensor is m · D / magnification.
    let magnification = p.exit_pupil_semi_mm / p.entrance_pupil_semi_mm;
    let focal_mm = (camera.sensor_z_mm() - p.exit_pupil_z_mm) / magnification;
    let focal_px = focal_mm / sensor.pitch_mm();
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
            distance_mm: camera.sensor_z_mm() - p.exit_pupil_z_mm,
            diameter_mm: 2.0 * p.exit_pupil_semi_mm,
        },
    }
}

fn effects(
    recipe: &Recipe,
    camera: &Camera,
    response: &Response,
    dispersive: bool,
) -> spec::Effects {
    let mut simulated = vec!["lens aberrations", "vignetting", "defocus", "occlusion"];
    let mut left_out = vec![
        (
            "diffraction at the main lens's aperture",
            "rays only; the pixel's own diffraction is in its response",
        ),
        (
            "reflections between surfaces",
            "transmission of the lens is 1",
        ),
    ];
    colours::effects(recipe, camera, response, &mut simulated, &mut left_out);
    let lens = &recipe.lens;
    let made = !(lens.misalignments.is_empty() && lens.deviations.is_empty());
    let others = [
        (made, "tolerances of the lens"),
        (lens.focus_error_um != 0.0, "focus error"),
        (
            recipe.sensor.microlens_offset_um != [0.0; 2],
            "misaligned microlenses",
        ),
        (
            matches!(recipe.response, ResponseRecipe::Wave { stack_scale, .. } if stack_scale != 1.0),
            "thickness of the pixel's layers",
        ),
    ];
    simulated.extend(
        others
            .into_iter()
            .filter(|(is, _)| *is)
            .map(|(_, name)| name),
    );
    if recipe.readout.is_some() {
        simulated.push("sensor noise (in files of its own)");
    } else {
        left_out.push(("sensor noise", "clean signal asked for"));
    }
    // What a plan leaves out is moved to the other list when it is known.
    if dispersive {
        simulated.push("dispersion");
    } else {
        left_out.push(("dispersion", "the lens file has no Abbe numbers"));
    }
    if let Some(world) = &recipe.world {
        simulated.push("light reflected and transmitted between surfaces");
        left_out.push((
            "light of very long paths",
            "paths end after `scene.parameters.world.paths.max_bounces` surfaces",
        ));
        if world.paths.clamp.is_some() {
            left_out.push((
                "brightest indirect light",
                "cut by `scene.parameters.world.paths.clamp`, as asked for",
            ));
        }
    }
    match recipe.response {
        ResponseRecipe::Geometric { .. } => left_out.push((
            "diffraction and crosstalk in the pixel",
            "geometric response asked for",
        )),
        _ => simulated.push("diffraction and crosstalk in the pixel"),
    }
    match recipe.sensor.microlens_shift {
        ShiftRule::Centred => left_out.push(("microlens shift", "centred microlenses asked for")),
        _ => {
            simulated.push("microlens shift");
            let distortion = "distortion of the response by the microlens shift";
            match camera.response() {
                ResponseLookup::Shifted(_) | ResponseLookup::Fixed(_) => {
                    simulated.push(distortion);
                }
                _ => left_out.push((
                    distortion,
                    "the centred table is looked up in the moving frame",
                )),
            }
        }
    }
    spec::Effects {
        simulated: simulated.into_iter().map(String::from).collect(),
        left_out: left_out
            .into_iter()
            .map(|(name, reason)| spec::LeftOut {
                name: name.into(),
                reason: reason.into(),
                estimated_error: None,
            })
            .collect(),
    }
}
