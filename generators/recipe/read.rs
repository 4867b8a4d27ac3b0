//! Recipes from files.

use std::path::Path;

use quadpixel::file;

use super::{Recipe, RecipeError};

/// A recipe in TOML; `name` names the text in errors.
///
/// # Errors
/// No recipe: names the place.
pub fn parse_recipe(text: &str, name: &str) -> Result<Recipe, RecipeError> {
    toml::from_str(text)
        .map(Recipe::completed)
        .map_err(|cause| RecipeError::Toml {
            name: name.to_owned(),
            cause: Box::new(cause),
        })
}

/// Reads a recipe: TOML, or the `scene.parameters` of a sample's `meta.json`.
///
/// # Errors
/// A file that cannot be read, or is no recipe: names the file and the place.
pub fn read_recipe(path: &Path) -> Result<Recipe, RecipeError> {
    let text = file::read_text(path).map_err(|e| RecipeError::File {
        path: e.path,
        cause: e.cause,
    })?;
    let name = path.display().to_string();
    if path.extension().is_some_and(|e| e == "json") {
        return parse_json(&text, &name);
    }
    parse_recipe(&text, &name)
}

/// A recipe in JSON, or the `scene.parameters` of a sample's `meta.json`; `name` names the text in errors.
///
/// # Errors
/// No recipe: names the place.
pub fn parse_json(text: &str, name: &str) -> Result<Recipe, RecipeError> {
    let read = || {
        let meta: serde_json::Value = serde_json::from_str(text)?;
        let parameters = meta.pointer("/scene/parameters").unwrap_or(&meta).clone();
        serde_json::from_value(parameters)
    };
    let name = name.to_owned();
    read()
        .map(Recipe::completed)
        .map_err(|cause| RecipeError::Json { name, cause })
}
