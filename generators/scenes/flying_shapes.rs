//! Textured shapes in mid air, from the near depth to a backdrop, under a sun and an even sky.

use std::f64::consts::TAU;

use glam::{DAffine3, DMat3, DQuat, DVec3};
use quadpixel::scene::world::{Light, WorldDescription};

use super::builder::Builder;
use super::drawn::Drawn;
use super::error::SceneError;
use super::finish::matt;
use super::object::{Nature, flying, glint};
use super::pictures::{KINDS, colour};
use super::shape::Shape;
use super::view::View;
use crate::charts::keyed::Key;

/// Radiance of the sky.
const SKY: [f32; 3] = [0.35, 0.4, 0.45];

pub(super) fn build(drawn: &Drawn, view: &View) -> Result<WorldDescription, SceneError> {
    let key = Key::new(drawn.seed, "flying shapes");
    let mut builder = Builder::default();
    backdrop(&mut builder, drawn, view, key.with(1))?;
    for k in 0..u64::from(drawn.objects) {
        let key = key.with(2).with(k);
        // Stratified in disparity, so that near and far are both there however few the objects.
        let t = (k as f64 + key.uniform(0)) / f64::from(drawn.objects);
        let depth = drawn.depth_mm(0.97 * t);
        let spread = 1.05;
        let at = view.at(
            key.range(1, -spread, spread),
            key.range(2, -spread, spread),
            depth,
        );
        // The nearer half is kept smaller, or it would hide the rest.
        let largest = if t < 0.5 { 0.45 } else { 0.8 };
        let size = view.reach_mm(depth) * 0.12 * (largest / 0.12f64).powf(key.uniform(3));
        let nature = Nature::draw(key, drawn.thin, drawn.clear);
        let parts = flying(&mut builder, key, nature)?;
        let place = DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn(key), at);
        builder.object("shape", parts, place);
    }
    glints(&mut builder, drawn, view, key.with(3));
    let (sin, cos) = (key.range(10, -1.0, 1.0)).sin_cos();
    builder.light(Light::Sun {
        direction: DVec3::new(-sin, -key.range(11, 0.6, 1.4), -cos),
        irradiance: [1.9, 1.8, 1.65],
        half_angle_deg: 0.266,
    });
    Ok(builder.finished(SKY))
}

/// A random turn, even over all of them (K. Shoemake, Graphics Gems III (1992), p. 124).
fn turn(key: Key) -> DQuat {
    let (a, b) = ((1.0 - key.uniform(20)).sqrt(), key.uniform(20).sqrt());
    let ((s1, c1), (s2, c2)) = (
        (TAU * key.uniform(21)).sin_cos(),
        (TAU * key.uniform(22)).sin_cos(),
    );
    DQuat::from_xyzw(a * s1, a * c1, b * s2, b * c2)
}

/// A gently waved wall at the far depth, wider than the view and its blur.
fn backdrop(builder: &mut Builder, drawn: &Drawn, view: &View, key: Key) -> Result<(), SceneError> {
    let kind = KINDS[key.whole(0, 0, KINDS.len() as u32 - 1) as usize];
    let material = matt(builder, key, kind)?;
    let half = 2.0 * drawn.far_mm * view.half;
    let wave = 0.04 * view.reach_mm(drawn.far_mm);
    let tilt = DMat3::from_rotation_y(key.range(1, -0.3, 0.3))
        * DMat3::from_rotation_x(key.range(2, -0.3, 0.3));
    let wall = Shape::patch(40, 40, |u, v| {
        let ripple = (9.0 * u + 3.0 * v).sin() * (7.0 * v).cos();
        DVec3::new(
            (2.0 * u - 1.0) * half.x,
            (2.0 * v - 1.0) * half.y,
            wave * ripple,
        )
    });
    let place =
        DAffine3::from_mat3_translation(view.facing() * tilt, view.at(0.0, 0.0, drawn.far_mm));
    builder.object("backdrop", vec![(wall, material)], place);
    Ok(())
}

/// Small bright balls at all depths.
pub(super) fn glints(builder: &mut Builder, drawn: &Drawn, view: &View, key: Key) {
    for k in 0..u64::from(drawn.glints) {
        let key = key.with(k);
        let depth = drawn.depth_mm(0.95 * key.uniform(0));
        let at = view.at(key.range(1, -1.0, 1.0), key.range(2, -0.6, 1.0), depth);
        let radius = view.reach_mm(depth) * key.range(3, 0.002, 0.007);
        let strength = (20.0 * 15f64.powf(key.uniform(4))) as f32;
        let radiance = colour(key.with(5)).map(|c| strength * (0.4 + 0.6 * c));
        let parts = glint(builder, radius, radiance);
        builder.object("glint", parts, DAffine3::from_translation(at));
    }
}
