//! Worlds through a lens: truth at depth edges against a brute-force array of pinholes, and one render seen by many
//! sensors.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod edges;
mod record;
#[path = "../common/shots.rs"]
mod shots;

use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec2, DVec3};
use quadpixel::render::Camera;
use quadpixel::scene::Scene;
use quadpixel::scene::world::{
    Instance, Material, MaterialIndices, PathSettings, TriangleMesh, World, WorldDescription,
};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;
use shots::{PHONE, boxes, focused};

/// A shining rectangle.
struct Sheet {
    camera_from_sheet: DAffine3,
    half_mm: DVec2,
    radiance: f32,
}

/// A tilted card before the focus, partly before an upright one behind it, before a wall.
fn sheets() -> [Sheet; 3] {
    let sheet = |at: DVec3, turn: DMat3, half_mm, radiance| Sheet {
        camera_from_sheet: DAffine3::from_mat3_translation(turn, at),
        half_mm,
        radiance,
    };
    let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_z(0.3);
    [
        sheet(
            DVec3::new(1.0, 0.5, -250.0),
            turn,
            DVec2::new(4.0, 2.5),
            2.0,
        ),
        sheet(
            DVec3::new(12.0, -3.0, -900.0),
            DMat3::from_rotation_z(0.2),
            DVec2::new(10.0, 12.0),
            0.5,
        ),
        sheet(
            DVec3::new(0.0, 0.0, -2000.0),
            DMat3::IDENTITY,
            DVec2::splat(5000.0),
            1.0,
        ),
    ]
}

fn scene() -> Scene {
    let mut world = WorldDescription::default();
    for (k, sheet) in sheets().into_iter().enumerate() {
        let (x, y) = (sheet.half_mm.x as f32, sheet.half_mm.y as f32);
        world.meshes.push(TriangleMesh {
            positions_mm: vec![[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: MaterialIndices::Mesh(k),
            ..TriangleMesh::default()
        });
        world.materials.push(Material {
            two_sided: true,
            ..Material::emitter([sheet.radiance; 3])
        });
        world.instances.push(Instance {
            mesh: k,
            camera_from_mesh: sheet.camera_from_sheet,
            object_id: 10 + k as u16,
        });
    }
    Scene::from_world(
        Arc::new(World::new(world).unwrap()),
        PathSettings::default(),
    )
}

/// The five-element phone lens focused at 750 mm: at 250 mm the window sees 11 mm × 9 mm and the blur is 3 px.
fn camera(subpixels: (usize, usize), focal_um: f64, rule: ShiftRule) -> Camera {
    let response = boxes(subpixels.0, subpixels.1, 6.0, focal_um);
    let centre_mm = DVec2::new(0.03, 0.02);
    let sensor = Sensor::new(6.0, response.subpixels(), (32, 24), centre_mm).unwrap();
    let (lens, bands) = (focused(PHONE, 750.0), ChannelWavelengths::default());
    Camera::new(&lens, sensor, rule, &response, bands).unwrap()
}
