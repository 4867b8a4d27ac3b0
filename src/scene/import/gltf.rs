//! glTF 2.0, as JSON (`.gltf`) or binary (`.glb`): nodes, meshes, cameras and punctual lights.
//!
//! Extensions: `KHR_lights_punctual`, `KHR_materials_transmission`, `_ior`, `_emissive_strength`, `_volume` (its thickness decides
//! whether a body is solid), `KHR_texture_transform`, `KHR_mesh_quantization`. A file that requires another one (such as a
//! compression) is refused. Animation, skins and morph targets stay in their rest pose.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::accessor::Buffers;
use super::container::{buffers, chunks};
use super::folder::Folder;
use super::gltf_material::Materials;
use super::json::{Document, Node};
use super::primitive::primitive_mesh;
use super::{FileCamera, Imported, MAX_INSTANCES, MAX_TRIANGLES, Warnings};
use crate::scene::world::{Instance, Light, WorldDescription};

/// Place in the file, and what is wrong there.
pub(super) type Broken = (String, String);

const KNOWN_EXTENSIONS: [&str; 7] = [
    "KHR_lights_punctual",
    "KHR_materials_transmission",
    "KHR_materials_ior",
    "KHR_materials_emissive_strength",
    "KHR_materials_volume",
    "KHR_texture_transform",
    "KHR_mesh_quantization",
];

/// Reads a document. A `.glb` is known by its magic number.
pub(super) fn read(bytes: &[u8], folder: &Folder, unit_mm: f64) -> Result<Imported, Broken> {
    let (json, binary) = if bytes.starts_with(b"glTF") {
        chunks(bytes).map_err(|what| ("GLB container".to_string(), what))?
    } else {
        (bytes, None)
    };
    let document: Document =
        serde_path_to_error::deserialize(&mut serde_json::Deserializer::from_slice(json))
            .map_err(|e| (e.path().to_string(), e.inner().to_string()))?;
    if !document.asset.version.starts_with("2.") {
        let what = format!("is {:?}; allowed: 2.x", document.asset.version);
        return Err(("asset.version".into(), what));
    }
    let known = |e: &&String| !KNOWN_EXTENSIONS.contains(&e.as_str());
    if let Some(other) = document.extensions_required.iter().find(known) {
        let what = format!(
            "{other} is not supported; allowed: {}",
            KNOWN_EXTENSIONS.join(", ")
        );
        return Err(("extensionsRequired".into(), what));
    }
    let buffers = Buffers {
        bytes: buffers(&document, binary, folder)?,
        document: &document,
    };
    let mut reader = Reader {
        materials: Materials::new(&buffers, folder),
        buffers: &buffers,
        imported: Imported {
            world: WorldDescription::default(),
            cameras: Vec::new(),
            warnings: Warnings::default(),
        },
        parts: vec![None; document.meshes.len()],
        triangles: 0,
        objects: 0,
    };
    reader.nodes(DAffine3::from_scale(DVec3::splat(unit_mm)))?;
    let mut imported = reader.imported;
    (imported.world.materials, imported.world.textures) = reader.materials.finished();
    Ok(imported)
}

struct Reader<'a> {
    buffers: &'a Buffers<'a>,
    materials: Materials<'a>,
    imported: Imported,
    /// Of each mesh of the file, the meshes of the world that its primitives became, once read.
    parts: Vec<Option<Vec<usize>>>,
    triangles: usize,
    objects: usize,
}

impl Reader<'_> {
    /// Walks the scene's nodes from their roots.
    fn nodes(&mut self, file_from_root: DAffine3) -> Result<(), Broken> {
        let document = self.buffers.document;
        let roots: Vec<usize> = match document.scenes.get(document.scene.unwrap_or(0)) {
            Some(scene) => scene.nodes.clone(),
            None if document.scenes.is_empty() => {
                let mut is_child = vec![false; document.nodes.len()];
                for &c in document.nodes.iter().flat_map(|n| &n.children) {
                    if let Some(flag) = is_child.get_mut(c) {
                        *flag = true;
                    }
                }
                (0..document.nodes.len())
                    .filter(|&i| !is_child[i])
                    .collect()
            }
            None => {
                let what = format!("is out of range; there are {}", document.scenes.len());
                return Err(("scene".into(), what));
            }
        };
        let mut seen = vec![false; document.nodes.len()];
        let mut stack: Vec<_> = roots
            .into_iter()
            .rev()
            .map(|r| (r, file_from_root))
            .collect();
        while let Some((index, file_from_parent)) = stack.pop() {
            let at = |what: &str| (format!("nodes[{index}]"), what.to_string());
            let node = document
                .nodes
                .get(index)
                .ok_or_else(|| at("does not exist"))?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(at("is reached twice; the nodes must be trees"));
            }
            let file_from_node = file_from_parent * transform(node);
            if !file_from_node.is_finite() {
                return Err(at("has a transform that is not finite"));
            }
            self.node(index, node, file_from_node)?;
            stack.extend(node.children.iter().rev().map(|&c| (c, file_from_node)));
        }
        Ok(())
    }

    fn node(&mut self, index: usize, node: &Node, place: DAffine3) -> Result<(), Broken> {
        let at = |what: String| (format!("nodes[{index}]"), what);
        let document = self.buffers.document;
        if let Some(mesh) = node.mesh {
            if place.matrix3.determinant() == 0.0 {
                let what = "meshes scaled to nothing: left out";
                self.imported.warnings.count(what, 1);
            } else {
                self.place(mesh, place).map_err(at)?;
            }
            let what = "skinned meshes: shown in their rest pose";
            self.imported
                .warnings
                .count(what, u64::from(node.skin.is_some()));
        }
        // Cameras and lights have a place and a direction; scale is none of theirs.
        let rigid =
            rotation(place.matrix3).map(|r| DAffine3::from_mat3_translation(r, place.translation));
        if let Some(camera) = node.camera {
            let camera = document
                .cameras
                .get(camera)
                .ok_or_else(|| at(format!("camera {camera} does not exist")))?;
            let Some(file_from_camera) = rigid else {
                self.imported
                    .warnings
                    .count("cameras without a direction: left out", 1);
                return Ok(());
            };
            self.imported.cameras.push(FileCamera {
                name: node.name.clone().unwrap_or_else(|| index.to_string()),
                file_from_camera,
                vertical_deg: camera.perspective.as_ref().map(|p| p.yfov.to_degrees()),
            });
        }
        if let Some(light) = &node.extensions.light {
            self.light(light.light, rigid).map_err(at)?;
        }
        Ok(())
    }

    /// One instance of each primitive; together they are one object.
    fn place(&mut self, mesh: usize, camera_from_mesh: DAffine3) -> Result<(), String> {
        if self.parts.get(mesh).is_none() {
            return Err(format!(
                "mesh {mesh} does not exist; there are {}",
                self.parts.len()
            ));
        }
        let parts = match &self.parts[mesh] {
            Some(parts) => parts.clone(),
            None => {
                let parts = self.mesh(mesh)?;
                self.parts[mesh] = Some(parts.clone());
                parts
            }
        };
        let world = &mut self.imported.world;
        if world.instances.len() + parts.len() > MAX_INSTANCES {
            return Err(format!("more than {MAX_INSTANCES} placed meshes"));
        }
        let last = usize::from(u16::MAX) - 1;
        let beyond = u64::from(self.objects > last);
        self.imported
            .warnings
            .count("objects that share number 65534", beyond);
        let object_id = self.objects.min(last) as u16;
        world
            .instances
            .extend(parts.into_iter().map(|mesh| Instance {
                mesh,
                camera_from_mesh,
                object_id,
            }));
        self.objects += 1;
        Ok(())
    }

    /// The primitives of a mesh as meshes of the world.
    fn mesh(&mut self, index: usize) -> Result<Vec<usize>, String> {
        let mesh = &self.buffers.document.meshes[index];
        let mut parts = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let at = |what: String| format!("meshes[{index}].primitives[{number}]: {what}");
            let warnings = &mut self.imported.warnings;
            let morphs = u64::from(!primitive.targets.is_empty());
            warnings.count("morph targets: shown in their rest pose", morphs);
            let colours = u64::from(primitive.attributes.colour.is_some());
            warnings.count("vertex colours: left out", colours);
            let Some(mut raw) = primitive_mesh(self.buffers, primitive).map_err(at)? else {
                warnings.count(
                    "primitives that are points, lines or without positions: left out",
                    1,
                );
                continue;
            };
            raw.clean(warnings);
            self.triangles += raw.triangles.len();
            if self.triangles > MAX_TRIANGLES {
                return Err(at(format!("more than {MAX_TRIANGLES} triangles")));
            }
            if raw.triangles.is_empty() {
                warnings.count("primitives without a usable triangle: left out", 1);
                continue;
            }
            let material = self
                .materials
                .get(primitive.material, warnings)
                .map_err(at)?;
            let name = mesh.name.clone().unwrap_or_else(|| format!("mesh {index}"));
            parts.push(self.imported.world.meshes.len());
            self.imported
                .world
                .meshes
                .push(raw.into_mesh(name, material));
        }
        Ok(parts)
    }

    fn light(&mut self, index: usize, place: Option<DAffine3>) -> Result<(), String> {
        let lights = &self.buffers.document.extensions.lights.lights;
        let light = lights
            .get(index)
            .ok_or_else(|| format!("light {index} does not exist; there are {}", lights.len()))?;
        let Some(place) = place else {
            self.imported
                .warnings
                .count("lights without a direction: left out", 1);
            return Ok(());
        };
        let strength = light.color.map(|c| (c * light.intensity).max(0.0) as f32);
        let (position_mm, direction) = (place.translation, -place.matrix3.z_axis);
        let light = match light.kind.as_str() {
            "directional" => Light::Sun {
                direction,
                irradiance: strength,
                half_angle_deg: 0.0,
            },
            "point" => Light::Point {
                position_mm,
                intensity_m2: strength,
            },
            "spot" => {
                let spot = light.spot.as_ref();
                let outer = spot
                    .and_then(|s| s.outer_cone_angle)
                    .unwrap_or(std::f64::consts::FRAC_PI_4);
                let outer_deg = outer.to_degrees().clamp(0.01, 90.0);
                let inner = spot.and_then(|s| s.inner_cone_angle).unwrap_or(0.0);
                Light::Spot {
                    position_mm,
                    direction,
                    intensity_m2: strength,
                    inner_deg: inner.to_degrees().clamp(0.0, 0.999 * outer_deg),
                    outer_deg,
                }
            }
            _ => {
                self.imported
                    .warnings
                    .count("lights of an unknown type: left out", 1);
                return Ok(());
            }
        };
        self.imported.world.lights.push(light);
        Ok(())
    }
}

/// A node's own transform: its matrix, or translation × rotation × scale.
fn transform(node: &Node) -> DAffine3 {
    if let Some(columns) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(columns));
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let q = DQuat::from_xyzw(x, y, z, w);
    let length = q.length();
    DAffine3::from_scale_rotation_translation(
        node.scale.unwrap_or([1.0; 3]).into(),
        if length > 0.0 {
            q / length
        } else {
            DQuat::IDENTITY
        },
        node.translation.unwrap_or_default().into(),
    )
}

/// The turn in a matrix, by its z and y axes; `None` where they have no direction.
fn rotation(m: DMat3) -> Option<DMat3> {
    let z = m.z_axis.try_normalize()?;
    let x = m.y_axis.cross(z).try_normalize()?;
    Some(DMat3::from_cols(x, z.cross(x), z))
}
