//! A second path tracer, as plain as can be: every triangle is tested, in f64, and light is found by scattering alone.
//! It knows diffuse surfaces, mirrors and lamps, and shares no code with the first.

use glam::DVec3;
use quadpixel::sampling::uniform;
use quadpixel::scene::world::{Material, TriangleMesh, World, WorldDescription};

use super::{add_at, bounces, mean};

struct Plain {
    triangles: Vec<([DVec3; 3], usize)>,
    materials: Vec<Material>,
}

impl Plain {
    fn new(world: &WorldDescription) -> Self {
        let triangles = world.instances.iter().flat_map(|i| {
            let mesh = &world.meshes[i.mesh];
            let quadpixel::scene::world::MaterialIndices::Mesh(material) = mesh.materials else {
                panic!("one material a mesh here");
            };
            mesh.triangles.iter().map(move |t| {
                let corner = |v: u32| {
                    let p = mesh.positions_mm[v as usize].map(f64::from);
                    i.camera_from_mesh.transform_point3(DVec3::from(p))
                };
                // A mirror image's front is the front's mirror image.
                let mut corners = t.map(corner);
                if i.camera_from_mesh.matrix3.determinant() < 0.0 {
                    corners.swap(1, 2);
                }
                (corners, material)
            })
        });
        Self {
            triangles: triangles.collect(),
            materials: world.materials.clone(),
        }
    }

    fn nearest(&self, o: DVec3, d: DVec3) -> Option<(f64, DVec3, usize)> {
        let mut nearest = None::<(f64, DVec3, usize)>;
        for ([a, b, c], material) in &self.triangles {
            let n = (*b - *a).cross(*c - *a);
            let t = n.dot(*a - o) / n.dot(d);
            if !(t > 1e-6 && nearest.is_none_or(|x| t < x.0)) {
                continue;
            }
            let p = o + t * d;
            let inside = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|(x, y)| n.dot((**y - **x).cross(p - **x)) >= 0.0);
            if inside {
                nearest = Some((t, n.normalize(), *material));
            }
        }
        nearest
    }

    fn radiance(&self, mut o: DVec3, mut d: DVec3, bounces: u32, key: u64) -> [f64; 3] {
        let (mut weight, mut sum) = (DVec3::ONE, DVec3::ZERO);
        for bounce in 0..=bounces {
            let Some((t, front, material)) = self.nearest(o, d) else {
                break;
            };
            let m = &self.materials[material];
            if m.two_sided || front.dot(d) < 0.0 {
                sum += weight * DVec3::from(m.emission.map(f64::from));
            }
            let n = if front.dot(d) < 0.0 { front } else { -front };
            o += t * d + 1e-7 * n;
            d = if m.metallic == 1.0 {
                d - 2.0 * d.dot(n) * n
            } else {
                // A point of the unit sphere about the tip of the normal: the cosine law.
                let u = |k| uniform(0xB1A5, &[key, u64::from(bounce), k]);
                let z = 2.0 * u(0) - 1.0;
                let (sin, cos) = (std::f64::consts::TAU * u(1)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                (n + DVec3::new(r * cos, r * sin, z)).normalize()
            };
            weight *= DVec3::from(m.base_colour.map(f64::from));
        }
        sum.to_array()
    }
}

#[test]
fn a_plain_path_tracer_without_connections_agrees_within_its_variance() {
    // A box with an open front, a large lamp, a white mirror and a block: few triangles, so that the plain one is
    // quick.
    let mut world = WorldDescription::cornell_box();
    world.materials[4] = Material::metal([1.0; 3], 0.0);
    // Keep walls, lamp and block; two coarse flat-shaded balls instead of the fine ones.
    world.instances.retain(|i| ![2, 3].contains(&i.object_id));
    let mut mirror = TriangleMesh::sphere(60.0, 4, 4);
    mirror.normals = None;
    add_at(&mut world, mirror, DVec3::new(80.0, -130.0, -720.0), 2);
    let lamp = TriangleMesh::rectangle(
        DVec3::new(-150.0, 195.0, -650.0),
        DVec3::X * 300.0,
        DVec3::Z * -300.0,
        3,
    );
    world.add(lamp, 1);
    agrees(world);
}

/// Both tracers along 36 rays into a world: equal within what their paths vary.
pub fn agrees(world: WorldDescription) {
    let plain = Plain::new(&world);
    let world = World::new(world).unwrap();
    let settings = bounces(4);
    let mut squared = 0.0;
    let mut worst: f64 = 0.0;
    let (mut z_sum, mut count) = (0.0, 0.0);
    for k in 0..36 {
        let (x, y) = ((k % 6) as f64 / 5.0 - 0.5, (k / 6) as f64 / 5.0 - 0.5);
        // Beside the symmetry: a ray along the line where two walls meet could hit either.
        let d = DVec3::new(0.53 * x + 0.004, 0.51 * y - 0.003, -1.0).normalize();
        let ours = mean(&world, (DVec3::ZERO, d), &settings, 500);
        let n = 2000;
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for path in 0..n {
            let l = plain.radiance(DVec3::ZERO, d, 4, k * 100_000 + path);
            for c in 0..3 {
                sum[c] += l[c];
                squares[c] += l[c] * l[c];
            }
        }
        for c in 0..3 {
            let n = n as f64;
            let m = sum[c] / n;
            let variance = (squares[c] / n - m * m) / n + ours[c].1 * ours[c].1;
            if variance > 0.0 {
                let z = (ours[c].0 - m) / variance.sqrt();
                worst = worst.max(z.abs());
                squared += z * z;
                z_sum += z;
                count += 1.0;
            } else {
                assert!((ours[c].0 - m).abs() < 1e-5 * m.max(1.0));
            }
        }
    }
    // z of about 100 values: mean 0 ± 0.17 (channels of a ray are correlated), mean square 1 ± 0.25, the largest
    // below 5.
    let (bias, spread) = (z_sum / count, squared / count);
    assert!(count > 60.0, "{count} noisy values");
    assert!(bias.abs() < 0.55, "mean z {bias}");
    assert!((0.5..1.7).contains(&spread), "mean z² {spread}");
    assert!(worst < 5.0, "largest z {worst}");
}
