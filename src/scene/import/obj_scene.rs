//! OBJ with MTL as a world: one object per material.
//!
//! MTL is Phong's model; what it becomes here: `Kd` the base colour, a glossy coat (index 1.5) where `Ks` is not black,
//! GGX width α = √(2/(Ns + 2)) (Walter et al., EGSR 2007, section 5.2), so roughness √α; `Pr` and `Pm` (the PBR
//! extension) as they are; `illum` 3 or 5 without diffuse colour a metal of colour `Ks`; `illum` 4, 6, 7, 9 glass of
//! index `Ni`; `d` or `Tr` a veil, `map_d` a cut-out; `Ke` emission.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use super::folder::Folder;
use super::imported::Broken;
use super::obj::{Mtl, read_mtl, read_obj};
use super::picture::{Picture, decode};
use super::{Imported, MAX_FILE_BYTES, Warnings};
use crate::memory;
use crate::scene::world::{
    Alpha, Encoding, Instance, Material, TextureMap, TextureRef, WorldDescription, Wrap,
};

/// Most material libraries of a file.
const MAX_LIBRARIES: usize = 100;

/// Reads OBJ text (UTF-8; other bytes are replaced).
pub(super) fn read(bytes: &[u8], folder: &Folder, unit_mm: f64) -> Result<Imported, Broken> {
    let mut warnings = Warnings::default();
    // The shortest lines: "v 0 0 0" becomes three numbers of 8 bytes, "f 1 2 3" three corners and their indices.
    memory::check("an OBJ file", 6 * bytes.len() as u64)
        .map_err(|e| ("size".to_string(), e.to_string()))?;
    let text = String::from_utf8_lossy(bytes);
    let obj =
        read_obj(&text, &mut warnings).map_err(|(line, what)| (format!("line {line}"), what))?;
    let mut library: BTreeMap<String, Mtl> = BTreeMap::new();
    let mut read_bytes = 0;
    for (number, name) in obj.libraries.iter().enumerate() {
        if obj.libraries[..number].contains(name) {
            continue;
        }
        if number > MAX_LIBRARIES || read_bytes > MAX_FILE_BYTES {
            warnings.count(
                "material libraries beyond the first hundred, or 1 GiB: left out",
                1,
            );
            break;
        }
        match folder.read_name(name) {
            Ok(bytes) => {
                read_bytes += bytes.len() as u64;
                library.extend(read_mtl(&String::from_utf8_lossy(&bytes), &mut warnings));
            }
            Err(why) => warnings.count(format!("material library left out: {why}"), 1),
        }
    }
    let mut scene = Scene {
        folder,
        world: WorldDescription::default(),
        maps: BTreeMap::new(),
        warnings,
    };
    for (name, mut raw) in obj.parts {
        raw.clean(&mut scene.warnings);
        for uv in &mut raw.uvs {
            uv.y = 1.0 - uv.y; // OBJ's v runs up
        }
        if raw.triangles.is_empty() {
            continue;
        }
        let mtl = name.as_ref().and_then(|n| library.get(n)).cloned();
        if let (Some(name), None) = (&name, &mtl) {
            let what = format!("material {name:?} is not defined: grey instead");
            scene.warnings.count(what, 1);
        }
        let name = name.unwrap_or_default();
        let material = scene.material(&name, &mtl.unwrap_or_default());
        let world = &mut scene.world;
        world.materials.push(material);
        world.instances.push(Instance {
            mesh: world.meshes.len(),
            camera_from_mesh: DAffine3::from_scale(DVec3::splat(unit_mm)),
            object_id: world.meshes.len().min(usize::from(u16::MAX) - 1) as u16,
        });
        let number = world.materials.len() - 1;
        world.meshes.push(raw.into_mesh(name, number));
    }
    Ok(Imported {
        world: scene.world,
        cameras: Vec::new(),
        warnings: scene.warnings,
    })
}

struct Scene<'a> {
    folder: &'a Folder,
    world: WorldDescription,
    /// Texture number by the names of colour and mask; `None` inside: cannot be read.
    maps: BTreeMap<(Option<String>, Option<String>), Option<usize>>,
    warnings: Warnings,
}

impl Scene<'_> {
    fn material(&mut self, name: &str, mtl: &Mtl) -> Material {
        let colour = |c: [f64; 3]| c.map(|c| c.clamp(0.0, 1.0) as f32);
        // A library that names a picture and no colour means the picture as it is; neither is an even grey.
        let bare = if mtl.diffuse_map.is_some() { 1.0 } else { 0.5 };
        let diffuse = colour(mtl.diffuse.unwrap_or([bare; 3]));
        let specular = colour(mtl.specular.unwrap_or_default());
        let black = |c: [f32; 3]| c.iter().all(|&c| c < 0.02);
        let illumination = mtl.illumination.unwrap_or(2);
        let mirror = matches!(illumination, 3 | 5) && black(diffuse) && mtl.diffuse_map.is_none();
        let glass = matches!(illumination, 4 | 6 | 7 | 9);
        let alpha_ggx = (2.0 / (mtl.shininess.unwrap_or(10.0).max(0.0) + 2.0)).sqrt();
        let roughness = mtl.roughness.unwrap_or(alpha_ggx.sqrt()).clamp(0.0, 1.0) as f32;
        let metallic = mtl
            .metallic
            .map_or(f64::from(u8::from(mirror)), |m| m.clamp(0.0, 1.0));
        let glossy = !black(specular) || mtl.roughness.is_some() || glass;
        let ior = mtl.index_of_refraction.filter(|n| *n > 1.0).unwrap_or(1.5);
        let solidity = mtl.dissolve.unwrap_or(1.0).clamp(0.0, 1.0) as f32;
        let base_colour_texture = self.map(&mtl.diffuse_map, &mtl.dissolve_map);
        Material {
            name: name.to_string(),
            base_colour: match (mirror, glass) {
                (true, _) => specular,
                (_, true) if black(diffuse) => [1.0; 3],
                _ => diffuse,
            },
            metallic: metallic as f32,
            roughness: if glass { 0.0 } else { roughness },
            ior: if glossy { ior.min(4.0) as f32 } else { 1.0 },
            transmission: if glass { 1.0 } else { 0.0 },
            emission: mtl
                .emission
                .unwrap_or_default()
                .map(|e| e.clamp(0.0, 1e12) as f32),
            emission_texture: self.map(&mtl.emission_map, &None),
            alpha: if base_colour_texture.is_some() && mtl.dissolve_map.is_some() {
                Alpha::Mask {
                    alpha: 1.0,
                    cutoff: 0.5,
                }
            } else if solidity < 1.0 && !glass {
                Alpha::Blend { alpha: solidity }
            } else {
                Alpha::Opaque
            },
            base_colour_texture,
            two_sided: true,
            ..Material::default()
        }
    }

    /// A picture with an optional mask as its alpha; `None`, counted, where it cannot be read.
    fn map(&mut self, colour: &Option<String>, mask: &Option<String>) -> Option<TextureRef> {
        let key = (colour.clone(), mask.clone());
        if key == (None, None) {
            return None;
        }
        let number = match self.maps.get(&key) {
            Some(&number) => number,
            None => {
                let number = match self.load(colour.as_deref(), mask.as_deref()) {
                    Ok(map) => {
                        self.world.textures.push(map);
                        Some(self.world.textures.len() - 1)
                    }
                    Err(why) => {
                        self.warnings.count(format!("picture left out: {why}"), 1);
                        None
                    }
                };
                self.maps.insert(key, number);
                number
            }
        };
        number.map(TextureRef::new)
    }

    fn load(&self, colour: Option<&str>, mask: Option<&str>) -> Result<TextureMap, String> {
        let read = |name: &str| {
            let bytes = self.folder.read_name(name)?;
            decode(&bytes, name).map_err(|e| format!("{name:?}: {e}"))
        };
        let mask = mask.map(read).transpose()?;
        let mut picture = match (colour, &mask) {
            (Some(name), _) => read(name)?,
            (None, Some(mask)) => Picture {
                size: mask.size,
                texels: vec![[255; 4]; mask.texels.len()],
            },
            (None, None) => return Err("no name".into()),
        };
        if let Some(mask) = &mask {
            picture = picture.masked_by(mask);
        }
        TextureMap::from_rgba8(
            picture.size,
            picture.texels,
            Encoding::Srgb,
            [Wrap::Repeat; 2],
        )
        .map_err(|e| e.to_string())
    }
}
