//! A world moved, turned and scaled as a whole, and the box around it.

use glam::{DAffine3, DMat3, DVec3};

use crate::scene::world::{Environment, Light, WorldDescription};

/// The world in another frame: every place, direction and panorama goes through `target_from_source`, a similarity.
///
/// Point lights keep their look when the world is scaled by s: their intensity (radiance × m²) goes with s².
pub fn placed(mut world: WorldDescription, target_from_source: DAffine3) -> WorldDescription {
    let linear = target_from_source.matrix3;
    let scale = linear.determinant().abs().cbrt();
    let direction = |d: DVec3| linear * d;
    let brighter = |i: [f32; 3]| i.map(|i| (f64::from(i) * scale * scale) as f32);
    for instance in &mut world.instances {
        instance.camera_from_mesh = target_from_source * instance.camera_from_mesh;
    }
    for light in &mut world.lights {
        match light {
            Light::Sun { direction: d, .. } => *d = direction(*d),
            Light::Point {
                position_mm,
                intensity_m2,
            } => {
                *position_mm = target_from_source.transform_point3(*position_mm);
                *intensity_m2 = brighter(*intensity_m2);
            }
            Light::Spot {
                position_mm,
                direction: d,
                intensity_m2,
                ..
            } => {
                *position_mm = target_from_source.transform_point3(*position_mm);
                *d = direction(*d);
                *intensity_m2 = brighter(*intensity_m2);
            }
        }
    }
    if let Environment::Map {
        camera_from_map, ..
    } = &mut world.environment
    {
        let rotation = DMat3::from_cols(
            linear.x_axis.normalize(),
            linear.y_axis.normalize(),
            linear.z_axis.normalize(),
        );
        *camera_from_map = rotation * *camera_from_map;
    }
    world
}

/// Lower and upper corner of the box around all placed triangles, in the world's frame; `None` without any.
pub fn bounds_mm(world: &WorldDescription) -> Option<(DVec3, DVec3)> {
    let mut bounds: Option<(DVec3, DVec3)> = None;
    for instance in &world.instances {
        let Some(mesh) = world.meshes.get(instance.mesh) else {
            continue;
        };
        for &i in mesh.triangles.iter().flatten() {
            let Some(&p) = mesh.positions_mm.get(i as usize) else {
                continue;
            };
            let p = DVec3::from(p.map(f64::from));
            let p = instance.camera_from_mesh.transform_point3(p);
            let (low, high) = bounds.unwrap_or((p, p));
            bounds = Some((low.min(p), high.max(p)));
        }
    }
    bounds
}
