//! A still life on a table, a lamp panel above, a wall behind.
//!
//! The table's plane goes through the lower edge of the view at the near depth and meets the wall at the far depth a
//! third of the way up: the camera looks down on it by what that makes.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};
use quadpixel::scene::world::{Material, WorldDescription};

use super::builder::{Builder, standing};
use super::drawn::Drawn;
use super::error::SceneError;
use super::finish::matt;
use super::flying_shapes::glints;
use super::object::{Nature, still_life};
use super::pictures::KINDS;
use super::shape::rectangle;
use super::view::View;
use crate::charts::keyed::Key;

/// A floor: two points on it, one at each depth, and its up direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Floor {
    near: DVec3,
    far: DVec3,
    pub up: DVec3,
}

impl Floor {
    /// The plane through the middle of the view's line y = `low` at the near depth and y = `high` at the far depth.
    pub fn new(drawn: &Drawn, view: &View, low: f64, high: f64) -> Self {
        let (near, far) = (
            view.at(0.0, low, drawn.near_mm),
            view.at(0.0, high, drawn.far_mm),
        );
        let right = view.facing().x_axis;
        let up = right.cross(far - near).normalize();
        Self {
            near,
            far,
            // Away from the side on which the camera is not.
            up: if up.dot(-near) > 0.0 { up } else { -up },
        }
    }

    /// The point of the floor at a depth on its middle line, moved to the right by x.
    pub fn at(&self, view: &View, x_mm: f64, depth_mm: f64) -> DVec3 {
        let t = (depth_mm + self.near.z) / (self.near.z - self.far.z);
        self.near.lerp(self.far, t) + x_mm * view.facing().x_axis
    }

    /// The turn whose y is up and whose −z runs to the far end.
    pub fn turn(&self, view: &View) -> DMat3 {
        let x = view.facing().x_axis;
        DMat3::from_cols(x, self.up, x.cross(self.up))
    }

    /// Distance from the near to the far line, mm.
    pub fn length_mm(&self) -> f64 {
        self.near.distance(self.far)
    }
}

pub(super) fn build(drawn: &Drawn, view: &View) -> Result<WorldDescription, SceneError> {
    let key = Key::new(drawn.seed, "table top");
    let mut builder = Builder::default();
    let floor = Floor::new(drawn, view, -1.1, 0.35);
    let turn = floor.turn(view);
    let width = 5.0 * view.half.x * drawn.far_mm;
    let cover = ["wood", "cloth", "stone", "tiles"][key.whole(0, 0, 3) as usize];
    let material = matt(&mut builder, key.with(1), cover)?;
    let top =
        rectangle(width, 3.0 * floor.length_mm()).moved(DAffine3::from_rotation_x(-0.25 * TAU));
    let middle = floor.at(view, 0.0, drawn.far_mm);
    let place = DAffine3::from_mat3_translation(turn, middle);
    builder.object("table", vec![(top, material)], place);
    // The wall stands a little behind the far depth's line and is square to the table.
    let paper = KINDS[key.whole(2, 0, KINDS.len() as u32 - 1) as usize];
    let material = matt(&mut builder, key.with(3), paper)?;
    let wall = rectangle(width, width);
    builder.object("wall", vec![(wall, material)], place);

    for k in 0..u64::from(drawn.objects) {
        let key = key.with(4).with(k);
        let t = (k as f64 + key.uniform(0)) / f64::from(drawn.objects);
        let depth = drawn.depth_mm(0.05 + 0.9 * t);
        let x = key.range(1, -0.95, 0.95) * view.half.x * depth;
        let foot = floor.at(view, x, depth);
        let size = view.reach_mm(depth) * key.range(2, 0.25, 0.6);
        let nature = Nature::draw(key, drawn.thin, drawn.clear);
        let parts = still_life(&mut builder, key, nature)?;
        // Hair's breadth above the table, so that two surfaces are never one.
        let foot = foot + floor.up * 1e-4 * size;
        builder.object(
            "piece",
            parts,
            standing(foot, floor.up, TAU * key.uniform(3), size),
        );
    }
    glints(&mut builder, drawn, view, key.with(5));
    panel(&mut builder, drawn, view, &floor, key.with(6));
    Ok(builder.finished([0.3, 0.32, 0.36]))
}

/// A light panel above the objects, out of view, that gives the table below it an irradiance of about 3.
fn panel(builder: &mut Builder, drawn: &Drawn, view: &View, floor: &Floor, key: Key) {
    let depth = drawn.depth_mm(key.range(0, 0.3, 0.7));
    let side = 1.2 * floor.length_mm();
    let height = 1.5 * side;
    let x = key.range(1, -0.5, 0.5) * side;
    let foot = floor.at(view, x, depth);
    // E = L A/h² right below a small panel.
    let radiance = (3.0 * height * height / (side * side)) as f32;
    let material = builder.material(Material::emitter([
        radiance,
        0.95 * radiance,
        0.86 * radiance,
    ]));
    let down = DMat3::from_rotation_x(0.25 * TAU);
    let place = DAffine3::from_mat3_translation(floor.turn(view) * down, foot + height * floor.up);
    builder.object("panel", vec![(rectangle(side, side), material)], place);
}
