//! `--camera FILE`: a fitted camera in the place of a configuration's or a recipe's.

use std::path::PathBuf;

use crate::exit::CommandError;
use clap::Args;
use quadpixel_generators::camera_file::FittedCamera;
use quadpixel_generators::config::DatasetConfig;
use quadpixel_generators::recipe::Recipe;

/// A camera file.
#[derive(Args)]
pub struct CameraArg {
    /// Camera file of `qpgen fit` (camera.toml): lens, pixel, charge and microlenses are its, in the place of what is
    /// configured.
    #[arg(long, value_name = "FILE")]
    pub camera: Option<PathBuf>,
}

impl CameraArg {
    /// Puts it into a configuration; what is not as the file asks.
    ///
    /// # Errors
    /// A file that is no camera's, or that cannot be.
    pub fn put_into(&self, config: &mut DatasetConfig) -> Result<Vec<String>, CommandError> {
        self.put(|camera| camera.put_into(config))
    }

    /// The same of a recipe.
    ///
    /// # Errors
    /// As there.
    pub fn put_into_recipe(&self, recipe: &mut Recipe) -> Result<Vec<String>, CommandError> {
        self.put(|camera| camera.put_into_recipe(recipe))
    }

    fn put(&self, put: impl FnOnce(&FittedCamera)) -> Result<Vec<String>, CommandError> {
        let Some(path) = &self.camera else {
            return Ok(Vec::new());
        };
        let camera = FittedCamera::read(path).map_err(CommandError::input)?;
        put(&camera);
        Ok(camera.warnings)
    }
}
