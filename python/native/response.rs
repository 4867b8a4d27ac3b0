//! Pixels and their angular responses, and what needs one of them: renders and truths of a camera.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use quadpixel::em::PixelStack;
use quadpixel::em::light::direction_cosines;
use quadpixel::hash::json_hash;
use quadpixel::image::Image;
use quadpixel::render::truth::{Defocus, DisparityField};
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel_cli::exit::CommandError;
use quadpixel_generators::assemble::{self, pixel};
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_generators::recipe::{Recipe, SampleId, parse_json};
use quadpixel_generators::sample::prepare;
use serde_json::json;

use crate::arrays::{Array, Given, image, of_images, of_plane, shaped};
use crate::call::{Watch, run};
use crate::json::{of, raised, read};
use crate::sample::Rendered;

const MM_PER_M: f32 = 1e3;

/// Names of the built-in pixels.
#[pyfunction]
pub fn pixel_names() -> [&'static str; 9] {
    PixelStack::builtin_names()
}

/// Pitch and sub-pixels of a pixel by its built-in name or file, as JSON.
#[pyfunction]
pub fn pixel_info(name: &str) -> PyResult<String> {
    let stack = pixel(name).map_err(|e| raised(e.into()))?;
    Ok(of(
        json!({ "pitch_um": stack.pitch_um, "subpixels": stack.subpixels.to_string() }),
    ))
}

/// Responses that calls share, loaded or computed once.
#[pyclass(frozen)]
pub struct Responses {
    pub(crate) loaded: Arc<Mutex<assemble::Responses>>,
}

/// The response of a recipe; warnings go to the caller.
pub(crate) fn response(
    loaded: &Mutex<assemble::Responses>,
    recipe: &Recipe,
    watch: &Watch,
) -> Result<Arc<quadpixel::response::Response>, CommandError> {
    // A call that was stopped leaves whole responses behind.
    let mut loaded = loaded.lock().unwrap_or_else(PoisonError::into_inner);
    let observer: &dyn Observer = watch;
    let response = loaded.get(recipe, &observer)?;
    loaded
        .take_warnings()
        .iter()
        .for_each(|text| watch.warn(text));
    Ok(response)
}

/// Tells how many rays there will be, and of what they make a sample: of the recipe itself without the hash of a
/// configuration.
pub(crate) fn started(
    recipe: &Recipe,
    index: u32,
    hash: Option<String>,
    watch: &Watch,
) -> Result<SampleId, CommandError> {
    watch.event(Event::Start {
        samples: 1,
        rays: recipe.rays(),
    });
    let configuration_blake3 = match hash {
        Some(hash) => hash,
        None => {
            let value = serde_json::to_value(recipe);
            json_hash(&value.map_err(|e| CommandError::failed(format!("recipe: {e}")))?)
        }
    };
    Ok(SampleId {
        index,
        configuration_blake3,
    })
}

#[pymethods]
impl Responses {
    #[new]
    fn new() -> Self {
        let loaded = Arc::new(Mutex::new(assemble::Responses::new()));
        Self { loaded }
    }

    /// P (N, m·n) float32 of N directions, deg, under a centred microlens.
    fn weights<'py>(
        &self,
        py: Python<'py>,
        recipe: &str,
        theta_deg: Vec<f64>,
        phi_deg: Vec<f64>,
    ) -> PyResult<Array<'py, f32>> {
        let recipe: Recipe = read(recipe, "recipe")?;
        let loaded = self.loaded.clone();
        let (weights, count) = run(py, None, move |watch| {
            let response = response(&loaded, &recipe, watch)?;
            let lookup = response.at(ChannelWavelengths::default().reference_nm());
            let angles = theta_deg.iter().zip(&phi_deg);
            let cosines = angles.map(|(&theta, &phi)| direction_cosines(theta, phi));
            let (u, v): (Vec<f32>, Vec<f32>) = cosines.map(|[u, v]| (u as f32, v as f32)).unzip();
            let count = lookup.subpixels().count();
            let mut weights = vec![0.0; u.len() * count];
            lookup.weights_batch(&u, &v, &mut weights);
            Ok((weights, count))
        })?;
        let directions = weights.len() / count;
        shaped(py, weights, &[directions, count])
    }

    /// Renders a recipe (JSON) as sample `index` of the configuration of that hash; without one, as `qpgen render`
    /// does.
    #[pyo3(signature = (recipe, index, hash, progress))]
    fn render(
        &self,
        py: Python<'_>,
        recipe: &str,
        index: u32,
        hash: Option<String>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Rendered> {
        let recipe = parse_json(recipe, "recipe").map_err(|e| raised(e.into()))?;
        let loaded = self.loaded.clone();
        run(py, progress.as_ref(), move |watch| {
            let id = started(&recipe, index, hash, watch)?;
            Rendered::of(&loaded, id, watch, |responses| {
                prepare(&recipe, responses, watch)
            })
        })
    }

    /// What a camera does to points at the depths of a (H, W) map, m: traced and paraxial disparity (m·n, H, W, 2) and
    /// circle of confusion (H, W), px.
    #[allow(clippy::type_complexity)] // because it is three arrays
    fn truth<'py>(
        &self,
        py: Python<'py>,
        recipe: &str,
        depth_m: Given<'_>,
    ) -> PyResult<(Array<'py, f32>, Array<'py, f32>, Array<'py, f32>)> {
        let recipe: Recipe = read(recipe, "recipe")?;
        let mut depth_mm = image(&depth_m, "depth")?;
        depth_mm.data_mut().iter_mut().for_each(|z| *z *= MM_PER_M);
        let loaded = self.loaded.clone();
        let (maps, coc_px) = run(py, None, move |watch| {
            let response = response(&loaded, &recipe, watch)?;
            let camera = assemble::camera(&recipe, &response)?;
            let no_focus = || CommandError::input("a camera without a lens has no focus");
            let channel = ChannelWavelengths::REFERENCE;
            let field = DisparityField::new(&camera, channel).ok_or_else(no_focus)?;
            let defocus = Defocus::new(&camera).ok_or_else(no_focus)?;
            let pitch_mm = camera.sensor().pitch_mm();
            let coc_px =
                |z: &f32| (defocus.circle_of_confusion_mm(f64::from(*z)) / pitch_mm) as f32;
            let mut coc = Image::zeros(depth_mm.width(), depth_mm.height(), 1);
            let values = coc.data_mut().iter_mut().zip(depth_mm.data());
            values.for_each(|(to, z)| *to = coc_px(z));
            Ok((field.maps(&camera, &depth_mm), coc))
        })?;
        Ok((
            of_images(py, &maps.traced, 0..2)?,
            of_images(py, &maps.paraxial, 0..2)?,
            of_plane(py, &coc_px)?,
        ))
    }
}
