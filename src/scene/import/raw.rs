//! Triangles as a file gives them, and what is dropped of them before they are placed.
//!
//! A triangle is dropped, and counted, where an index is out of range, or a corner is not finite or lies beyond 10⁹
//! units of the file. Triangles without area, bad normals and bad texture coordinates are the world's own to mend and
//! count ([`crate::scene::world::WorldWarnings`]).

use glam::{DVec2, DVec3};

use super::Warnings;
use crate::scene::world::{MaterialIndices, TriangleMesh};

/// Farthest coordinate accepted, units of the file.
const FARTHEST: f64 = 1e9;

/// Corners and triangles; the vectors of normals, texture coordinates and colours are empty or as long as the
/// positions.
#[derive(Clone, Debug, Default)]
pub(super) struct RawMesh {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub uvs: Vec<DVec2>,
    /// Linear RGB and alpha.
    pub colours: Vec<[f64; 4]>,
    pub triangles: Vec<[u32; 3]>,
}

impl RawMesh {
    /// What it holds, bytes.
    pub fn bytes(&self) -> u64 {
        let corners = self.positions.len() + self.normals.len();
        let bytes = 24 * corners
            + 16 * self.uvs.len()
            + 32 * self.colours.len()
            + 12 * self.triangles.len();
        bytes as u64
    }

    /// Drops what cannot be rendered; `warnings` counts it.
    pub fn clean(&mut self, warnings: &mut Warnings) {
        let n = self.positions.len();
        fn as_many<T>(list: &mut Vec<T>, n: usize, what: &str, warnings: &mut Warnings) {
            if list.len() != n && !list.is_empty() {
                let what = format!("{what} that do not match the vertices in number: left out");
                warnings.count(what, 1);
                list.clear();
            }
        }
        as_many(&mut self.normals, n, "normals", warnings);
        as_many(&mut self.uvs, n, "texture coordinates", warnings);
        as_many(&mut self.colours, n, "vertex colours", warnings);
        let good = |p: &DVec3| p.is_finite() && p.abs().max_element() <= FARTHEST;
        let (mut beyond, mut not_finite) = (0, 0);
        let positions = &self.positions;
        self.triangles.retain(|t| {
            let [Some(a), Some(b), Some(c)] = t.map(|i| positions.get(i as usize)) else {
                beyond += 1;
                return false;
            };
            let kept = good(a) && good(b) && good(c);
            not_finite += u64::from(!kept);
            kept
        });
        warnings.count("triangles with an index out of range: dropped", beyond);
        warnings.count(
            "triangles with a corner that is not finite or beyond 1e9: dropped",
            not_finite,
        );
        for p in &mut self.positions {
            if !good(p) {
                *p = DVec3::ZERO; // no triangle uses it any more
            }
        }
    }

    /// The mesh as the world has it.
    pub fn into_mesh(self, name: String, material: usize) -> TriangleMesh {
        let corners = |v: Vec<DVec3>| v.into_iter().map(|p| p.as_vec3().to_array()).collect();
        let colours = self.colours.iter().map(|c| c.map(|x| x as f32));
        let colours: Vec<[f32; 4]> = colours.collect();
        let uvs: Vec<[f32; 2]> = self.uvs.iter().map(|uv| uv.as_vec2().to_array()).collect();
        TriangleMesh {
            name,
            positions_mm: corners(self.positions),
            normals: (!self.normals.is_empty()).then(|| corners(self.normals)),
            uvs: (!uvs.is_empty()).then_some(uvs),
            colours: (!colours.is_empty()).then_some(colours),
            triangles: self.triangles,
            materials: MaterialIndices::Mesh(material),
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_rendered_is_dropped_and_counted() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let mut mesh = RawMesh {
            positions: vec![
                p(0.0, 0.0),
                p(1.0, 0.0),
                p(0.0, 1.0),
                p(f64::NAN, 0.0),
                p(2e9, 0.0),
            ],
            normals: vec![DVec3::Z; 4],
            uvs: Vec::new(),
            colours: vec![[1.0; 4]; 5],
            triangles: vec![[0, 1, 2], [0, 1, 9], [0, 1, 3], [0, 1, 4]],
        };
        let mut warnings = Warnings::default();
        mesh.clean(&mut warnings);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert!(mesh.positions.iter().all(|p| p.is_finite()) && mesh.normals.is_empty());
        let counted: Vec<u64> = warnings.iter().map(|(_, n)| n).collect();
        assert_eq!(counted, [1, 2, 1], "{warnings}");
    }
}
