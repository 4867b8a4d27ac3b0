//! What a description must hold, what is refused and what is only counted.

use glam::{DAffine3, DVec3};

use super::description::{
    Alpha, Environment, Instance, Light, Material, MaterialIndices, TextureRef, TriangleMesh,
    WorldDescription,
};

use crate::range::{self, OutOfRange};

/// What was left out or mended, counted. All zero for a clean description.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct WorldWarnings {
    /// Triangles without an area, left out.
    pub degenerate_triangles: usize,
    /// Triangles with a vertex that is not finite, left out.
    pub non_finite_triangles: usize,
    /// Vertex normals that are zero or not finite: the flat normal serves instead.
    pub bad_normals: usize,
    /// Texture coordinates that are not finite: 0 serves instead.
    pub bad_uvs: usize,
    /// Vertex colours that are not within 0 and 1: the nearest that is, 1 for what is no number.
    pub bad_colours: usize,
    /// Instances that are squeezed flat, left out.
    pub flat_instances: usize,
    /// Triangles and instances, of more than a thousand, that lie where an equal one does, left out.
    pub repeated: usize,
}

impl WorldWarnings {
    /// A line for each kind that occurred, for a log.
    pub fn lines(&self) -> Vec<String> {
        let kinds = [
            (
                self.degenerate_triangles,
                "triangles without an area left out",
            ),
            (
                self.non_finite_triangles,
                "triangles with a vertex that is not finite left out",
            ),
            (
                self.bad_normals,
                "zero or non-finite vertex normals: flat there",
            ),
            (self.bad_uvs, "non-finite texture coordinates set to 0"),
            (self.bad_colours, "vertex colours brought into 0 to 1"),
            (
                self.flat_instances,
                "instances squeezed flat by their transform left out",
            ),
            (
                self.repeated,
                "triangles or instances where an equal one lies left out",
            ),
        ];
        let occurred = kinds.into_iter().filter(|(count, _)| *count > 0);
        occurred
            .map(|(count, what)| format!("{count} {what}"))
            .collect()
    }
}

/// Most triangles of all meshes together, so that 32-bit indices reach them.
const MAX_TRIANGLES: usize = 1 << 30;

/// An entry of the description, such as `world: mesh 2 ("leaf")`.
struct Entry(String);

impl Entry {
    fn new(name: impl std::fmt::Display) -> Self {
        Self(format!("world: {name}"))
    }

    fn refuse(
        &self,
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: impl std::fmt::Display,
    ) -> OutOfRange {
        OutOfRange::new(self.0.clone(), field, value, allowed.to_string())
    }

    fn within(
        &self,
        field: &'static str,
        value: f64,
        [from, to]: [f64; 2],
    ) -> Result<(), OutOfRange> {
        range::within(self.0.clone(), field, value, from..=to)
    }

    fn strength(&self, field: &'static str, rgb: [f32; 3]) -> Result<(), OutOfRange> {
        if rgb.iter().all(|x| x.is_finite() && *x >= 0.0) {
            Ok(())
        } else {
            Err(self.refuse(field, format_args!("{rgb:?}"), "finite, not negative"))
        }
    }

    fn index(&self, field: &'static str, index: usize, len: usize) -> Result<(), OutOfRange> {
        if index < len {
            Ok(())
        } else {
            Err(self.refuse(field, index, format_args!("below {len}")))
        }
    }

    fn direction(&self, field: &'static str, d: DVec3) -> Result<(), OutOfRange> {
        if d.is_finite() && d.length() > 0.0 {
            Ok(())
        } else {
            Err(self.refuse(field, d, "finite, not zero"))
        }
    }

    fn position(&self, field: &'static str, p: DVec3) -> Result<(), OutOfRange> {
        if p.is_finite() {
            Ok(())
        } else {
            Err(self.refuse(field, p, "finite"))
        }
    }
}

/// Refuses what cannot be a world. Geometry that is only bad in places is counted where it is built.
pub(super) fn check(world: &WorldDescription) -> Result<(), OutOfRange> {
    for (i, mesh) in world.meshes.iter().enumerate() {
        check_mesh(
            &Entry::new(format_args!("mesh {i} ({:?})", mesh.name)),
            mesh,
            world.materials.len(),
        )?;
    }
    let triangles: usize = world.meshes.iter().map(|m| m.triangles.len()).sum();
    if triangles > MAX_TRIANGLES {
        return Err(Entry::new("meshes").refuse(
            "number of triangles",
            triangles,
            format_args!("at most {MAX_TRIANGLES}"),
        ));
    }
    for (i, instance) in world.instances.iter().enumerate() {
        let Instance {
            mesh,
            camera_from_mesh,
            object_id,
        } = instance;
        let entry = Entry::new(format_args!("instance {i}"));
        entry.index("mesh", *mesh, world.meshes.len())?;
        if !camera_from_mesh.is_finite() {
            return Err(entry.refuse("camera_from_mesh", camera_from_mesh, "finite numbers"));
        }
        entry.index("object_id", usize::from(*object_id), usize::from(u16::MAX))?;
    }
    for (i, material) in world.materials.iter().enumerate() {
        let entry = Entry::new(format_args!("material {i} ({:?})", material.name));
        check_material(&entry, material, world.textures.len())?;
    }
    for (i, light) in world.lights.iter().enumerate() {
        check_light(&Entry::new(format_args!("light {i}")), light)?;
    }
    check_environment(&Entry::new("environment"), &world.environment)
}

fn check_mesh(entry: &Entry, mesh: &TriangleMesh, materials: usize) -> Result<(), OutOfRange> {
    let vertices = mesh.positions_mm.len();
    let as_many = |field, len: Option<usize>| match len {
        Some(len) if len != vertices => Err(entry.refuse(
            field,
            format_args!("{len} entries"),
            format_args!("{vertices}, one per vertex"),
        )),
        _ => Ok(()),
    };
    as_many("normals", mesh.normals.as_ref().map(Vec::len))?;
    as_many("uvs", mesh.uvs.as_ref().map(Vec::len))?;
    as_many("colours", mesh.colours.as_ref().map(Vec::len))?;
    for corner in mesh.triangles.iter().flatten() {
        entry.index("vertex index of a triangle", *corner as usize, vertices)?;
    }
    match &mesh.materials {
        MaterialIndices::Mesh(index) => entry.index("material", *index, materials),
        MaterialIndices::Triangles(list) => {
            if list.len() != mesh.triangles.len() {
                return Err(entry.refuse(
                    "materials",
                    format_args!("{} entries", list.len()),
                    format_args!("{}, one per triangle", mesh.triangles.len()),
                ));
            }
            list.iter().try_for_each(|index| {
                entry.index("material of a triangle", *index as usize, materials)
            })
        }
    }
}

fn check_material(entry: &Entry, m: &Material, textures: usize) -> Result<(), OutOfRange> {
    let unit = [0.0, 1.0];
    for x in m.base_colour {
        entry.within("base_colour", f64::from(x), unit)?;
    }
    entry.within("metallic", f64::from(m.metallic), unit)?;
    entry.within("roughness", f64::from(m.roughness), unit)?;
    entry.within("ior", f64::from(m.ior), [1.0, 4.0])?;
    entry.within("transmission", f64::from(m.transmission), unit)?;
    entry.strength("emission", m.emission)?;
    match m.alpha {
        Alpha::Opaque => {}
        Alpha::Mask { alpha, cutoff } => {
            entry.within("alpha", f64::from(alpha), unit)?;
            entry.within(
                "alpha cutoff",
                f64::from(cutoff),
                [0.0, f64::from(f32::MAX)],
            )?;
        }
        Alpha::Blend { alpha } => entry.within("alpha", f64::from(alpha), unit)?,
    }
    let texture = |field, reference: Option<TextureRef>| match reference {
        Some(TextureRef {
            texture,
            uv_from_mesh,
        }) => {
            entry.index(field, texture, textures)?;
            if uv_from_mesh.is_finite() {
                Ok(())
            } else {
                Err(entry.refuse("uv_from_mesh", uv_from_mesh, "finite numbers"))
            }
        }
        None => Ok(()),
    };
    texture("base_colour_texture", m.base_colour_texture)?;
    texture("metallic_roughness_texture", m.metallic_roughness_texture)?;
    texture("emission_texture", m.emission_texture)?;
    texture("normal_map", m.normal_map.map(|n| n.texture))?;
    match m.normal_map {
        Some(map) if !map.scale.is_finite() => {
            Err(entry.refuse("normal_map scale", map.scale, "finite"))
        }
        _ => Ok(()),
    }
}

fn check_light(entry: &Entry, light: &Light) -> Result<(), OutOfRange> {
    match *light {
        Light::Sun {
            direction,
            irradiance,
            half_angle_deg,
        } => {
            entry.direction("direction", direction)?;
            entry.strength("irradiance", irradiance)?;
            entry.within("half_angle_deg", half_angle_deg, [0.0, 45.0])
        }
        Light::Point {
            position_mm,
            intensity_m2,
        } => {
            entry.position("position_mm", position_mm)?;
            entry.strength("intensity_m2", intensity_m2)
        }
        Light::Spot {
            position_mm,
            direction,
            intensity_m2,
            inner_deg,
            outer_deg,
        } => {
            entry.position("position_mm", position_mm)?;
            entry.direction("direction", direction)?;
            entry.strength("intensity_m2", intensity_m2)?;
            entry.within("outer_deg", outer_deg, [1e-3, 90.0])?;
            entry.within("inner_deg", inner_deg, [0.0, outer_deg - 1e-4])
        }
    }
}

fn check_environment(entry: &Entry, environment: &Environment) -> Result<(), OutOfRange> {
    match environment {
        Environment::Even(radiance) => entry.strength("radiance", *radiance),
        Environment::Map {
            image,
            camera_from_map,
            scale,
        } => {
            if image.channels() != 3 || image.width() == 0 || image.height() == 0 {
                let shape = format!(
                    "{} × {} × {}",
                    image.width(),
                    image.height(),
                    image.channels()
                );
                return Err(entry.refuse("image", shape, "W × H × 3"));
            }
            if let Some(bad) = image.data().iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
                return Err(entry.refuse("radiance", bad, "finite, not negative"));
            }
            let gram = camera_from_map.transpose() * *camera_from_map;
            let off = (gram - glam::DMat3::IDENTITY).to_cols_array().map(f64::abs);
            // NaN fails too.
            if !off.iter().all(|x| *x < 1e-6) || camera_from_map.determinant() < 0.0 {
                return Err(entry.refuse("camera_from_map", camera_from_map, "a rotation"));
            }
            entry.within("scale", f64::from(*scale), [0.0, f64::from(f32::MAX)])
        }
    }
}

/// Whether a transform leaves volumes: its columns are far enough from one plane to be undone in f64.
pub(super) fn is_solid(transform: &DAffine3) -> bool {
    let m = transform.matrix3;
    let sides = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    m.determinant().abs() > 1e-9 * sides
}
