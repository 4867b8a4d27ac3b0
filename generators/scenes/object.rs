//! Objects of unit height or so, standing on y = 0, drawn from a seed.

use glam::{DAffine3, DMat3, DVec3};
use quadpixel::scene::world::Material;

use super::builder::Builder;
use super::error::SceneError;
use super::finish::{clear, cut_out, opaque, slender};
use super::shape::{Shape, cone, cuboid, cylinder, icosahedron, lathe, sphere, torus};
use super::thin::{fence, knot, plant, spring, wire};
use crate::charts::keyed::Key;

/// Cells around a round object.
pub(super) const ROUND: usize = 48;

/// Parts of an object: shapes and their materials.
pub(super) type Parts = Vec<(Shape, usize)>;

/// What an object is mostly made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nature {
    /// Solid and opaque.
    Opaque,
    /// Wires, leaves, gratings.
    Thin,
    /// Glass, panes, veils.
    Clear,
}

impl Nature {
    /// Drawn so that `thin` and `clear` (0 to 1) are the shares of theirs.
    pub fn draw(key: Key, thin: f64, clear: f64) -> Self {
        let x = key.uniform(900);
        if x < thin {
            Self::Thin
        } else if x < thin + clear {
            Self::Clear
        } else {
            Self::Opaque
        }
    }
}

/// A piece of a still life, about 1 high, standing on y = 0.
pub(super) fn still_life(
    builder: &mut Builder,
    key: Key,
    nature: Nature,
) -> Result<Parts, SceneError> {
    let kind = key.whole(901, 0, 5);
    Ok(match nature {
        Nature::Thin => thin_piece(builder, key, kind)?,
        Nature::Clear => match kind {
            0 | 1 => vec![(
                sphere(0.5, ROUND).at(DVec3::Y * 0.5),
                clear(builder, key, true),
            )],
            2 | 3 => vec![(bottle(key), clear(builder, key, true))],
            4 => vec![(
                cuboid(DVec3::new(0.5, 0.9, 0.5)).at(DVec3::Y * 0.45),
                clear(builder, key, true),
            )],
            _ => vec![(
                cuboid(DVec3::new(0.8, 1.0, 0.02)).at(DVec3::Y * 0.5),
                clear(builder, key, false),
            )],
        },
        Nature::Opaque => match kind {
            0 => vec![(
                sphere(0.45, ROUND).at(DVec3::Y * 0.45),
                opaque(builder, key)?,
            )],
            1 => vec![(bottle(key), opaque(builder, key)?)],
            2 => vec![(cup(key.range(902, 0.2, 0.35), 0.5), opaque(builder, key)?)],
            3 => books(builder, key)?,
            4 => vec![(
                cuboid(DVec3::new(
                    key.range(902, 0.4, 0.9),
                    key.range(903, 0.3, 1.0),
                    key.range(904, 0.3, 0.7),
                ))
                .at(DVec3::Y * 0.5 * key.range(903, 0.3, 1.0)),
                opaque(builder, key)?,
            )],
            _ => vec![(cone(0.35, 0.9, ROUND), opaque(builder, key)?)],
        },
    })
}

/// A plant in a pot, a spring, a grating, needles in a cup.
fn thin_piece(builder: &mut Builder, key: Key, kind: u32) -> Result<Parts, SceneError> {
    Ok(match kind {
        0 | 1 => {
            let material = if key.uniform(902) < 0.5 {
                cut_out(builder, key)?
            } else {
                slender(builder, key)
            };
            let pot = lathe(
                &[
                    (0.0, 0.0),
                    (0.12, 0.0),
                    (0.12, 0.0),
                    (0.17, 0.25),
                    (0.17, 0.25),
                    (0.0, 0.22),
                ],
                ROUND,
            );
            let leaves = plant(key, 0.85, u64::from(key.whole(903, 9, 24)));
            let pot_material = opaque(builder, key.with(1))?;
            vec![(leaves.at(DVec3::Y * 0.2), material), (pot, pot_material)]
        }
        2 => {
            let coil = spring(0.22, 0.9, key.range(902, 5.0, 9.0), 0.012);
            vec![(coil.at(DVec3::Y * 0.48), slender(builder, key))]
        }
        3 => {
            let bars = key.whole(902, 5, 12) as usize;
            let grating = fence(0.8, 1.0, bars, key.range(904, 0.006, 0.02));
            vec![(grating.at(DVec3::Y * 0.5), slender(builder, key))]
        }
        _ => {
            // Brushes or knitting needles in a cup.
            let needle = |k: u64| {
                let key = key.with(k);
                let foot = DVec3::new(key.range(0, -0.08, 0.08), 0.03, key.range(1, -0.08, 0.08));
                let top = foot
                    + DVec3::new(
                        key.range(2, -0.2, 0.2),
                        key.range(3, 0.75, 1.0),
                        key.range(4, -0.2, 0.2),
                    );
                wire(foot, top, key.range(5, 0.006, 0.014))
            };
            let needles = (0..7).fold(Shape::default(), |s, k| s.with(&needle(k)));
            let material = slender(builder, key);
            vec![
                (needles, material),
                (cup(0.16, 0.4), opaque(builder, key.with(1))?),
            ]
        }
    })
}

/// Something that flies: about 1 across, around the origin.
pub(super) fn flying(builder: &mut Builder, key: Key, nature: Nature) -> Result<Parts, SceneError> {
    let kind = key.whole(901, 0, 6);
    let shape = match nature {
        Nature::Thin => match kind {
            0 | 1 => spring(
                0.3,
                1.0,
                key.range(902, 3.0, 7.0),
                key.range(903, 0.008, 0.025),
            ),
            2 => torus(0.48, key.range(903, 0.008, 0.02), ROUND),
            3 | 4 => fence(
                1.0,
                1.0,
                key.whole(902, 4, 14) as usize,
                key.range(903, 0.005, 0.018),
            ),
            5 => wire(
                DVec3::new(0.0, -0.8, 0.0),
                DVec3::new(0.0, 0.8, 0.0),
                key.range(903, 0.004, 0.015),
            ),
            _ => knot(0.5, key.range(903, 0.012, 0.03)),
        },
        _ => match kind {
            0 => sphere(0.5, ROUND),
            1 => cuboid(DVec3::new(
                0.8,
                key.range(902, 0.3, 0.8),
                key.range(903, 0.2, 0.8),
            )),
            2 => torus(0.36, key.range(902, 0.08, 0.18), ROUND),
            3 => cylinder(0.3, 0.9, ROUND).at(DVec3::Y * -0.45),
            4 => cone(0.45, 0.9, ROUND).at(DVec3::Y * -0.45),
            5 => icosahedron(0.5),
            _ => knot(0.5, 0.12),
        },
    };
    let material = match nature {
        Nature::Opaque => opaque(builder, key)?,
        Nature::Thin if key.uniform(904) < 0.15 => cut_out(builder, key)?,
        Nature::Thin => slender(builder, key),
        Nature::Clear => clear(builder, key, key.uniform(904) < 0.7),
    };
    Ok(vec![(shape, material)])
}

/// A bright ball of the given radiance: a lamp far off, a glint.
pub(super) fn glint(builder: &mut Builder, radius: f64, radiance: [f32; 3]) -> Parts {
    let material = builder.material(Material::emitter(radiance));
    vec![(sphere(radius, 8), material)]
}

fn cup(radius: f64, height: f64) -> Shape {
    let (outer, inner) = (radius, 0.9 * radius);
    let (rim, floor) = ((outer, height), (0.85 * inner, 0.05 * height));
    lathe(
        &[
            (0.0, 0.0),
            (0.85 * outer, 0.0),
            (0.85 * outer, 0.0),
            rim,
            rim,
            (inner, height),
            (inner, height),
            floor,
            floor,
            (0.0, 0.05 * height),
        ],
        ROUND,
    )
}

fn bottle(key: Key) -> Shape {
    let (belly, neck) = (key.range(910, 0.16, 0.26), key.range(911, 0.05, 0.08));
    let shoulder = key.range(912, 0.45, 0.65);
    let curve = |k: usize| {
        let t = f64::from(k as u32) / 8.0;
        let s = t * t * (3.0 - 2.0 * t);
        (belly + s * (neck - belly), shoulder + 0.2 * t)
    };
    let mut profile = vec![(0.0, 0.0), (belly, 0.0), (belly, 0.0), (belly, shoulder)];
    profile.extend((1..=8).map(curve));
    profile.extend([(neck, 1.0), (neck, 1.0), (0.0, 1.0)]);
    lathe(&profile, ROUND)
}

fn books(builder: &mut Builder, key: Key) -> Result<Parts, SceneError> {
    let mut parts = Vec::new();
    let mut y = 0.0;
    for k in 0..u64::from(key.whole(902, 2, 5)) {
        let key = key.with(k);
        let h = key.range(0, 0.06, 0.16);
        let turn = DMat3::from_rotation_y(key.range(1, -0.4, 0.4));
        let size = DVec3::new(key.range(2, 0.5, 0.75), h, key.range(3, 0.35, 0.5));
        let book = cuboid(size)
            .moved(DAffine3::from_mat3(turn))
            .at(DVec3::Y * (y + 0.5 * h));
        parts.push((book, opaque(builder, key)?));
        y += h;
    }
    Ok(parts)
}
