//! The triangles of a world, merged into as few trees as its instances allow.
//!
//! A mesh that is used once, or is small, is baked into one common tree in the camera frame: a ray then walks one tree.
//! A large mesh with several instances has a tree of its own, and rays are taken into its frame.

use glam::{Affine3A, DAffine3, DVec3, Vec3};

use super::builder::Builder;
use super::bvh::{Bounds, Bvh};
use super::check::{WorldWarnings, is_solid};
use super::description::{Instance, WorldDescription};
use super::repeated::drop_repeated;
use super::triangles::Packet;

/// A triangle of a placed geometry, by its lane in a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::scene) struct Element {
    pub placed: u32,
    pub packet: u32,
    pub lane: u8,
}

/// Triangles that all instances of a mesh together may add to the common tree.
const BAKED_TRIANGLES: usize = 100_000;

/// A triangle: its vertices and its part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub vertices: [u32; 3],
    pub part: u32,
}

/// What triangles share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub material: u32,
    /// Of the truth; an instance's own counts if the geometry is not baked.
    pub object_id: u16,
}

/// Triangles in one frame and their tree.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub positions: Vec<Vec3>,
    /// One a vertex, of any length, zero where the triangle is flat; or none at all.
    pub normals: Vec<Vec3>,
    /// One a vertex, or none at all.
    pub uvs: Vec<[f32; 2]>,
    /// One a vertex, or none at all.
    pub colours: Vec<[f32; 4]>,
    pub triangles: Vec<Triangle>,
    pub parts: Vec<Part>,
    pub bvh: Bvh,
    /// One a leaf of the tree.
    pub packets: Vec<Packet>,
}

/// A geometry in the world.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub geometry: usize,
    pub camera_from_mesh: DAffine3,
    pub mesh_from_camera: Affine3A,
    /// Whether the transform mirrors, and so turns fronts into backs.
    pub mirrored: bool,
    /// The instance's object; `None` if each part has its own (the baked geometry, whose transform is the identity).
    pub object_id: Option<u16>,
}

/// Geometries, where they stand, and the tree over them.
#[derive(Clone, Debug)]
pub(super) struct Stage {
    pub geometries: Vec<Geometry>,
    pub placed: Vec<Placed>,
    /// Over `placed`, by way of `slots`.
    pub bvh: Bvh,
    /// `placed` indices of each leaf, up to four.
    pub slots: Vec<[u32; 4]>,
    /// Of everything, camera frame.
    pub bounds: Bounds,
}

impl Geometry {
    fn bounds(&self) -> Bounds {
        let used = self.triangles.iter().flat_map(|t| t.vertices);
        Bounds::from_points(used.map(|v| self.positions[v as usize]))
    }
}

impl Stage {
    /// Bakes and places the meshes of a checked description.
    pub fn new(world: &WorldDescription, warnings: &mut WorldWarnings) -> Self {
        let solid = |i: &&Instance| is_solid(&i.camera_from_mesh);
        let instances: Vec<&Instance> = world.instances.iter().filter(solid).collect();
        warnings.flat_instances = world.instances.len() - instances.len();
        let mut uses = vec![0usize; world.meshes.len()];
        instances.iter().for_each(|i| uses[i.mesh] += 1);
        let is_baked = |mesh: usize| {
            uses[mesh] == 1
                || uses[mesh].saturating_mul(world.meshes[mesh].triangles.len()) <= BAKED_TRIANGLES
        };

        let mut common = Builder::default();
        let mut geometries = Vec::new();
        let mut placed = Vec::new();
        let mut own = vec![None; world.meshes.len()];
        for instance in &instances {
            let mesh = &world.meshes[instance.mesh];
            if is_baked(instance.mesh) {
                common.add(
                    mesh,
                    &instance.camera_from_mesh,
                    instance.object_id,
                    warnings,
                );
                continue;
            }
            let geometry = *own[instance.mesh].get_or_insert_with(|| {
                let mut builder = Builder::default();
                builder.add(mesh, &DAffine3::IDENTITY, instance.object_id, warnings);
                geometries.push(builder.finish(warnings));
                geometries.len() - 1
            });
            if !geometries[geometry].triangles.is_empty() {
                placed.push(place(geometry, instance));
            }
        }
        if !common.is_empty() {
            geometries.push(common.finish(warnings));
            placed.push(Placed {
                geometry: geometries.len() - 1,
                camera_from_mesh: DAffine3::IDENTITY,
                mesh_from_camera: Affine3A::IDENTITY,
                mirrored: false,
                object_id: None,
            });
        }
        warnings.repeated += drop_repeated(&mut placed, |p| {
            let place = p
                .camera_from_mesh
                .to_cols_array()
                .map(|x| (x + 0.0).to_bits());
            (p.geometry, place)
        });
        let own: Vec<Bounds> = geometries.iter().map(Geometry::bounds).collect();
        let boxes: Vec<Bounds> = placed
            .iter()
            .map(|p| moved_bounds(&own[p.geometry], &p.camera_from_mesh))
            .collect();
        let mut slots = Vec::new();
        let bvh = Bvh::build(&boxes, |items| {
            slots.push(std::array::from_fn(|i| items[i.min(items.len() - 1)]));
        });
        Self {
            geometries,
            placed,
            bvh,
            slots,
            bounds: boxes.into_iter().fold(Bounds::EMPTY, Bounds::union),
        }
    }
}

fn place(geometry: usize, instance: &Instance) -> Placed {
    let camera_from_mesh = instance.camera_from_mesh;
    let inverse = camera_from_mesh.inverse();
    Placed {
        geometry,
        camera_from_mesh,
        mesh_from_camera: Affine3A::from_mat3_translation(
            inverse.matrix3.as_mat3(),
            inverse.translation.as_vec3(),
        ),
        mirrored: camera_from_mesh.matrix3.determinant() < 0.0,
        object_id: Some(instance.object_id),
    }
}

/// Box of a box's moved corners, rounded outwards; an empty box stays empty.
fn moved_bounds(bounds: &Bounds, transform: &DAffine3) -> Bounds {
    if bounds.least.x > bounds.greatest.x {
        return *bounds;
    }
    let corner = |k: usize| {
        let pick = |axis: usize| {
            f64::from(if k >> axis & 1 == 0 {
                bounds.least[axis]
            } else {
                bounds.greatest[axis]
            })
        };
        transform.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let corners = (0..8).map(corner);
    let (least, greatest) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| {
        (a.min(p), b.max(p))
    });
    let round =
        |p: DVec3, f: fn(f32) -> f32| Vec3::new(f(p.x as f32), f(p.y as f32), f(p.z as f32));
    Bounds {
        least: round(least, f32::next_down),
        greatest: round(greatest, f32::next_up),
    }
}
