//! A world of slanted walls, cards and thin bars, whose textures shine.

use std::sync::Arc;

use glam::DVec3;
use quadpixel::render::truth::DisparityField;
use quadpixel::scene::Scene;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::world::{
    Material, PathSettings, TextureMap, TextureRef, TriangleMesh, World, WorldDescription, Wrap,
};
use quadpixel::sensor::Sensor;

/// Texels along a side.
const TEXELS: usize = 1024;

/// The scene before a camera. Everything is placed by the pixels of the sum that show it, in shares of the window.
pub fn scene(field: &DisparityField, sensor: &Sensor) -> Scene {
    let mut world = WorldDescription::default();
    let (width, height) = (sensor.width() as f64, sensor.height() as f64);
    // The window's own lines of sight, continued beyond it.
    let line = |x: f64, y: f64| field.sight_line(sensor.position_mm(x, y));
    let at = |x: f64, y: f64, depth: f64| {
        let place = |x: f64, y: f64| line(x, y).q0 * depth + line(x, y).q1_mm;
        let (origin, right, down) = (place(0.0, 0.0), place(width, 0.0), place(0.0, height));
        (origin + (right - origin) * x + (down - origin) * y).extend(-depth)
    };
    // Left, top, right, bottom; depth of the upper left, upper right and lower left corner, mm; the fourth's is that of
    // their plane.
    let mut add = |[x0, y0, x1, y1]: [f64; 4], [d0, d1, d2]: [f64; 3]| {
        let kind = world.materials.len();
        let d3 = 1.0 / (1.0 / d1 + 1.0 / d2 - 1.0 / d0);
        let corners = [
            at(x0, y0, d0),
            at(x0, y1, d2),
            at(x1, y1, d3),
            at(x1, y0, d1),
        ];
        // Waves as long as so many pixels, wherever the surface is.
        let (columns, rows) = ((x1 - x0) * width, (y1 - y0) * height);
        let texture = Texture::from_fn(TEXELS, TEXELS, |i, j| {
            let (u, v) = (i as f64 / TEXELS as f64, j as f64 / TEXELS as f64);
            waves(u * columns, v * rows, kind as f64)
        });
        let wrap = [Wrap::Clamp; 2];
        (world.textures).push(TextureMap::from_texture(&texture.unwrap(), wrap));
        world.materials.push(Material {
            emission: [1.0; 3],
            emission_texture: Some(TextureRef::new(kind)),
            two_sided: true,
            ..Material::diffuse([0.0; 3])
        });
        let mut face = TriangleMesh::rectangle(DVec3::ZERO, DVec3::X, -DVec3::Y, kind);
        face.positions_mm = corners.map(|p| p.as_vec3().to_array()).to_vec();
        world.add(face, kind as u16);
    };
    // A wall that recedes to the right, a floor, a card square to the axis, a tilted one, and bars.
    add([-0.6, -0.6, 1.6, 1.6], [550.0, 2400.0, 550.0]);
    add([-0.6, 0.72, 1.6, 1.2], [700.0, 700.0, 250.0]);
    add([0.18, 0.15, 0.42, 0.62], [320.0, 320.0, 320.0]);
    add([0.52, 0.2, 0.74, 0.6], [260.0, 420.0, 260.0]);
    for k in 0..3 {
        let left = 0.8 + 0.06 * f64::from(k);
        add([left, 0.1, left + 0.012, 0.66], [450.0; 3]);
    }
    let settings = PathSettings {
        max_bounces: 0,
        ..PathSettings::default()
    };
    Scene::from_world(Arc::new(World::new(world).unwrap()), settings)
}

/// Radiance, 0.1 to 0.9, with waves of 6 to 20 px.
fn waves(x: f64, y: f64, kind: f64) -> [f32; 3] {
    [0.0, 1.0, 2.0].map(|c: f64| {
        let a = (0.9 * x + 0.35 * y + 1.3 * c + kind).sin();
        let b = (0.31 * x - 0.62 * y + 0.7 * c + 2.0 * kind).sin();
        let base = 0.35 + 0.3 * (1.7 * kind + 0.5 * c).sin().abs();
        (base + 0.12 * a + 0.12 * b) as f32
    })
}
