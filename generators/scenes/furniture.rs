//! Chairs, tables, shelves and lamps, standing on y = 0 or hanging, drawn from a seed.

use glam::DVec3;
use quadpixel::scene::world::Material;

use super::builder::Builder;
use super::error::SceneError;
use super::finish::{metal, opaque, slender};
use super::object::{Parts, ROUND, glint};
use super::shape::{Shape, cuboid, cylinder, lathe};
use super::thin::wire;
use crate::charts::keyed::Key;

/// A chair, 1 high.
pub(super) fn chair(builder: &mut Builder, key: Key) -> Result<Parts, SceneError> {
    let (frame, seat) = (opaque(builder, key)?, opaque(builder, key.with(1))?);
    let leg =
        |x: f64, z: f64, h: f64| cuboid(DVec3::new(0.04, h, 0.04)).at(DVec3::new(x, 0.5 * h, z));
    let legs = leg(-0.2, 0.2, 0.45)
        .with(&leg(0.2, 0.2, 0.45))
        .with(&leg(-0.2, -0.2, 1.0))
        .with(&leg(0.2, -0.2, 1.0));
    let slat = |y: f64| cuboid(DVec3::new(0.4, 0.06, 0.02)).at(DVec3::new(0.0, y, -0.2));
    let back = (0..3).fold(Shape::default(), |s, k| {
        s.with(&slat(0.6 + 0.15 * f64::from(k)))
    });
    let board = cuboid(DVec3::new(0.46, 0.04, 0.46)).at(DVec3::Y * 0.46);
    Ok(vec![(legs.with(&back), frame), (board, seat)])
}

/// A table, 0.75 high, with `width`.
pub(super) fn table(builder: &mut Builder, key: Key, width: f64) -> Result<Parts, SceneError> {
    let depth = key.range(0, 0.6, 0.9);
    let leg = |x: f64, z: f64| {
        cylinder(0.03, 0.72, 16).at(DVec3::new(
            x * (0.5 * width - 0.06),
            0.0,
            z * (0.5 * depth - 0.06),
        ))
    };
    let legs = leg(-1.0, -1.0)
        .with(&leg(1.0, -1.0))
        .with(&leg(-1.0, 1.0))
        .with(&leg(1.0, 1.0));
    let board = cuboid(DVec3::new(width, 0.03, depth)).at(DVec3::Y * 0.735);
    Ok(vec![
        (legs, slender(builder, key)),
        (board, opaque(builder, key.with(1))?),
    ])
}

/// A shelf with books, 2 high.
pub(super) fn shelf(builder: &mut Builder, key: Key) -> Result<Parts, SceneError> {
    let board = |y: f64| cuboid(DVec3::new(0.9, 0.03, 0.3)).at(DVec3::Y * y);
    let side = |x: f64| cuboid(DVec3::new(0.03, 2.0, 0.3)).at(DVec3::new(x, 1.0, 0.0));
    let levels = 5;
    let rack = (0..=levels).fold(side(-0.45).with(&side(0.45)), |s, k| {
        s.with(&board(0.02 + 1.96 * f64::from(k) / f64::from(levels)))
    });
    let mut parts = vec![(rack, opaque(builder, key)?)];
    for level in 0..levels as u64 {
        let key = key.with(10 + level);
        let mut x = -0.42;
        let mut row = [Shape::default(), Shape::default()];
        for k in 0.. {
            let (w, h) = (
                key.with(k).range(0, 0.02, 0.06),
                key.with(k).range(1, 0.2, 0.33),
            );
            if x + w > key.range(2, 0.1, 0.42) {
                break;
            }
            let foot = 0.035 + 1.96 * level as f64 / levels as f64;
            let book = cuboid(DVec3::new(w * 0.96, h, 0.2)).at(DVec3::new(
                x + 0.5 * w,
                foot + 0.5 * h,
                0.02,
            ));
            let pile = &mut row[k as usize % 2];
            *pile = std::mem::take(pile).with(&book);
            x += w;
        }
        for (k, pile) in row.into_iter().enumerate() {
            if !pile.triangles.is_empty() {
                parts.push((pile, opaque(builder, key.with(50 + k as u64))?));
            }
        }
    }
    Ok(parts)
}

/// A hanging lamp: a lit ball in a metal shade.
pub(super) fn lamp(builder: &mut Builder, key: Key, radiance: f32) -> Parts {
    let shade = lathe(&[(0.3, 0.0), (0.12, 0.25), (0.03, 0.3)], ROUND);
    let inner = lathe(&[(0.027, 0.295), (0.117, 0.245), (0.297, 0.0)], ROUND);
    let paint = builder.material(Material {
        two_sided: true,
        ..metal(key)
    });
    let mut parts = glint(builder, 0.09, [radiance, 0.9 * radiance, 0.72 * radiance]);
    parts[0].0 = std::mem::take(&mut parts[0].0).at(DVec3::Y * 0.08);
    let cord = wire(DVec3::Y * 0.3, DVec3::Y * 3.0, 0.008);
    parts.push((shade.with(&inner).with(&cord), paint));
    parts
}
