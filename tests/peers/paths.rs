//! Scenes for a comparison with an independent path tracer (`tests/peers/mitsuba_paths.py`): their meshes as PLY, one
//! file per material, and our pictures of them by a pinhole and by a thin lens, with the variance of every pixel.
//!
//! ```text
//! cargo run --release --example peer_paths -- FOLDER [paths per pixel, default 256]
//! ```

#[path = "../../benches/support/room.rs"]
mod room;

use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use quadpixel::image::Image;
use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};
use quadpixel::sampling::{concentric_disk, uniform};
use quadpixel::scene::world::{
    Environment, Light, Material, MaterialIndices, PathKey, PathSettings, TriangleMesh, World,
    WorldDescription,
};
use rayon::prelude::*;

const SIDE_PX: usize = 96;
const SETTINGS: PathSettings = PathSettings {
    max_bounces: 7,
    roulette_after: u32::MAX,
    clamp: None,
};

/// A camera at the origin towards −z: half the angle of view as a tangent, a lens of some radius in focus at some
/// depth.
struct Camera {
    half_width: f64,
    radius_mm: f64,
    focus_mm: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("give a folder")?;
    let paths = arguments.next().map_or(Ok(256), |n| n.parse())?;
    let folder = Path::new(&folder);
    write_plys(&room::room(), &folder.join("speed"))?;
    let pinhole = |half_width| Camera {
        half_width,
        radius_mm: 0.0,
        focus_mm: 1.0,
    };
    let thin = |half_width, focus_mm| Camera {
        half_width,
        radius_mm: 15.0,
        focus_mm,
    };
    let panorama = Arc::new(panorama());
    let scenes = [
        ("box", boxed(), [pinhole(0.28), thin(0.28, 720.0)]),
        ("open", open(panorama), [pinhole(0.35), thin(0.35, 700.0)]),
    ];
    for (name, description, cameras) in scenes {
        write_plys(&description, &folder.join(name))?;
        let world = World::new(description)?;
        for (camera, kind) in cameras.iter().zip(["pinhole", "thin"]) {
            let (mean, variance) = shoot(&world, camera, paths);
            save(&folder.join(format!("{name}_{kind}.exr")), &mean)?;
            save(
                &folder.join(format!("{name}_{kind}_variance.exr")),
                &variance,
            )?;
            eprintln!("{name} {kind} done");
        }
    }
    Ok(())
}

/// The Cornell box with a white rough metal, whose reflectance needs no optical constants.
fn boxed() -> WorldDescription {
    let mut world = WorldDescription::cornell_box();
    world.materials[5] = Material::metal([1.0; 3], 0.4);
    for mesh in &mut world.meshes {
        mesh.normals = None;
    }
    world
}

/// Balls on a floor under a panorama, a sun and a point.
fn open(panorama: Arc<Image>) -> WorldDescription {
    let mut world = WorldDescription {
        materials: vec![
            Material::diffuse([0.5, 0.4, 0.3]),
            Material::metal([1.0; 3], 0.2),
            Material::metal([1.0; 3], 0.0),
            Material::glass(1.6),
        ],
        lights: vec![
            Light::Sun {
                direction: DVec3::new(-0.5, -1.0, -0.3),
                irradiance: [2.0, 1.8, 1.5],
                half_angle_deg: 0.0,
            },
            Light::Point {
                position_mm: DVec3::new(-100.0, 150.0, -650.0),
                intensity_m2: [0.01, 0.02, 0.03],
            },
        ],
        environment: Environment::Map {
            image: panorama,
            camera_from_map: DMat3::IDENTITY,
            scale: 1.0,
        },
        ..WorldDescription::default()
    };
    let corner = DVec3::new(-1500.0, -100.0, -2500.0);
    world.add(
        TriangleMesh::rectangle(corner, DVec3::X * 3000.0, DVec3::Z * 3000.0, 0),
        0,
    );
    for k in 0..4u16 {
        let mut ball = TriangleMesh::sphere(60.0, 40, usize::from(k));
        ball.normals = None;
        world.add(ball, k + 1);
        if let Some(instance) = world.instances.last_mut() {
            let x = -195.0 + 130.0 * f64::from(k);
            let centre = DVec3::new(x, -39.0, -700.0 - 60.0 * f64::from(k % 2));
            instance.camera_from_mesh = DAffine3::from_translation(centre);
        }
    }
    world
}

/// Smooth, so that the way of interpolating it does not matter.
fn panorama() -> Image {
    let (width, height) = (512, 256);
    let mut image = Image::zeros(width, height, 3);
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (
                (x as f64 + 0.5) / width as f64,
                (y as f64 + 0.5) / height as f64,
            );
            let lobe = (-((u - 0.7).powi(2) + (v - 0.3).powi(2)) / 0.01).exp();
            let sky = 0.3 + 0.2 * (std::f64::consts::PI * v).cos();
            let rgb = [sky + 3.0 * lobe, sky + 2.0 * lobe, 1.3 * sky + lobe];
            image
                .pixel_mut(x, y)
                .copy_from_slice(&rgb.map(|l| l as f32));
        }
    }
    image
}

/// Mean over independent paths, and its variance.
fn shoot(world: &World, camera: &Camera, paths: u64) -> (Image, Image) {
    let (mut mean, mut variance) = (
        Image::zeros(SIDE_PX, SIDE_PX, 3),
        Image::zeros(SIDE_PX, SIDE_PX, 3),
    );
    let pixels = mean.data_mut().par_chunks_mut(3);
    let pixels = pixels.zip(variance.data_mut().par_chunks_mut(3));
    pixels.enumerate().for_each(|(pixel, (mean, variance))| {
        let (mut sum, mut squares) = ([0.0f64; 3], [0.0f64; 3]);
        for path in 0..paths {
            let key = (pixel as u64) << 32 | path;
            let u = |d| uniform(9, &[key, d]);
            let place =
                |p: usize, d| ((p as f64 + u(d)) / SIDE_PX as f64 * 2.0 - 1.0) * camera.half_width;
            let (x, y) = (place(pixel % SIDE_PX, 0), -place(pixel / SIDE_PX, 1));
            let target = camera.focus_mm * DVec3::new(x, y, -1.0);
            let (a, b) = concentric_disk(u(2), u(3));
            let origin = camera.radius_mm * DVec3::new(a, b, 0.0);
            let key = PathKey {
                key,
                number: 0,
                spread: 0.0,
            };
            let direction = (target - origin).normalize();
            let l = world.radiance_along(origin, direction, &SETTINGS, &key);
            for c in 0..3 {
                sum[c] += f64::from(l[c]);
                squares[c] += f64::from(l[c]).powi(2);
            }
        }
        let n = paths as f64;
        for c in 0..3 {
            let m = sum[c] / n;
            mean[c] = m as f32;
            variance[c] = ((squares[c] / n - m * m) / (n - 1.0)).max(0.0) as f32;
        }
    });
    (mean, variance)
}

fn save(path: &Path, image: &Image) -> Result<(), Box<dyn std::error::Error>> {
    let layer = Layer {
        name: "",
        channels: &["R", "G", "B"],
        image,
        sample: Sample::Float,
    };
    Ok(write_layers(path, &[layer], Compression::Zips)?)
}

/// The meshes as binary PLY in the camera frame, one per material: `0.ply`, `1.ply`, …
fn write_plys(world: &WorldDescription, folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    for material in 0..world.materials.len() {
        let (mut vertices, mut faces) = (Vec::new(), Vec::new());
        for instance in &world.instances {
            let mesh = &world.meshes[instance.mesh];
            if mesh.materials != MaterialIndices::Mesh(material) {
                continue;
            }
            let first = vertices.len() as u32;
            vertices.extend(mesh.positions_mm.iter().map(|p| {
                let p = DVec3::from(p.map(f64::from));
                instance.camera_from_mesh.transform_point3(p).as_vec3()
            }));
            faces.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        let mut bytes = Vec::new();
        write!(
            bytes,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            vertices.len(),
            faces.len()
        )?;
        for p in &vertices {
            bytes.extend(p.to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
        for f in &faces {
            bytes.push(3);
            bytes.extend(f.iter().flat_map(|v| v.to_le_bytes()));
        }
        std::fs::write(folder.join(format!("{material}.ply")), bytes)?;
    }
    Ok(())
}
