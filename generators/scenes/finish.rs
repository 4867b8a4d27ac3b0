//! Finishes of surfaces, drawn from a seed: matt and textured paint, plastic, lacquer, metals, mirrors, glass, veils.

use quadpixel::scene::world::{Alpha, Material};

use super::builder::Builder;
use super::error::SceneError;
use super::pictures::{KINDS, colour, lace, picture};
use crate::charts::keyed::Key;

/// Reflectance at normal incidence of metals, linear RGB: iron, copper, gold, aluminium, silver (from tabulated n and
/// k: P. B. Johnson and R. W. Christy (1972, 1974); A. D. Rakić (1995), rounded to two digits).
const METALS: [[f32; 3]; 5] = [
    [0.56, 0.57, 0.58],
    [0.95, 0.64, 0.54],
    [1.00, 0.77, 0.34],
    [0.91, 0.92, 0.92],
    [0.97, 0.96, 0.91],
];

/// Something solid and opaque; seven in ten carry a picture.
pub(super) fn opaque(builder: &mut Builder, key: Key) -> Result<usize, SceneError> {
    let kind = key.uniform(100);
    if kind < 0.12 {
        return Ok(builder.material(metal(key)));
    }
    let mut material = match key.whole(101, 0, 2) {
        // Matt paint, plastic, lacquer.
        0 => Material::diffuse([1.0; 3]),
        1 => Material {
            roughness: key.range(102, 0.25, 0.6) as f32,
            ..Material::default()
        },
        _ => Material {
            roughness: key.range(102, 0.08, 0.25) as f32,
            ..Material::default()
        },
    };
    if kind < 0.82 {
        material.base_colour_texture = Some(textured(builder, key)?);
    } else {
        material.base_colour = colour(key.with(103));
    }
    Ok(builder.material(material))
}

/// Something matt with a picture: floors, walls, cloths.
pub(super) fn matt(builder: &mut Builder, key: Key, kind: &str) -> Result<usize, SceneError> {
    let map = picture(kind, key)?;
    let texture = builder.picture(map);
    Ok(builder.material(Material {
        base_colour_texture: Some(texture),
        two_sided: true,
        ..Material::diffuse([1.0; 3])
    }))
}

/// A lacy leaf or cloth, cut out.
pub(super) fn cut_out(builder: &mut Builder, key: Key) -> Result<usize, SceneError> {
    let texture = builder.picture(lace(key)?);
    Ok(builder.material(Material {
        base_colour_texture: Some(texture),
        alpha: Alpha::Mask {
            alpha: 1.0,
            cutoff: 0.5,
        },
        two_sided: true,
        ..Material::diffuse([1.0; 3])
    }))
}

/// Glass, a tinted pane, or a veil.
pub(super) fn clear(builder: &mut Builder, key: Key, solid: bool) -> usize {
    let tint = colour(key.with(3)).map(|c| 0.6 + 0.4 * c);
    builder.material(if solid {
        Material {
            base_colour: tint,
            ..Material::glass(key.range(0, 1.33, 1.6) as f32)
        }
    } else if key.uniform(1) < 0.5 {
        Material {
            base_colour: tint,
            thin_walled: true,
            ..Material::glass(1.5)
        }
    } else {
        Material {
            alpha: Alpha::Blend {
                alpha: key.range(2, 0.3, 0.7) as f32,
            },
            two_sided: true,
            ..Material::diffuse(colour(key.with(4)))
        }
    })
}

/// A metal, rough, brushed or polished.
pub(super) fn metal(key: Key) -> Material {
    let kind = METALS[key.whole(110, 0, METALS.len() as u32 - 1) as usize];
    Material::metal(kind, key.range(111, 0.1, 0.6) as f32)
}

/// A thin structure's paint or metal.
pub(super) fn slender(builder: &mut Builder, key: Key) -> usize {
    let material = if key.uniform(0) < 0.4 {
        metal(key)
    } else {
        Material {
            roughness: 0.4,
            ..Material::diffuse(colour(key.with(1)))
        }
    };
    builder.material(material)
}

fn textured(
    builder: &mut Builder,
    key: Key,
) -> Result<quadpixel::scene::world::TextureRef, SceneError> {
    let kind = KINDS[key.whole(120, 0, KINDS.len() as u32 - 1) as usize];
    Ok(builder.picture(picture(kind, key.with(121))?))
}
