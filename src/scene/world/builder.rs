//! Triangles of meshes, gathered in one frame, and their tree.

use glam::{DAffine3, DVec3, Vec3};

use super::bvh::{Bounds, Bvh};
use super::check::WorldWarnings;
use super::description::{MaterialIndices, TriangleMesh};
use super::geometry::{Geometry, Part, Triangle};
use super::pages::on_large_pages;
use super::repeated::drop_repeated;
use super::triangles::Packet;

/// A geometry under construction.
#[derive(Default)]
pub(super) struct Builder {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<[f32; 2]>,
    colours: Vec<[f32; 4]>,
    triangles: Vec<Triangle>,
    parts: Vec<Part>,
}

impl Builder {
    /// Whether it has no triangle.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Adds a mesh, moved, and counts what is wrong with it.
    pub fn add(
        &mut self,
        mesh: &TriangleMesh,
        move_by: &DAffine3,
        object_id: u16,
        warnings: &mut WorldWarnings,
    ) {
        let first = self.add_vertices(mesh, move_by, warnings);
        let mirrored = move_by.matrix3.determinant() < 0.0;
        let mut part = None::<(Part, u32)>;
        for (i, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            let vertices = [
                a,
                if mirrored { c } else { b },
                if mirrored { b } else { c },
            ]
            .map(|v| v + first);
            let corners = vertices.map(|v| self.positions[v as usize]);
            if !corners.iter().all(|p| p.is_finite()) {
                warnings.non_finite_triangles += 1;
                continue;
            }
            let [p, q, r] = corners.map(|p| p.as_dvec3());
            if (q - p).cross(r - p) == DVec3::ZERO {
                warnings.degenerate_triangles += 1;
                continue;
            }
            let wanted = Part {
                material: match &mesh.materials {
                    MaterialIndices::Mesh(index) => *index as u32,
                    MaterialIndices::Triangles(list) => list[i],
                },
                object_id,
            };
            let number = match part {
                Some((last, number)) if last == wanted => number,
                _ => {
                    self.parts.push(wanted);
                    self.parts.len() as u32 - 1
                }
            };
            part = Some((wanted, number));
            self.triangles.push(Triangle {
                vertices,
                part: number,
            });
        }
    }

    /// Adds the vertices of a mesh; every list of what vertices have is as long as that of positions, or empty. Returns
    /// the number of the first.
    fn add_vertices(
        &mut self,
        mesh: &TriangleMesh,
        move_by: &DAffine3,
        warnings: &mut WorldWarnings,
    ) -> u32 {
        let first = self.positions.len() as u32;
        let moved = |p: &[f32; 3]| {
            move_by
                .transform_point3(Vec3::from(*p).as_dvec3())
                .as_vec3()
        };
        self.positions.extend(mesh.positions_mm.iter().map(moved));
        if let Some(normals) = &mesh.normals {
            self.normals.resize(first as usize, Vec3::ZERO);
            let turn = move_by.matrix3.inverse().transpose();
            for n in normals {
                let turned = (turn * Vec3::from(*n).as_dvec3())
                    .normalize_or_zero()
                    .as_vec3();
                warnings.bad_normals += usize::from(turned == Vec3::ZERO);
                self.normals.push(turned);
            }
        }
        if let Some(uvs) = &mesh.uvs {
            self.uvs.resize(first as usize, [0.0; 2]);
            for uv in uvs {
                let good = uv.iter().all(|x| x.is_finite());
                warnings.bad_uvs += usize::from(!good);
                self.uvs.push(if good { *uv } else { [0.0; 2] });
            }
        }
        if let Some(colours) = &mesh.colours {
            self.colours.resize(first as usize, [1.0; 4]);
            for colour in colours {
                let mended = colour.map(|x| if x.is_nan() { 1.0 } else { x.clamp(0.0, 1.0) });
                warnings.bad_colours += usize::from(mended != *colour);
                self.colours.push(mended);
            }
        }
        if !self.normals.is_empty() {
            self.normals.resize(self.positions.len(), Vec3::ZERO);
        }
        if !self.uvs.is_empty() {
            self.uvs.resize(self.positions.len(), [0.0; 2]);
        }
        if !self.colours.is_empty() {
            self.colours.resize(self.positions.len(), [1.0; 4]);
        }
        first
    }

    /// Triangles of one material at the same corners, from the same side, are equal.
    fn drop_repeated(&mut self) -> usize {
        let mut triangles = std::mem::take(&mut self.triangles);
        let repeated = drop_repeated(&mut triangles, |t| {
            // Plus zero: of both zeros one.
            let bits = |v: u32| {
                (self.positions[v as usize] + 0.0)
                    .to_array()
                    .map(f32::to_bits)
            };
            let mut corners = t.vertices.map(bits);
            let least = (0..3).min_by_key(|&k| corners[k]).unwrap_or(0);
            corners.rotate_left(least);
            (corners, self.parts[t.part as usize].material)
        });
        self.triangles = triangles;
        repeated
    }

    /// The geometry, with its tree.
    pub fn finish(mut self, warnings: &mut WorldWarnings) -> Geometry {
        warnings.repeated += self.drop_repeated();
        let corners = |t: &Triangle| t.vertices.map(|v| self.positions[v as usize]);
        let boxes: Vec<Bounds> = self
            .triangles
            .iter()
            .map(|t| Bounds::from_points(corners(t)))
            .collect();
        let mut packets = on_large_pages(Vec::with_capacity(self.triangles.len() / 2));
        let bvh = Bvh::build(&boxes, |items| {
            let lanes: Vec<_> = items
                .iter()
                .map(|&i| {
                    let triangle = &self.triangles[i as usize];
                    (corners(triangle).map(|p| p.to_array()), i, triangle.part)
                })
                .collect();
            packets.push(Packet::new(&lanes));
        });
        Geometry {
            positions: self.positions,
            normals: self.normals,
            uvs: self.uvs,
            colours: self.colours,
            triangles: self.triangles,
            parts: self.parts,
            bvh,
            packets,
        }
    }
}
