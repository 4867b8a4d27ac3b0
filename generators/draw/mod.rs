//! Draws sample `index`'s recipe from the configuration. Every number is a hash of (seed, index, what it is for): it
//! does not depend on the other samples, their order or their number.

mod dice;
mod optics;
mod readout;

use std::path::Path;

use quadpixel::render::RenderSettings;

use crate::charts::{ChartSpec, ImageFile, Mask, is_image, random_spec};
use crate::config::{
    DatasetConfig, LensConfig, ResponseConfig, RgbdConfig, WindowConfig, WorldConfig,
    WorldFileConfig,
};
use crate::recipe::{
    Cutout, ExtentRecipe, LensRecipe, PlaneRecipe, Recipe, RecipeError, ResponseSource,
    SensorRecipe, TableRecipe, WindowRecipe,
};
use crate::rgbd::RgbdRecipe;
use crate::scenes::{Drawn, FileWorld, WorldRecipe, WorldSource};
use dice::{Dice, Purpose};

/// The recipe of sample `index`. `pitch_of` gives the pitch (µm) of a pixel or table by its name.
///
/// # Errors
/// A pixel that `pitch_of` does not know, or a geometric response without a pitch.
pub fn recipe(
    config: &DatasetConfig,
    index: u64,
    pitch_of: &dyn Fn(&str) -> Result<f64, RecipeError>,
) -> Result<Recipe, RecipeError> {
    // A focus stack is one scene and one camera; only the focus, the rays and the shot are each sample's own.
    let (scene, step) = match &config.sweep {
        Some(sweep) => (index / sweep.steps as u64, index % sweep.steps as u64),
        None => (index, 0),
    };
    let dice = Dice {
        seed: config.seed,
        index: scene,
    };
    let shot = Dice { index, ..dice };
    let focus_mm = dice.draw(&config.lens.focus_mm, Purpose::Focus, 0);
    let (response, pixel_um) = response(&config.response, &dice, pitch_of)?;
    let drawn_um = config
        .sensor
        .pitch_um
        .map(|pitch| dice.draw(&pitch, Purpose::Pitch, 0));
    let Some(pitch_um) = drawn_um.or(pixel_um) else {
        return Err(RecipeError::Incomplete(
            "sensor.pitch_um is absent; the geometric response has no pixel to take it from",
        ));
    };
    let readout = |electronics| {
        readout::readout(electronics, &dice, &shot, pitch_um, config.sensor.subpixels)
    };
    let focused_mm = match &config.sweep {
        Some(sweep) => focus_mm * sweep.factor(step),
        None => focus_mm,
    };
    Ok(Recipe {
        lens: lens(&config.lens, &dice, focused_mm)?,
        sensor: sensor(config, &dice, pitch_um),
        response,
        spectrum: config.spectrum,
        planes: match (&config.scene.world, &config.scene.rgbd) {
            (None, None) => planes(config, &dice, focus_mm)?,
            _ => Vec::new(),
        },
        world: config
            .scene
            .world
            .as_ref()
            .map(|w| world(w, &dice, focus_mm)),
        rgbd: (config.scene.rgbd.as_ref())
            .map(|rgbd| picture(rgbd, &dice))
            .transpose()?,
        framing_focus_mm: config.sweep.map(|_| focus_mm),
        environment: [0.0; 3],
        exposure_ev: dice.draw(&config.exposure_ev, Purpose::Exposure, 0),
        registration: config.registration,
        render: RenderSettings {
            rays_per_pixel: config.rays(),
            seed: shot.key(Purpose::Render, 0),
        },
        footprints: config.footprints,
        lens_tracing: config.lens_tracing,
        effects: config.effects.clone(),
        tolerance: config.tolerance,
        readout: config.readout.as_ref().map(readout),
        camera_pictures: config.camera_pictures.clone(),
    })
}

/// The response, and the pitch of its pixel, µm, if it has one.
fn response(
    config: &ResponseConfig,
    dice: &Dice,
    pitch_of: &dyn Fn(&str) -> Result<f64, RecipeError>,
) -> Result<(ResponseSource, Option<f64>), RecipeError> {
    let (source, name) = match config {
        ResponseConfig::Ideal => {
            let focal_length_um = None;
            return Ok((ResponseSource::Ideal { focal_length_um }, None));
        }
        ResponseConfig::Files { files } => {
            let file = dice.choice(files, Purpose::Pixel, 0).clone();
            (ResponseSource::File { file: file.clone() }, file)
        }
        ResponseConfig::Simulated(table) => {
            let pixel = dice.choice(&table.pixels, Purpose::Pixel, 0).clone();
            let stack_scale = table.stack.map_or(1.0, |stack| {
                let variant = (dice.unit(Purpose::StackVariant, 0) * stack.variants as f64) as u64;
                // A variant is the dataset's, not the sample's: its table is made once.
                let key = [Purpose::StackScale as u64, variant];
                stack.scale.at(dice.seed, &key)
            });
            let table = TableRecipe {
                level: table.level,
                pixel: pixel.clone(),
                stack_scale,
                choice: table.choice,
                charge: table.charge,
            };
            (ResponseSource::Simulated(table), pixel)
        }
    };
    Ok((source, Some(pitch_of(&name)?)))
}

fn lens(config: &LensConfig, dice: &Dice, focus_mm: f64) -> Result<LensRecipe, RecipeError> {
    if config.names.is_empty() {
        return Err(RecipeError::Incomplete(
            "lens.names: empty, the lenses of lens.from were not listed",
        ));
    }
    let name = dice.choice(&config.names, Purpose::Lens, 0).clone();
    let (misalignments, deviations) = match &config.tolerances {
        Some(tolerances) => optics::defects(tolerances, dice, &name)?,
        None => (Vec::new(), Vec::new()),
    };
    let f_number = config.f_number;
    Ok(LensRecipe {
        name,
        focal_length_mm: config.focal_length_mm,
        focus_mm: focus_mm.is_finite().then_some(focus_mm),
        f_number: f_number.map(|f| dice.draw(&f, Purpose::FNumber, 0)),
        misalignments,
        deviations,
        reflections: config.reflections,
        focus_error_um: dice.draw_or_0(&config.focus_error_um, Purpose::FocusError),
    })
}

fn sensor(config: &DatasetConfig, dice: &Dice, pitch_um: f64) -> SensorRecipe {
    let sensor = &config.sensor;
    SensorRecipe {
        pitch_um,
        subpixels: sensor.subpixels,
        width: sensor.width,
        height: sensor.height,
        window: window(config, dice),
        microlens_shift: sensor.microlens_shift,
        microlens_offset_um: [Purpose::MicrolensX, Purpose::MicrolensY]
            .map(|purpose| dice.draw_or_0(&sensor.microlens_offset_um, purpose)),
        microlens_law: sensor.microlens_law,
        mosaic: sensor.mosaic,
    }
}

fn window(config: &DatasetConfig, dice: &Dice) -> WindowRecipe {
    match &config.sensor.window {
        WindowConfig::Centre => WindowRecipe::Centre,
        WindowConfig::Random { max_height_mm } => {
            let radius = max_height_mm * dice.unit(Purpose::WindowHeight, 0).sqrt();
            let (sin, cos) =
                (dice.unit(Purpose::WindowAzimuth, 0) * std::f64::consts::TAU).sin_cos();
            WindowRecipe::Position {
                x_mm: radius * cos,
                y_mm: radius * sin,
            }
        }
        WindowConfig::ChiefRayAngle { theta_deg, phi_deg } => WindowRecipe::ChiefRayAngle {
            theta_deg: dice.draw(theta_deg, Purpose::WindowHeight, 0),
            phi_deg: dice.draw(phi_deg, Purpose::WindowAzimuth, 0),
        },
    }
}

/// The picture whose turn it is. The sensor window takes its size by [`crate::production::recipes::Recipes`].
fn picture(config: &RgbdConfig, dice: &Dice) -> Result<RgbdRecipe, RecipeError> {
    let turn = dice.index as usize % config.pairs.len().max(1);
    let Some([image, depth]) = config.pairs.get(turn) else {
        return Err(RecipeError::Incomplete(
            "scene.rgbd.pairs is empty; allowed: at least one pair",
        ));
    };
    let focus_share = config.focus_share;
    Ok(RgbdRecipe {
        level: config.level,
        focus_share: focus_share.map(|share| dice.draw(&share, Purpose::PictureFocus, 0)),
        ..RgbdRecipe::new(Path::new(image), Path::new(depth), &config.meaning)?
    })
}

/// A world of the kind whose turn it is, or a file.
fn world(config: &WorldConfig, dice: &Dice, focus_mm: f64) -> WorldRecipe {
    if let Some(file) = &config.file {
        return WorldRecipe {
            source: WorldSource::File(file_world(file, dice, focus_mm)),
            paths: config.paths,
        };
    }
    let difficulty = dice.draw(&config.difficulty, Purpose::Difficulty, 0);
    WorldRecipe {
        source: WorldSource::Generated(Drawn {
            kind: config.kinds[dice.index as usize % config.kinds.len()],
            seed: dice.key(Purpose::World, 0),
            near_mm: focus_mm * dice.draw(&config.near_over_focus, Purpose::Near, 0),
            far_mm: focus_mm * dice.draw(&config.far_over_focus, Purpose::Far, 0),
            objects: dice.draw(&config.objects, Purpose::Objects, 0) as u32,
            thin: difficulty * dice.draw(&config.thin, Purpose::Thin, 0),
            clear: difficulty * dice.draw(&config.clear, Purpose::Clear, 0),
            glints: (difficulty * dice.draw(&config.glints, Purpose::Glints, 0)) as u32,
        }),
        paths: config.paths,
    }
}

/// The file whose turn it is, as this sample sees it. Its hash is [`crate::production::recipes::Recipes`]'s to add.
fn file_world(config: &WorldFileConfig, dice: &Dice, focus_mm: f64) -> FileWorld {
    let one_of = |list: &[String], what| match list {
        [] => None,
        some => Some(dice.choice(some, what, 0).clone()),
    };
    let camera = one_of(&config.cameras, Purpose::Camera);
    FileWorld {
        unit_mm: config.unit_mm,
        // A camera of the file has its own place.
        distance_mm: match camera {
            Some(_) => None,
            None => Some(focus_mm * dice.draw(&config.distance_over_focus, Purpose::Distance, 0)),
        },
        camera,
        size_mm: config
            .size_over_focus
            .map(|size| focus_mm * dice.draw(&size, Purpose::Size, 0)),
        yaw_deg: dice.draw(&config.yaw_deg, Purpose::Yaw, 0),
        pitch_deg: dice.draw(&config.pitch_deg, Purpose::Elevation, 0),
        panorama: one_of(&config.panoramas, Purpose::Panorama),
        sky: config
            .sky
            .map(|sky| dice.draw(&sky, Purpose::Sky, 0) as f32),
        ..FileWorld::new(&config.names[dice.index as usize % config.names.len()])
    }
}

/// Background first, then the cards.
fn planes(
    config: &DatasetConfig,
    dice: &Dice,
    focus_mm: f64,
) -> Result<Vec<PlaneRecipe>, RecipeError> {
    let scene = &config.scene;
    let background_mm = focus_mm * dice.draw(&scene.background_over_focus, Purpose::Background, 0);
    // The background's chart goes through the list in turn, so that a small set shows them all.
    let kind = &scene.charts[dice.index as usize % scene.charts.len()];
    let mut planes = vec![PlaneRecipe {
        chart: chart(kind, dice.key(Purpose::Chart, 0))?,
        chart_seed: dice.key(Purpose::Chart, 0),
        texture_px: scene.texture_px,
        distance_mm: background_mm,
        extent: ExtentRecipe::Fill,
        tilt_x_deg: dice.draw(&scene.tilt_deg, Purpose::TiltX, 0),
        tilt_y_deg: dice.draw(&scene.tilt_deg, Purpose::TiltY, 0),
        roll_deg: 0.0,
        cutout: None,
    }];
    for card in 1..=dice.draw(&scene.cards, Purpose::Cards, 0) as u64 {
        let depth = focus_mm * dice.draw(&scene.card_over_focus, Purpose::CardDepth, card);
        let key = dice.key(Purpose::Chart, card);
        planes.push(PlaneRecipe {
            chart: chart(
                dice.choice::<String>(&scene.charts, Purpose::CardChart, card),
                key,
            )?,
            chart_seed: key,
            texture_px: scene.texture_px / 2,
            distance_mm: depth.min(0.95 * background_mm),
            extent: ExtentRecipe::Window {
                x: 0.1 + 0.8 * dice.unit(Purpose::CardX, card),
                y: 0.1 + 0.8 * dice.unit(Purpose::CardY, card),
                size: dice.draw(&scene.card_size, Purpose::CardSize, card),
            },
            tilt_x_deg: 0.0,
            tilt_y_deg: 0.0,
            roll_deg: 30.0 * (2.0 * dice.unit(Purpose::CardRoll, card) - 1.0),
            cutout: Some(Cutout {
                shape: *dice.choice(&Mask::ALL, Purpose::Mask, card),
                seed: dice.key(Purpose::Mask, card),
            }),
        });
    }
    Ok(planes)
}

/// A chart by its kind with parameters drawn from `seed`, or an image file by its path.
fn chart(entry: &str, seed: u64) -> Result<ChartSpec, RecipeError> {
    if is_image(entry) {
        return Ok(ChartSpec::Image(ImageFile { path: entry.into() }));
    }
    random_spec(entry, seed).map_err(RecipeError::ListedChart)
}
