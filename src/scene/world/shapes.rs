//! Simple meshes, and a small world to try things on.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec3};

use super::description::{Instance, Material, MaterialIndices, TriangleMesh, WorldDescription};

impl TriangleMesh {
    /// A rectangle, `corner + s across + t down` with s and t (its texture coordinates) in 0..1. Its front is the side
    /// from which `across` points to the right when `down` points down.
    pub fn rectangle(corner: DVec3, across: DVec3, down: DVec3, material: usize) -> Self {
        let at = |s: f64, t: f64| (corner + s * across + t * down).as_vec3().to_array();
        Self {
            positions_mm: vec![at(0.0, 0.0), at(0.0, 1.0), at(1.0, 1.0), at(1.0, 0.0)],
            uvs: Some(vec![[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: MaterialIndices::Mesh(material),
            ..Self::default()
        }
    }

    /// A box between two corners, its fronts outside.
    pub fn cuboid(least: DVec3, greatest: DVec3, material: usize) -> Self {
        let side = greatest - least;
        let [x, y, z] = [DVec3::X * side.x, DVec3::Y * side.y, DVec3::Z * side.z];
        let faces = [
            (least + y + z, x, -y),
            (greatest - z, -x, -y),
            (greatest, -z, -y),
            (least + y, z, -y),
            (least + y, x, z),
            (least + z, x, -z),
        ];
        let mut all = Self {
            uvs: Some(Vec::new()),
            materials: MaterialIndices::Mesh(material),
            ..Self::default()
        };
        for (corner, across, down) in faces {
            let face = Self::rectangle(corner, across, down, material);
            let first = all.positions_mm.len() as u32;
            all.positions_mm.extend(face.positions_mm);
            if let (Some(uvs), Some(more)) = (&mut all.uvs, face.uvs) {
                uvs.extend(more);
            }
            let moved = face.triangles.iter().map(|t| t.map(|v| v + first));
            all.triangles.extend(moved);
        }
        all
    }

    /// A sphere about the origin with smooth normals: `rings` × 2 `rings` facets from pole to pole (y), u once around,
    /// v down.
    pub fn sphere(radius_mm: f64, rings: usize, material: usize) -> Self {
        let (rings, around) = (rings.max(2), 2 * rings.max(2));
        let mut mesh = Self {
            materials: MaterialIndices::Mesh(material),
            ..Self::default()
        };
        let (mut normals, mut uvs) = (Vec::new(), Vec::new());
        for row in 0..=rings {
            for column in 0..=around {
                let theta = PI * row as f64 / rings as f64;
                // The seam's last column repeats the first exactly.
                let phi = TAU * (column % around) as f64 / around as f64;
                let sin = if row == 0 || row == rings {
                    0.0
                } else {
                    theta.sin()
                };
                let n = DVec3::new(sin * phi.sin(), theta.cos(), sin * phi.cos());
                mesh.positions_mm.push((radius_mm * n).as_vec3().to_array());
                normals.push(n.as_vec3().to_array());
                uvs.push([column as f32 / around as f32, row as f32 / rings as f32]);
            }
        }
        let at = |row: usize, column: usize| (row * (around + 1) + column) as u32;
        for row in 0..rings {
            for column in 0..around {
                let [a, b] = [at(row, column), at(row, column + 1)];
                let [c, d] = [at(row + 1, column), at(row + 1, column + 1)];
                if row + 1 < rings {
                    mesh.triangles.push([a, c, d]);
                }
                if row > 0 {
                    mesh.triangles.push([a, d, b]);
                }
            }
        }
        mesh.normals = Some(normals);
        mesh.uvs = Some(uvs);
        mesh
    }
}

impl WorldDescription {
    /// Adds a mesh as one instance where it stands, and returns its index.
    pub fn add(&mut self, mesh: TriangleMesh, object_id: u16) -> usize {
        self.meshes.push(mesh);
        self.instances.push(Instance {
            mesh: self.meshes.len() - 1,
            camera_from_mesh: DAffine3::IDENTITY,
            object_id,
        });
        self.meshes.len() - 1
    }

    /// A box open to the camera, 400 mm wide, from 600 to 1000 mm away: red and green side walls, a lamp in its
    /// ceiling, a glass ball, a metal ball and a white block. Objects: 0 the walls, 1 the lamp, 2 the glass, 3 the
    /// metal, 4 the block.
    pub fn cornell_box() -> Self {
        let mut world = Self {
            materials: vec![
                Material::diffuse([0.73, 0.73, 0.73]),
                Material::diffuse([0.63, 0.065, 0.05]),
                Material::diffuse([0.14, 0.45, 0.091]),
                Material::emitter([15.0, 12.0, 8.0]),
                Material::glass(1.5),
                Material::metal([0.95, 0.78, 0.4], 0.25),
            ],
            ..Self::default()
        };
        let at = DVec3::new;
        let (wide, high, deep) = (
            at(400.0, 0.0, 0.0),
            at(0.0, 400.0, 0.0),
            at(0.0, 0.0, 400.0),
        );
        let far = at(-200.0, -200.0, -1000.0);
        let walls = [
            (far + high, wide, -high, 0),
            (far, wide, deep, 0),
            (far + high + deep, wide, -deep, 0),
            (far + high + deep, -deep, -high, 1),
            (far + high + wide, deep, -high, 2),
        ];
        for (corner, across, down, material) in walls {
            world.add(TriangleMesh::rectangle(corner, across, down, material), 0);
        }
        let lamp = at(-60.0, 199.0, -740.0);
        world.add(
            TriangleMesh::rectangle(lamp, at(120.0, 0.0, 0.0), at(0.0, 0.0, -120.0), 3),
            1,
        );
        for (object, material, centre, radius) in [
            (2, 4, at(80.0, -140.0, -720.0), 60.0),
            (3, 5, at(-90.0, -130.0, -850.0), 70.0),
        ] {
            world.add(TriangleMesh::sphere(radius, 48, material), object);
            if let Some(instance) = world.instances.last_mut() {
                instance.camera_from_mesh = DAffine3::from_translation(centre);
            }
        }
        world.add(
            TriangleMesh::cuboid(at(30.0, -200.0, -950.0), at(130.0, -20.0, -870.0), 0),
            4,
        );
        world
    }
}
