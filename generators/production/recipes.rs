//! The recipes of a run, drawn one by one: many samples need no more memory than few.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use quadpixel::response::AngularResponse;
use quadpixel::shard::Shard;
use quadpixel_datasets::paths;

use crate::assemble::pixel;
use crate::config::DatasetConfig;
use crate::draw;
use crate::field_error::FieldError;
use crate::recipe::{Recipe, RecipeError};
use crate::rgbd::RgbdRecipe;
use crate::scenes::{FileWorld, WorldSource};

/// The recipe of one sample of a configuration, as a run draws it.
///
/// # Errors
/// A field that is out of its range, a pixel or file that the configuration names.
pub fn recipe(config: &DatasetConfig, index: u32) -> Result<Recipe, RecipeError> {
    Recipes::default().draw(config, index)
}

/// The recipes of a part, drawn one by one.
#[derive(Default)]
pub(crate) struct Recipes {
    /// Numbers of the samples.
    pub indices: Vec<u32>,
    /// Rays of all of them.
    pub rays: u64,
    pitches: RefCell<BTreeMap<String, f64>>,
    /// Hashes of scene files.
    hashes: RefCell<BTreeMap<String, String>>,
    /// Columns and rows of pictures with depth.
    sizes: RefCell<BTreeMap<String, (usize, usize)>>,
}

impl Recipes {
    /// Draws all of them once, so that a bad one is found before the first ray.
    pub fn checked(config: &DatasetConfig, shard: Shard) -> Result<Self, RecipeError> {
        let count = u32::try_from(config.count)
            .ok()
            .filter(|n| *n <= paths::MAX_SAMPLES);
        let Some(count) = count else {
            let allowed = format!("up to {}", paths::MAX_SAMPLES);
            return Err(FieldError::new("count", config.count, allowed).into());
        };
        let mut recipes = Self {
            indices: (0..count).filter(|i| shard.owns(*i as usize)).collect(),
            ..Self::default()
        };
        for &index in &recipes.indices {
            recipes.rays += recipes.draw(config, index)?.rays();
        }
        Ok(recipes)
    }

    /// The recipe of a sample.
    pub fn draw(&self, config: &DatasetConfig, index: u32) -> Result<Recipe, RecipeError> {
        let pitch_of = |name: &str| {
            if let Some(&pitch_um) = self.pitches.borrow().get(name) {
                return Ok(pitch_um);
            }
            let pitch_um = pitch_um(name)?;
            self.pitches.borrow_mut().insert(name.to_owned(), pitch_um);
            Ok(pitch_um)
        };
        let mut recipe = draw::recipe(config, u64::from(index), &pitch_of)?;
        if let Some(world) = &mut recipe.world
            && let WorldSource::File(file) = &mut world.source
        {
            file.blake3 = Some(self.hash_of(file)?);
        }
        if let Some(rgbd) = &recipe.rgbd {
            (recipe.sensor.width, recipe.sensor.height) = self.size_of(rgbd)?;
        }
        Ok(recipe)
    }

    fn size_of(&self, rgbd: &RgbdRecipe) -> Result<(usize, usize), RecipeError> {
        if let Some(&size) = self.sizes.borrow().get(&rgbd.image) {
            return Ok(size);
        }
        let size = rgbd.size()?;
        self.sizes.borrow_mut().insert(rgbd.image.clone(), size);
        Ok(size)
    }

    fn hash_of(&self, file: &FileWorld) -> Result<String, RecipeError> {
        if let Some(hash) = self.hashes.borrow().get(&file.path) {
            return Ok(hash.clone());
        }
        let hash = file.hash()?;
        self.hashes
            .borrow_mut()
            .insert(file.path.clone(), hash.clone());
        Ok(hash)
    }
}

/// Pitch of a pixel or of the pixel of a table (`.npz`).
fn pitch_um(name: &str) -> Result<f64, RecipeError> {
    if !name.ends_with(".npz") {
        return Ok(pixel(name)?.pitch_um);
    }
    let table = AngularResponse::read_npz(Path::new(name))?;
    Ok(table.meta().pitch_um)
}
