//! Configurations, the recipes that are drawn from them, and rendered samples.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadpixel::image::Image;
use quadpixel::image::views::{split_views, sum_of};
use quadpixel_cli::exit::CommandError;
use quadpixel_datasets::{CameraDescription, SampleMeta};
use quadpixel_generators::assemble::Responses;
use quadpixel_generators::config::{ConfigError, DEFAULT_TOML, DatasetConfig};
use quadpixel_generators::production::identity::Identity;
use quadpixel_generators::production::recipes::recipe;
use quadpixel_generators::recipe::{RecipeError, SampleId};
use quadpixel_generators::sample::{Prepared, Rays, Sample};
use quadpixel_generators::writer::{Truth, described, picked, write_alone};

use crate::arrays::{of_image, of_images, of_plane, shaped};
use crate::call::{Watch, on_threads, run};
use crate::json::{raised, read, text};

fn configured(config: Result<DatasetConfig, ConfigError>) -> PyResult<DatasetConfig> {
    config.map_err(|e| raised(e.into()))
}

/// A configuration (JSON) with the lenses and the pictures of its folders by name, as JSON.
#[pyfunction]
pub fn listed(py: Python<'_>, config: &str) -> PyResult<String> {
    let mut config: DatasetConfig = read(config, "configuration")?;
    run(py, None, move |watch| {
        let mut skipped = config.lens.listed()?;
        if let Some(rgbd) = &mut config.scene.rgbd {
            skipped.extend(rgbd.listed()?);
        }
        skipped
            .iter()
            .for_each(|one| watch.warn(&format!("skipped: {one}")));
        text(&config)
    })
}

/// The default configuration, as JSON.
#[pyfunction]
pub fn default_configuration() -> PyResult<String> {
    let config = configured(DatasetConfig::from_toml(DEFAULT_TOML, "default"))?;
    text(&config).map_err(raised)
}

/// A configuration's TOML, which `file` names in errors, as JSON.
#[pyfunction]
pub fn configuration(toml: &str, file: &str) -> PyResult<String> {
    text(&configured(DatasetConfig::from_toml(toml, file))?).map_err(raised)
}

/// The recipe of a sample of a configuration (JSON), as JSON, and the hash that the configuration's samples bear.
#[pyfunction]
pub fn draw(config: &str, index: u32) -> PyResult<(String, String)> {
    let config: DatasetConfig = read(config, "configuration")?;
    config.check().map_err(|e| raised(e.into()))?;
    let identity = Identity::new(&config).map_err(|e| raised(CommandError::input(e)))?;
    let recipe = recipe(&config, index).map_err(|e| raised(e.into()))?;
    Ok((text(&recipe).map_err(raised)?, identity.hash()))
}

/// A rendered sample.
#[pyclass(frozen)]
pub struct Rendered {
    sample: Arc<Sample>,
    meta: SampleMeta,
    camera: CameraDescription,
    truth: Truth,
}

impl Rendered {
    /// What is prepared with responses that calls share.
    pub(crate) fn of(
        loaded: &Mutex<Responses>,
        id: SampleId,
        watch: &Watch,
        prepare: impl FnOnce(&mut Responses) -> Result<Prepared, RecipeError>,
    ) -> Result<Self, CommandError> {
        let prepared = {
            let mut loaded = loaded.lock().unwrap_or_else(PoisonError::into_inner);
            let prepared = prepare(&mut loaded)?;
            let warnings = loaded.take_warnings();
            warnings.iter().for_each(|text| watch.warn(text));
            prepared
        };
        let (sample, _) = prepared.render(id, Rays::Trace, watch)?;
        sample.made.report(watch, "sample");
        Self::new(sample)
    }

    fn new(sample: Sample) -> Result<Self, CommandError> {
        let (meta, camera, truth) = described(&sample.files())?;
        Ok(Self {
            sample: Arc::new(sample),
            meta,
            camera,
            truth,
        })
    }
}

#[pymethods]
impl Rendered {
    /// `meta.json` but its list of contents, and `camera.json`.
    fn descriptions(&self) -> PyResult<(String, String)> {
        Ok((
            text(&self.meta).map_err(raised)?,
            text(&self.camera).map_err(raised)?,
        ))
    }

    /// The arrays of a sample by the names of `Dataset`'s items.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let files = self.sample.files();
        let (truth, items) = (&self.truth, PyDict::new(py));
        let subpixels = self.meta.sensor.subpixels;
        let taken_apart = |mosaic: &Image| {
            on_threads(py, || {
                let views = split_views(mosaic, subpixels);
                let sum = sum_of(&views);
                (views, sum)
            })
        };
        let (views, sum) = taken_apart(files.raw)?;
        items.set_item("raw", of_image(py, files.raw)?)?;
        items.set_item("views", of_images(py, &views, 0..files.raw.channels())?)?;
        if let Some(sum) = sum {
            items.set_item("sum", of_image(py, &sum)?)?;
        }
        items.set_item("target", of_image(py, files.target)?)?;
        items.set_item("depth", of_plane(py, &truth.depth_m)?)?;
        items.set_item("distance", of_plane(py, &truth.distance_m)?)?;
        items.set_item("disparity", of_images(py, &truth.disparity_px, 0..2)?)?;
        items.set_item("paraxial", of_images(py, &truth.disparity_px, 2..4)?)?;
        items.set_item("coc", of_plane(py, &truth.coc_px)?)?;
        items.set_item("shifts", of_image(py, &truth.chief_to_sum_px)?)?;
        items.set_item("channel_shifts", self.channel_shifts(py)?)?;
        items.set_item("occlusion", of_plane(py, files.occlusion)?)?;
        let size = [files.target.height(), files.target.width()];
        items.set_item("valid", shaped(py, truth.valid.clone(), &size)?)?;
        if let (Some(seen), Some(normals)) = (files.seen, &truth.normals) {
            items.set_item("objects", shaped(py, seen.objects.to_vec(), &size)?)?;
            items.set_item("normal", of_image(py, normals)?)?;
        }
        let codes = |image: &Image| image.data().iter().map(|v| *v as u16).collect::<Vec<u16>>();
        let mosaic = |image: &Image| picked(files.description, image, 0);
        if let Some(noisy) = files.noisy {
            let (linear, sum) = taken_apart(noisy.linear)?;
            let shape = [
                noisy.codes.height(),
                noisy.codes.width(),
                noisy.codes.channels(),
            ];
            items.set_item("noisy", shaped(py, codes(noisy.codes), &shape)?)?;
            items.set_item(
                "noisy_views",
                of_images(py, &linear, 0..noisy.linear.channels())?,
            )?;
            if let Some(sum) = sum {
                items.set_item("noisy_sum", of_image(py, &sum)?)?;
            }
            items.set_item(
                "shading",
                of_images(py, noisy.shading, 0..noisy.codes.channels())?,
            )?;
            if let Some(own) = mosaic(noisy.codes) {
                items.set_item("noisy_mosaic", shaped(py, codes(&own), &shape[..2])?)?;
            }
        }
        if let Some(own) = mosaic(files.raw) {
            items.set_item("mosaic", of_plane(py, &own)?)?;
        }
        Ok(items)
    }

    /// Writes the sample's files into a new folder, as `qpgen render` does.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let sample = self.sample.clone();
        run(py, None, move |_| {
            write_alone(&folder, &sample.files())?;
            Ok(())
        })
    }
}

impl Rendered {
    fn channel_shifts<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let maps = &self.truth.channel_shifts_px;
        if maps.is_empty() {
            return Ok(None);
        }
        let colours = PyDict::new(py);
        colours.set_item("R", of_images(py, maps, 0..2)?)?;
        colours.set_item("B", of_images(py, maps, 2..4)?)?;
        Ok(Some(colours))
    }
}
