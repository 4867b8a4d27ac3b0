//! A glTF primitive as triangles: lists, strips and fans, with or without indices, moved by its morph targets.

use glam::{DVec2, DVec3};

use super::Warnings;
use super::accessor::Buffers;
use super::json::Primitive;
use super::raw::RawMesh;

/// The triangles of a primitive with its morph targets at these weights; `None` for points, lines, or without
/// positions.
pub(super) fn primitive_mesh(
    buffers: &Buffers<'_>,
    p: &Primitive,
    morph_weights: &[f64],
    warnings: &mut Warnings,
) -> Result<Option<RawMesh>, String> {
    let mode = p.mode.unwrap_or(4);
    let Some(position) = p.attributes.position else {
        return Ok(None);
    };
    if !(4..=6).contains(&mode) {
        return Ok(None);
    }
    let vectors = |index: Option<usize>| -> Result<Vec<DVec3>, String> {
        let values = index.map(|i| buffers.read::<3>(i)).transpose()?;
        Ok(values
            .unwrap_or_default()
            .into_iter()
            .map(DVec3::from)
            .collect())
    };
    let mut positions = vectors(Some(position))?;
    let mut normals = vectors(p.attributes.normal)?;
    for (target, &weight) in p.targets.iter().zip(morph_weights) {
        if weight == 0.0 {
            continue;
        }
        add(&mut positions, &vectors(target.position)?, weight);
        add(&mut normals, &vectors(target.normal)?, weight);
        let others = target.uv.is_some() || target.colour.is_some();
        let what = "morph targets of texture coordinates or colours: at rest in these";
        warnings.count(what, u64::from(others));
    }
    let colours = p
        .attributes
        .colour
        .map(|i| buffers.colours(i))
        .transpose()?;
    let uvs = p.attributes.uv.map(|i| buffers.read::<2>(i)).transpose()?;
    let indices: Vec<u32> = match p.indices {
        // The cast saturates: what is no vertex number is out of range, and dropped when cleaned.
        Some(i) => buffers
            .read::<1>(i)?
            .into_iter()
            .map(|[i]| i as u32)
            .collect(),
        None => (0..positions.len() as u32).collect(),
    };
    let triangles = match mode {
        4 => indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
        // Every second triangle of a strip runs the other way round.
        5 => (indices.windows(3).enumerate())
            .map(|(k, t)| [t[0], t[1 + k % 2], t[2 - k % 2]])
            .collect(),
        _ => (indices.windows(2).skip(1))
            .map(|t| [indices[0], t[0], t[1]])
            .collect(),
    };
    Ok(Some(RawMesh {
        normals,
        uvs: uvs
            .unwrap_or_default()
            .into_iter()
            .map(DVec2::from)
            .collect(),
        colours: colours.unwrap_or_default(),
        positions,
        triangles,
    }))
}

/// Adds a target's displacements.
fn add(values: &mut [DVec3], displacements: &[DVec3], weight: f64) {
    for (value, displacement) in values.iter_mut().zip(displacements) {
        *value += weight * *displacement;
    }
}
