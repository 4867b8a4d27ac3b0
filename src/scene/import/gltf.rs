//! glTF 2.0, as JSON (`.gltf`) or binary (`.glb`): nodes, meshes, cameras and punctual lights.
//!
//! Extensions: `KHR_lights_punctual`, `KHR_materials_transmission`, `_ior`, `_emissive_strength`, `_volume` (its
//! thickness decides whether a body is solid), `KHR_texture_transform`, `KHR_mesh_quantization`. A file that requires
//! another one (such as a compression) is refused. Skins stand as their joints do in the file, morph targets have their
//! default weights; animations are not played.

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};

use super::accessor::Buffers;
use super::container::{buffers, chunks};
use super::folder::Folder;
use super::gltf_light::light;
use super::gltf_material::Materials;
use super::imported::{Broken, FileCamera, Imported, MAX_INSTANCES, MAX_TRIANGLES, Warnings};
use super::json::{Document, Node};
use super::primitive::primitive_mesh;
use super::skin::Pose;
use crate::memory;
use crate::scene::world::{Instance, WorldDescription};

/// How often the memory budget is asked while meshes are read: many may share a few bytes of the file.
const ASK_EVERY_BYTES: u64 = 1 << 26;

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
    // Chunks are padded: by spaces in the specification, by zeros in some exporters' files.
    let padding = json
        .iter()
        .rev()
        .take_while(|b| matches!(b, 0 | b' '))
        .count();
    let mut text = serde_json::Deserializer::from_slice(&json[..json.len() - padding]);
    let document: Document = serde_path_to_error::deserialize(&mut text)
        .map_err(|e| (e.path().to_string(), e.inner().to_string()))?;
    text.end()
        .map_err(|e| ("after the document".to_string(), e.to_string()))?;
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
        numbers: std::cell::Cell::default(),
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
        file_from_node: vec![None; document.nodes.len()],
        triangles: 0,
        objects: 0,
        unasked: 0,
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
    /// Places of the nodes that the scene reaches.
    file_from_node: Vec<Option<DAffine3>>,
    triangles: usize,
    objects: usize,
    /// Of the meshes that were read since the memory budget was last asked, bytes.
    unasked: u64,
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
        let mut order = Vec::new();
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
            let file_from_node = file_from_parent * transform(node);
            if self.file_from_node[index].replace(file_from_node).is_some() {
                return Err(at("is reached twice; the nodes must be trees"));
            }
            if !file_from_node.is_finite() {
                return Err(at("has a transform that is not finite"));
            }
            order.push((index, node, file_from_node));
            stack.extend(node.children.iter().rev().map(|&c| (c, file_from_node)));
        }
        // Joints may stand anywhere in the scene, so all places are known first.
        order
            .into_iter()
            .try_for_each(|(index, node, place)| self.node(index, node, place))
    }

    fn node(&mut self, index: usize, node: &Node, place: DAffine3) -> Result<(), Broken> {
        let at = |what: String| (format!("nodes[{index}]"), what);
        let document = self.buffers.document;
        if let Some(mesh) = node.mesh {
            self.place(mesh, node, place).map_err(at)?;
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
    fn place(&mut self, mesh: usize, node: &Node, place: DAffine3) -> Result<(), String> {
        let document = self.buffers.document;
        if mesh >= self.parts.len() {
            let n = self.parts.len();
            return Err(format!("mesh {mesh} does not exist; there are {n}"));
        }
        let pose = match node.skin {
            Some(index) => {
                let skin = document.skins.get(index).ok_or_else(|| {
                    let n = document.skins.len();
                    format!("skin {index} does not exist; there are {n}")
                })?;
                let warnings = &mut self.imported.warnings;
                Pose::new(self.buffers, skin, &self.file_from_node, warnings)
                    .map_err(|what| format!("skins[{index}]: {what}"))?
            }
            None => None,
        };
        if pose.is_none() && place.matrix3.determinant() == 0.0 {
            let what = "meshes scaled to nothing: left out";
            self.imported.warnings.count(what, 1);
            return Ok(());
        }
        let shared = self.parts[mesh].clone();
        let (parts, camera_from_mesh) = match (pose, &node.weights, shared) {
            (Some(pose), ..) => {
                // Its vertices are in the file's frame already.
                let parts = self.mesh(mesh, node, Some((&pose, place)))?;
                (parts, DAffine3::IDENTITY)
            }
            (None, Some(_), _) => (self.mesh(mesh, node, None)?, place),
            (None, None, Some(parts)) => (parts, place),
            (None, None, None) => {
                let parts = self.mesh(mesh, node, None)?;
                self.parts[mesh] = Some(parts.clone());
                (parts, place)
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

    /// The primitives of a mesh as meshes of the world, as a node wears them: with its weights of morph targets, in a
    /// pose.
    fn mesh(
        &mut self,
        index: usize,
        node: &Node,
        pose: Option<(&Pose, DAffine3)>,
    ) -> Result<Vec<usize>, String> {
        let mesh = &self.buffers.document.meshes[index];
        let weights = node.weights.as_ref().unwrap_or(&mesh.weights);
        let mut parts = Vec::new();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let at = |what: String| format!("meshes[{index}].primitives[{number}]: {what}");
            let warnings = &mut self.imported.warnings;
            let raw = primitive_mesh(self.buffers, primitive, weights, warnings).map_err(at)?;
            let Some(mut raw) = raw else {
                warnings.count(
                    "primitives that are points, lines or without positions: left out",
                    1,
                );
                continue;
            };
            self.unasked += raw.bytes();
            if self.unasked > ASK_EVERY_BYTES {
                // Room for as much again; what was read before is not free any more.
                memory::check("meshes of a glTF file", self.unasked)
                    .map_err(|e| at(e.to_string()))?;
                self.unasked = 0;
            }
            raw.clean(warnings);
            if let Some((pose, place)) = pose {
                pose.apply(self.buffers, primitive, place, &mut raw, warnings)
                    .map_err(at)?;
                raw.clean(warnings);
            }
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
        let json = lights
            .get(index)
            .ok_or_else(|| format!("light {index} does not exist; there are {}", lights.len()))?;
        let warnings = &mut self.imported.warnings;
        let Some(place) = place else {
            warnings.count("lights without a direction: left out", 1);
            return Ok(());
        };
        match light(json, place) {
            Some(light) => self.imported.world.lights.push(light),
            None => warnings.count("lights of an unknown type: left out", 1),
        }
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
