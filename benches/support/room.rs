//! The room of 250,000 triangles that path tracing is timed on.
//!
//! It is 4 m wide, 2.5 m high and 5 m deep, its fifth side open behind the camera; the walls are diffuse and finely
//! tessellated, with bumps; 20 spheres hang in it, all flat-shaded, every fourth of them rough metal; a lamp of 1 m × 1
//! m hangs below the ceiling.

use glam::{DAffine3, DVec3};
use quadpixel::sampling::uniform;
use quadpixel::scene::world::{Material, MaterialIndices, TriangleMesh, WorldDescription};

/// One mesh an instance and one material a mesh.
pub fn room() -> WorldDescription {
    let mut world = WorldDescription {
        materials: vec![
            Material::diffuse([0.7; 3]),
            Material::diffuse([0.6, 0.1, 0.1]),
            Material::diffuse([0.1, 0.5, 0.1]),
            Material::metal([1.0; 3], 0.5),
            Material::emitter([12.0; 3]),
        ],
        ..WorldDescription::default()
    };
    let (wide, high, deep) = (4000.0, 2500.0, 5000.0);
    let far = DVec3::new(-0.5 * wide, -1200.0, -deep - 200.0);
    let (x, y, z) = (DVec3::X * wide, DVec3::Y * high, DVec3::Z * deep);
    let walls = [
        (far + y, x, -y, 0),
        (far, x, z, 0),
        (far + y + z, x, -z, 0),
        (far + y + z, -z, -y, 1),
        (far + y + x, z, -y, 2),
    ];
    for (corner, across, down, material) in walls {
        world.add(wall(corner, across, down, 120, material), 0);
    }
    for k in 0..20u64 {
        let u = |d| uniform(42, &[k, d]);
        let radius = 120.0 + 180.0 * u(0);
        let centre = DVec3::new(
            (u(1) - 0.5) * 3000.0,
            -1200.0 + radius + 900.0 * u(2) * u(2),
            -1800.0 - 2900.0 * u(3),
        );
        // A mesh each: all in one tree, as in the exported scene.
        let material = if k % 4 == 0 { 3 } else { (k % 3) as usize };
        let mut sphere = TriangleMesh::sphere(radius, 37, material);
        sphere.normals = None;
        world.add(sphere, k as u16 + 1);
        if let Some(instance) = world.instances.last_mut() {
            instance.camera_from_mesh = DAffine3::from_translation(centre);
        }
    }
    let lamp = DVec3::new(-500.0, 1250.0, -2500.0);
    world.add(
        TriangleMesh::rectangle(lamp, DVec3::X * 1000.0, DVec3::Z * -1000.0, 4),
        30,
    );
    world
}

/// A wall of `cells`² squares with bumps of up to 5 mm, flat at its border so that walls meet.
fn wall(corner: DVec3, across: DVec3, down: DVec3, cells: usize, material: usize) -> TriangleMesh {
    let front = down.cross(across).normalize();
    let mut mesh = TriangleMesh {
        materials: MaterialIndices::Mesh(material),
        ..TriangleMesh::default()
    };
    for j in 0..=cells {
        for i in 0..=cells {
            let is_border = i == 0 || j == 0 || i == cells || j == cells;
            let bump = if is_border {
                0.0
            } else {
                5.0 * uniform(43, &[material as u64, i as u64, j as u64])
            };
            let (s, t) = (i as f64 / cells as f64, j as f64 / cells as f64);
            let p = corner + s * across + t * down + bump * front;
            mesh.positions_mm.push(p.as_vec3().to_array());
        }
    }
    let at = |i: usize, j: usize| (j * (cells + 1) + i) as u32;
    for j in 0..cells {
        for i in 0..cells {
            let (a, b) = (at(i, j), at(i + 1, j));
            let (c, d) = (at(i, j + 1), at(i + 1, j + 1));
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    mesh
}
