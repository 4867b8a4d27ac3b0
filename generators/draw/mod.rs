//! Draws sample `index`'s recipe from the configuration. Every number is a hash of (seed, index, what it is for): it
//! does not depend on the other samples, their order or their number.

mod dice;
mod optics;
mod readout;

use quadpixel::render::RenderSettings;

use crate::charts::{ChartSpec, ImageFile, Mask, is_image, random_spec};
use crate::config::{
    DatasetConfig, Draw, ResponseConfig, WindowConfig, WorldConfig, WorldFileConfig,
};
use crate::recipe::{
    Cutout, ExtentRecipe, LensRecipe, PlaneRecipe, Recipe, RecipeError, ResponseRecipe,
    SensorRecipe, WindowRecipe,
};
use crate::scenes::{Drawn, FileWorld, WorldRecipe, WorldSource};
use dice::{Dice, For};

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
    let focus_mm = dice.of(&config.lens.focus_mm, For::Focus, 0);
    let (response, pixel_pitch) = match &config.response {
        ResponseConfig::Wave {
            pixels,
            stack,
            shifts,
            preset,
        } => {
            let shifts = *shifts;
            let pixel = dice.choice(pixels, For::Pixel, 0).clone();
            let pitch = pitch_of(&pixel)?;
            let stack_scale = stack.map_or(1.0, |stack| {
                let variant = (dice.unit(For::StackVariant, 0) * stack.variants as f64) as u64;
                // A variant is the dataset's, not the sample's: its table is made once.
                let key = [For::StackScale as u64, variant];
                stack.scale.at(dice.seed, &key)
            });
            let wave = ResponseRecipe::Wave {
                pixel,
                stack_scale,
                shifts,
                preset: *preset,
            };
            (wave, Some(pitch))
        }
        ResponseConfig::Fdtd(tables) => {
            let pixel = dice.choice(&tables.pixels, For::Pixel, 0).clone();
            let pitch = pitch_of(&pixel)?;
            (ResponseRecipe::Fdtd(tables.of_pixel(pixel)), Some(pitch))
        }
        ResponseConfig::Rcwa(tables) => {
            let pixel = dice.choice(&tables.pixels, For::Pixel, 0).clone();
            let pitch = pitch_of(&pixel)?;
            (ResponseRecipe::Rcwa(tables.of_pixel(pixel)), Some(pitch))
        }
        ResponseConfig::Corrected(tables) => {
            let pixel = dice.choice(&tables.pixels, For::Pixel, 0).clone();
            let pitch = pitch_of(&pixel)?;
            (
                ResponseRecipe::Corrected(tables.of_pixel(pixel)),
                Some(pitch),
            )
        }
        ResponseConfig::Table { files } => {
            let file = dice.choice(files, For::Pixel, 0).clone();
            let pitch = pitch_of(&file)?;
            (ResponseRecipe::Table { file }, Some(pitch))
        }
        ResponseConfig::Geometric => (
            ResponseRecipe::Geometric {
                focal_length_um: None,
            },
            None,
        ),
    };
    let pitch = config
        .sensor
        .pitch_um
        .map(|d| dice.of(&d, For::Pitch, 0))
        .or(pixel_pitch);
    let Some(pitch_um) = pitch else {
        return Err(RecipeError::Incomplete(
            "sensor.pitch_um is absent; the geometric response has no pixel to take it from",
        ));
    };
    let readout = |electronics| {
        readout::readout(electronics, &dice, &shot, pitch_um, config.sensor.subpixels)
    };
    let name = dice.choice(&config.lens.names, For::Lens, 0).clone();
    let (misalignments, deviations) = match &config.lens.tolerances {
        Some(tolerances) => optics::defects(tolerances, &dice, &name)?,
        None => (Vec::new(), Vec::new()),
    };
    let focused_mm = match &config.sweep {
        Some(sweep) => focus_mm * sweep.factor(step),
        None => focus_mm,
    };
    let drawn = |draw: &Option<Draw>, what| draw.map_or(0.0, |d| dice.of(&d, what, 0));
    Ok(Recipe {
        lens: LensRecipe {
            name,
            focus_mm: focused_mm.is_finite().then_some(focused_mm),
            f_number: config.lens.f_number.map(|d| dice.of(&d, For::FNumber, 0)),
            misalignments,
            deviations,
            focus_error_um: drawn(&config.lens.focus_error_um, For::FocusError),
        },
        sensor: SensorRecipe {
            pitch_um,
            subpixels: config.sensor.subpixels,
            width: config.sensor.width,
            height: config.sensor.height,
            window: window(config, &dice),
            microlens_shift: config.sensor.microlens_shift,
            microlens_offset_um: [For::MicrolensX, For::MicrolensY]
                .map(|what| drawn(&config.sensor.microlens_offset_um, what)),
            mosaic: config.sensor.mosaic,
        },
        response,
        spectrum: config.spectrum,
        planes: match config.scene.world {
            None => planes(config, &dice, focus_mm)?,
            Some(_) => Vec::new(),
        },
        world: config
            .scene
            .world
            .as_ref()
            .map(|w| world(w, &dice, focus_mm)),
        framing_focus_mm: config.sweep.map(|_| focus_mm),
        environment: [0.0; 3],
        exposure_ev: dice.of(&config.exposure_ev, For::Exposure, 0),
        render: RenderSettings {
            rays_per_pixel: config.rays_per_pixel,
            seed: shot.key(For::Render, 0),
        },
        effects: config.effects.clone(),
        tolerance: config.tolerance,
        readout: config.readout.as_ref().map(readout),
    })
}

fn window(config: &DatasetConfig, dice: &Dice) -> WindowRecipe {
    match &config.sensor.window {
        WindowConfig::Centre => WindowRecipe::Centre,
        WindowConfig::Random { max_height_mm } => {
            let radius = max_height_mm * dice.unit(For::WindowHeight, 0).sqrt();
            let (sin, cos) = (dice.unit(For::WindowAzimuth, 0) * std::f64::consts::TAU).sin_cos();
            WindowRecipe::Position {
                x_mm: radius * cos,
                y_mm: radius * sin,
            }
        }
        WindowConfig::ChiefRayAngle { theta_deg, phi_deg } => WindowRecipe::ChiefRayAngle {
            theta_deg: dice.of(theta_deg, For::WindowHeight, 0),
            phi_deg: dice.of(phi_deg, For::WindowAzimuth, 0),
        },
    }
}

/// A world of the kind whose turn it is, or a file.
fn world(config: &WorldConfig, dice: &Dice, focus_mm: f64) -> WorldRecipe {
    if let Some(file) = &config.file {
        return WorldRecipe {
            source: WorldSource::File(file_world(file, dice, focus_mm)),
            paths: config.paths,
        };
    }
    let difficulty = dice.of(&config.difficulty, For::Difficulty, 0);
    WorldRecipe {
        source: WorldSource::Generated(Drawn {
            kind: config.kinds[dice.index as usize % config.kinds.len()],
            seed: dice.key(For::World, 0),
            near_mm: focus_mm * dice.of(&config.near_over_focus, For::Near, 0),
            far_mm: focus_mm * dice.of(&config.far_over_focus, For::Far, 0),
            objects: dice.of(&config.objects, For::Objects, 0) as u32,
            thin: difficulty * dice.of(&config.thin, For::Thin, 0),
            clear: difficulty * dice.of(&config.clear, For::Clear, 0),
            glints: (difficulty * dice.of(&config.glints, For::Glints, 0)) as u32,
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
    let camera = one_of(&config.cameras, For::Camera);
    FileWorld {
        unit_mm: config.unit_mm,
        // A camera of the file has its own place.
        distance_mm: match camera {
            Some(_) => None,
            None => Some(focus_mm * dice.of(&config.distance_over_focus, For::Distance, 0)),
        },
        camera,
        size_mm: config
            .size_over_focus
            .map(|size| focus_mm * dice.of(&size, For::Size, 0)),
        yaw_deg: dice.of(&config.yaw_deg, For::Yaw, 0),
        pitch_deg: dice.of(&config.pitch_deg, For::Elevation, 0),
        panorama: one_of(&config.panoramas, For::Panorama),
        sky: config.sky.map(|sky| dice.of(&sky, For::Sky, 0) as f32),
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
    let background_mm = focus_mm * dice.of(&scene.background_over_focus, For::Background, 0);
    // The background's chart goes through the list in turn, so that a small set shows them all.
    let kind = &scene.charts[dice.index as usize % scene.charts.len()];
    let mut planes = vec![PlaneRecipe {
        chart: chart(kind, dice.key(For::Chart, 0))?,
        chart_seed: dice.key(For::Chart, 0),
        texture_px: scene.texture_px,
        distance_mm: background_mm,
        extent: ExtentRecipe::Fill,
        tilt_x_deg: dice.of(&scene.tilt_deg, For::TiltX, 0),
        tilt_y_deg: dice.of(&scene.tilt_deg, For::TiltY, 0),
        roll_deg: 0.0,
        cutout: None,
    }];
    for card in 1..=dice.of(&scene.cards, For::Cards, 0) as u64 {
        let depth = focus_mm * dice.of(&scene.card_over_focus, For::CardDepth, card);
        let key = dice.key(For::Chart, card);
        planes.push(PlaneRecipe {
            chart: chart(
                dice.choice::<String>(&scene.charts, For::CardChart, card),
                key,
            )?,
            chart_seed: key,
            texture_px: scene.texture_px / 2,
            distance_mm: depth.min(0.95 * background_mm),
            extent: ExtentRecipe::Window {
                x: 0.1 + 0.8 * dice.unit(For::CardX, card),
                y: 0.1 + 0.8 * dice.unit(For::CardY, card),
                size: dice.of(&scene.card_size, For::CardSize, card),
            },
            tilt_x_deg: 0.0,
            tilt_y_deg: 0.0,
            roll_deg: 30.0 * (2.0 * dice.unit(For::CardRoll, card) - 1.0),
            cutout: Some(Cutout {
                shape: *dice.choice(&Mask::ALL, For::Mask, card),
                seed: dice.key(For::Mask, card),
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
