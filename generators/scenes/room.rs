//! A room: floor, walls, ceiling lights, furniture on the floor, pictures and shelves on the walls, lamps.
//!
//! Its floor runs from below the view at the near depth to a back wall at the far depth, its side walls stand where the
//! view's edges meet the far depth. Metres of the furniture are scaled so that a chair is a third of the view high at
//! the far wall.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DVec3};
use quadpixel::scene::world::{Material, WorldDescription};

use super::builder::Builder;
use super::drawn::Drawn;
use super::error::SceneError;
use super::finish::matt;
use super::flying_shapes::glints;
use super::furniture::{chair, lamp, shelf, table};
use super::object::{Nature, Parts, still_life};
use super::pictures::KINDS;
use super::shape::{cuboid, rectangle};
use super::table_top::Floor;
use super::view::View;
use crate::charts::keyed::Key;

/// Height of the room, in its own metres.
const HEIGHT_M: f64 = 2.8;

/// The room's frame: x right, y up, z towards the camera, origin where the middle of the floor meets the back wall.
struct Frame {
    camera_from_room: DAffine3,
    /// mm per metre of the room.
    scale: f64,
    half_width_m: f64,
    length_m: f64,
}

pub(super) fn build(drawn: &Drawn, view: &View) -> Result<WorldDescription, SceneError> {
    let key = Key::new(drawn.seed, "room");
    let mut builder = Builder::default();
    let floor = Floor::new(drawn, view, -1.15, -0.45);
    let far = drawn.far_mm;
    let scale = view.reach_mm(far) * 2.0 / 3.0;
    let turn = floor.turn(view);
    let frame = Frame {
        camera_from_room: DAffine3::from_mat3_translation(
            turn * DMat3::from_diagonal(DVec3::splat(scale)),
            floor.at(view, 0.0, far),
        ),
        scale,
        half_width_m: 0.97 * view.half.x * far / scale,
        length_m: floor.length_mm() / scale,
    };
    shell(&mut builder, &frame, key.with(1))?;
    furniture(&mut builder, drawn, view, &frame, key.with(2))?;
    let lamps = 1 + key.whole(3, 0, 1);
    for k in 0..u64::from(lamps) {
        let key = key.with(4).with(k);
        let parts = lamp(&mut builder, key, 30.0);
        let at = DVec3::new(
            key.range(0, -0.7, 0.7) * frame.half_width_m,
            key.range(1, 1.6, 2.1),
            key.range(2, 0.15, 0.6) * frame.length_m,
        );
        place(&mut builder, &frame, "lamp", parts, at, 0.0, 1.0);
    }
    glints(&mut builder, drawn, view, key.with(5));
    Ok(builder.finished([0.3, 0.32, 0.35]))
}

fn place(
    builder: &mut Builder,
    frame: &Frame,
    name: &str,
    parts: Parts,
    at_m: DVec3,
    turn_rad: f64,
    size: f64,
) {
    let axes = DAffine3::from_scale_rotation_translation(
        DVec3::splat(size),
        glam::DQuat::from_rotation_y(turn_rad),
        at_m,
    );
    builder.object(name, parts, frame.camera_from_room * axes);
}

/// Floor, back and side walls with skirting, light panels under an open ceiling.
fn shell(builder: &mut Builder, frame: &Frame, key: Key) -> Result<(), SceneError> {
    let (w, l) = (2.0 * frame.half_width_m, 3.0 * frame.length_m);
    let boards = ["wood", "tiles", "stone"][key.whole(0, 0, 2) as usize];
    let floor = matt(builder, key.with(1), boards)?;
    let lying = rectangle(w, l)
        .moved(DAffine3::from_rotation_x(-0.25 * TAU))
        .at(DVec3::Z * 0.5 * l);
    place(
        builder,
        frame,
        "floor",
        vec![(lying, floor)],
        DVec3::ZERO,
        0.0,
        1.0,
    );
    let papers = ["noise", "cloth", "stripes", "stone", "dead-leaves"];
    for (number, name) in ["back wall", "left wall", "right wall"]
        .into_iter()
        .enumerate()
    {
        let key = key.with(2 + number as u64);
        let kind = papers[key.whole(0, 0, papers.len() as u32 - 1) as usize];
        let paper = matt(builder, key, kind)?;
        let (shape, turn, at) = match number {
            0 => (rectangle(w, HEIGHT_M), 0.0, DVec3::ZERO),
            1 => (
                rectangle(l, HEIGHT_M),
                0.25 * TAU,
                DVec3::new(-0.5 * w, 0.0, 0.5 * l),
            ),
            _ => (
                rectangle(l, HEIGHT_M),
                -0.25 * TAU,
                DVec3::new(0.5 * w, 0.0, 0.5 * l),
            ),
        };
        let wall = shape.at(DVec3::Y * 0.5 * HEIGHT_M);
        place(builder, frame, name, vec![(wall, paper)], at, turn, 1.0);
    }
    // Two panels of the ceiling; E = Σ L A cos/d² is about 4 below them.
    for k in 0..2 {
        let side = 0.35 * w.min(frame.length_m);
        let radiance = (2.0 * HEIGHT_M * HEIGHT_M / (side * side)).min(80.0) as f32;
        let material = builder.material(Material::emitter([
            radiance,
            0.96 * radiance,
            0.88 * radiance,
        ]));
        let panel = rectangle(side, side).moved(DAffine3::from_rotation_x(0.25 * TAU));
        let z = frame.length_m * (0.25 + 0.5 * f64::from(k));
        place(
            builder,
            frame,
            "panel",
            vec![(panel, material)],
            DVec3::new(0.0, HEIGHT_M, z),
            0.0,
            1.0,
        );
    }
    Ok(())
}

fn furniture(
    builder: &mut Builder,
    drawn: &Drawn,
    view: &View,
    frame: &Frame,
    key: Key,
) -> Result<(), SceneError> {
    let camera_z_m = |depth: f64| (drawn.far_mm - depth) / frame.scale;
    for k in 0..u64::from(drawn.objects) {
        let key = key.with(k);
        let t = (k as f64 + key.uniform(0)) / f64::from(drawn.objects);
        let depth = drawn.depth_mm(0.1 + 0.85 * t);
        // As far to the side as the view goes at that depth.
        let reach = (1.1 * view.half.x * depth / frame.scale).min(frame.half_width_m - 0.3);
        let at = DVec3::new(
            key.range(1, -reach, reach),
            1e-4,
            camera_z_m(depth).max(0.3),
        );
        let turn = TAU * key.uniform(2);
        let spot = Spot { depth, at, turn };
        furnish(builder, drawn, frame, key, &spot)?;
    }
    Ok(())
}

/// Where a piece of furniture stands.
struct Spot {
    /// mm before the camera.
    depth: f64,
    /// In the room's frame.
    at: DVec3,
    turn: f64,
}

/// One piece of furniture on the floor, or something on the wall behind.
fn furnish(
    builder: &mut Builder,
    drawn: &Drawn,
    frame: &Frame,
    key: Key,
    spot: &Spot,
) -> Result<(), SceneError> {
    let &Spot { depth, at, turn } = spot;
    let on_wall = DVec3::new(
        key.range(3, -0.85, 0.85) * frame.half_width_m,
        key.range(4, 0.9, 2.0),
        0.02,
    );
    // Nearer than half of the far depth, only small things: they would fill the view.
    let small = depth < 0.5 * drawn.far_mm;
    match key.whole(5, 0, if small { 1 } else { 5 }) {
        0 | 1 => {
            let size = if small {
                0.9 * depth / drawn.far_mm
            } else {
                key.range(6, 0.4, 0.9)
            };
            let nature = Nature::draw(key, drawn.thin, drawn.clear);
            let parts = still_life(builder, key, nature)?;
            place(builder, frame, "piece", parts, at, turn, size);
        }
        2 => {
            let parts = chair(builder, key)?;
            place(builder, frame, "chair", parts, at, turn, 1.0);
        }
        3 => {
            let parts = table(builder, key, key.range(6, 0.7, 1.3))?;
            place(builder, frame, "table", parts, at, turn, 1.0);
            let nature = Nature::draw(key.with(7), drawn.thin, drawn.clear);
            let parts = still_life(builder, key.with(7), nature)?;
            place(
                builder,
                frame,
                "piece",
                parts,
                at + DVec3::Y * 0.751,
                turn,
                0.35,
            );
        }
        4 => {
            let parts = shelf(builder, key)?;
            let at = DVec3::new(on_wall.x, 0.0, 0.17);
            place(builder, frame, "shelf", parts, at, 0.0, 1.0);
        }
        _ => {
            let kind = KINDS[key.whole(8, 0, KINDS.len() as u32 - 1) as usize];
            let paint = matt(builder, key, kind)?;
            let picture = cuboid(DVec3::new(
                key.range(9, 0.3, 0.7),
                key.range(10, 0.3, 0.7),
                0.03,
            ));
            place(
                builder,
                frame,
                "picture",
                vec![(picture, paint)],
                on_wall,
                0.0,
                1.0,
            );
        }
    }
    Ok(())
}
