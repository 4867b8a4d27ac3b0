//! Worlds made from a seed: rooms, table-tops and flying shapes, in front of any camera and over a depth range around
//! its focus.
//!
//! A world fits the view: its size follows from the window's field of view and the depths asked for, so a narrow window
//! sees a model room and a wide one a real one. Everything is drawn from the numbers of [`Drawn`] and the camera; the
//! same numbers and camera give the same world.

mod builder;
mod drawn;
mod error;
pub mod field_of_view;
mod file_world;
mod finish;
mod flying_shapes;
mod furniture;
mod object;
mod pictures;
mod room;
mod shape;
mod table_top;
mod thin;
mod view;

use quadpixel::render::Camera;
use quadpixel::scene::world::{PathSettings, WorldDescription};
use serde::{Deserialize, Serialize};

pub use drawn::{Drawn, WorldKind};
pub use error::SceneError;
pub use file_world::FileWorld;
use view::View;

/// A world of meshes, and how its light is followed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldRecipe {
    /// What is in it.
    pub source: WorldSource,
    /// How paths of light are followed.
    #[serde(default)]
    pub paths: PathSettings,
}

/// Where a world comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WorldSource {
    /// From numbers.
    Generated(Drawn),
    /// From a file.
    File(FileWorld),
}

impl WorldRecipe {
    /// The world in front of a camera, and what was left out of it.
    ///
    /// # Errors
    /// A number out of its range, or what is wrong with a file.
    pub(crate) fn build(
        &self,
        camera: &Camera,
    ) -> Result<(WorldDescription, Vec<String>), SceneError> {
        match &self.source {
            WorldSource::Generated(drawn) => Ok((drawn.build(camera)?, Vec::new())),
            WorldSource::File(file) => {
                let focus = camera.focus_distance_mm();
                let placed = file.load(focus.is_finite().then_some(focus))?;
                Ok((placed.world, placed.warnings))
            }
        }
    }

    /// A name for what is shown.
    pub fn name(&self) -> &str {
        match &self.source {
            WorldSource::Generated(drawn) => drawn.kind.name(),
            WorldSource::File(_) => "file",
        }
    }
}

impl Drawn {
    /// The world in front of a camera.
    ///
    /// # Errors
    /// A number out of its range, or a window that sees nothing.
    pub fn build(&self, camera: &Camera) -> Result<WorldDescription, SceneError> {
        self.check()?;
        let view = View::from_camera(camera)?;
        match self.kind {
            WorldKind::Room => room::build(self, &view),
            WorldKind::TableTop => table_top::build(self, &view),
            WorldKind::FlyingShapes => flying_shapes::build(self, &view),
        }
    }
}
