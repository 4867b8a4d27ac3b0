//! Pictures with depth, and banks of kernels, of a camera.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadpixel::render::kernels::Footprint;
use quadpixel_generators::assemble;
use quadpixel_generators::bank::{BankArrays, BankRequest};
use quadpixel_generators::recipe::{Recipe, parse_json};
use quadpixel_generators::rgbd::{Level, Meaning, RgbdRecipe, Stored};
use quadpixel_generators::sample::prepare_picture;

use crate::arrays::{Given, image, shaped};
use crate::call::run;
use crate::json::{of, raised, read, refused, text};
use crate::response::{Responses, response, started};
use crate::sample::Rendered;

/// The recipe of a picture and its depth in files (JSON), with what a sidecar says, and columns and rows.
#[pyfunction]
pub fn picture(image: &str, depth: &str, meaning: &str) -> PyResult<(String, usize, usize)> {
    let meaning: Meaning = read(meaning, "meaning")?;
    let picture = RgbdRecipe::new(image.as_ref(), depth.as_ref(), &meaning);
    let picture = picture.map_err(|e| raised(e.into()))?;
    let (width, height) = picture.size().map_err(|e| raised(e.into()))?;
    Ok((text(&picture).map_err(raised)?, width, height))
}

/// Converts a picture (H, W, C) and its depth (H, W) in memory, by a recipe (JSON) without `rgbd`. `full_scale`:
/// of the picture and of the depth, for whole numbers.
#[pyfunction]
#[pyo3(signature = (responses, recipe, pictures, full_scale, meaning, level, progress))]
#[allow(clippy::too_many_arguments)] // because Python passes them by place
pub fn convert(
    py: Python<'_>,
    responses: &Responses,
    recipe: &str,
    pictures: (Given<'_>, Given<'_>),
    full_scale: (Option<f32>, Option<f32>),
    meaning: &str,
    level: &str,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Rendered> {
    let mut recipe = parse_json(recipe, "recipe").map_err(|e| raised(e.into()))?;
    let meaning: Meaning = read(meaning, "meaning")?;
    let level: Level = read(&of(level.into()), "level")?;
    let light = Stored::array(image(&pictures.0, "image")?, full_scale.0);
    let depth = Stored::array(image(&pictures.1, "depth")?, full_scale.1);
    let loaded = responses.loaded.clone();
    run(py, progress.as_ref(), move |watch| {
        let (named, picture) = RgbdRecipe::of_arrays(&light, &depth, &meaning)?;
        recipe.rgbd = Some(RgbdRecipe { level, ..named });
        let id = started(&recipe, 0, None, watch)?;
        Rendered::of(&loaded, id, watch, |responses| {
            prepare_picture(&recipe, picture, responses, watch)
        })
    })
}

/// The arrays of a bank of kernels by the names of `qpgen psf`; `meta` is JSON.
#[pyfunction]
pub fn kernels<'py>(
    py: Python<'py>,
    responses: &Responses,
    recipe: &str,
    depths_m: Vec<f64>,
    nodes: (usize, usize),
    rays: usize,
    source: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let recipe: Recipe = read(recipe, "recipe")?;
    let footprint = match source {
        "point" => Footprint::Point,
        "pixel" => Footprint::Pixel,
        "sample" => Footprint::Sample,
        other => {
            let text = format!("source is {other:?}; allowed: point, pixel, sample");
            return Err(refused(text));
        }
    };
    let request = BankRequest {
        depths_m,
        nodes,
        rays,
        footprint,
    };
    let loaded = responses.loaded.clone();
    let (arrays, depths_m, about) = run(py, None, move |watch| {
        let response = response(&loaded, &recipe, watch)?;
        let camera = assemble::camera(&recipe, &response)?;
        let (kernels, depths_m, about) = request.trace(&recipe, &camera)?;
        Ok((BankArrays::new(&kernels), depths_m, about))
    })?;
    let items = PyDict::new(py);
    let Some(bank) = arrays else {
        return Err(refused("depths_m is empty; allowed: at least one"));
    };
    let whole = &bank.shape[..5];
    let with_xy = |axes: &[usize]| [axes, &[2]].concat();
    items.set_item("kernel", shaped(py, bank.kernel, &bank.shape)?)?;
    items.set_item("energy_sr", shaped(py, bank.energy_sr, &whole[1..])?)?;
    items.set_item(
        "centroid_px",
        shaped(py, bank.centroid_px, &with_xy(whole))?,
    )?;
    items.set_item("beyond", shaped(py, bank.beyond, whole)?)?;
    items.set_item("origin", bank.origin)?;
    items.set_item("depth_m", shaped(py, depths_m, &[whole[0]])?)?;
    items.set_item(
        "field_mm",
        shaped(py, bank.field_mm, &with_xy(&whole[1..3]))?,
    )?;
    items.set_item("meta", of(about))?;
    Ok(items)
}
