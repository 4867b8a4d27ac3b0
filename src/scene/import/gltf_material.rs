//! glTF materials and their pictures, each read once.

use std::collections::BTreeMap;

use glam::{Affine2, Mat2, Vec2};

use super::Warnings;
use super::accessor::Buffers;
use super::folder::Folder;
use super::json::{Material as JsonMaterial, TextureInfo};
use super::picture::{Picture, decode};
use crate::scene::world::{Alpha, Encoding, Material, NormalMap, TextureMap, TextureRef, Wrap};

/// The materials and pictures used so far.
pub(super) struct Materials<'a> {
    buffers: &'a Buffers<'a>,
    folder: &'a Folder,
    made: Vec<Material>,
    /// By number in the file (`None`: the default one).
    numbers: BTreeMap<Option<usize>, usize>,
    textures: Vec<TextureMap>,
    /// By texture number and whether it is read as linear; `None` inside: cannot be read.
    known: BTreeMap<(usize, bool), Option<usize>>,
    /// Decoded pictures by image number.
    pictures: BTreeMap<usize, Picture>,
}

impl<'a> Materials<'a> {
    /// None yet.
    pub fn new(buffers: &'a Buffers<'a>, folder: &'a Folder) -> Self {
        Self {
            buffers,
            folder,
            made: Vec::new(),
            numbers: BTreeMap::new(),
            textures: Vec::new(),
            known: BTreeMap::new(),
            pictures: BTreeMap::new(),
        }
    }

    /// All materials and pictures.
    pub fn finished(self) -> (Vec<Material>, Vec<TextureMap>) {
        (self.made, self.textures)
    }

    /// Number in the world of a material of the file.
    pub fn get(&mut self, index: Option<usize>, warnings: &mut Warnings) -> Result<usize, String> {
        if let Some(&number) = self.numbers.get(&index) {
            return Ok(number);
        }
        let materials = &self.buffers.document.materials;
        let default = JsonMaterial::default();
        let json = match index {
            None => &default,
            Some(i) => materials.get(i).ok_or_else(|| {
                format!("material {i} does not exist; there are {}", materials.len())
            })?,
        };
        let material = self.material(json, warnings);
        self.made.push(material);
        self.numbers.insert(index, self.made.len() - 1);
        Ok(self.made.len() - 1)
    }

    fn material(&mut self, json: &JsonMaterial, warnings: &mut Warnings) -> Material {
        let pbr = &json.pbr_metallic_roughness;
        let [r, g, b, a] = pbr.base_color_factor.unwrap_or([1.0; 4]).map(unit);
        let alpha = match json.alpha_mode.as_deref() {
            Some("MASK") => Alpha::Mask {
                alpha: a,
                cutoff: unit(json.alpha_cutoff.unwrap_or(0.5)),
            },
            Some("BLEND") => Alpha::Blend { alpha: a },
            _ => Alpha::Opaque,
        };
        let extensions = &json.extensions;
        let transmission = extensions.transmission.as_ref();
        let strength = extensions
            .emissive_strength
            .as_ref()
            .and_then(|e| e.emissive_strength)
            .unwrap_or(1.0);
        let ior = extensions.ior.as_ref().and_then(|i| i.ior).unwrap_or(1.5);
        let solid = extensions
            .volume
            .as_ref()
            .is_some_and(|v| v.thickness_factor > 0.0);
        let mut texture = |info: &Option<TextureInfo>, linear| {
            info.as_ref()
                .and_then(|info| self.texture(info, linear, warnings))
        };
        Material {
            base_colour: [r, g, b],
            base_colour_texture: texture(&pbr.base_color_texture, false),
            metallic: unit(pbr.metallic_factor.unwrap_or(1.0)),
            roughness: unit(pbr.roughness_factor.unwrap_or(1.0)),
            metallic_roughness_texture: texture(&pbr.metallic_roughness_texture, true),
            // The extension's 0 stands for a plastic whose Fresnel term is 1 everywhere; 4 is our nearest.
            ior: if ior == 0.0 {
                4.0
            } else {
                ior.clamp(1.0, 4.0) as f32
            },
            transmission: unit(transmission.map_or(0.0, |t| t.transmission_factor)),
            thin_walled: !solid,
            emission: json
                .emissive_factor
                .map(|e| (e * strength).clamp(0.0, 1e12) as f32),
            emission_texture: texture(&json.emissive_texture, false),
            normal_map: json.normal_texture.as_ref().and_then(|info| {
                Some(NormalMap {
                    texture: self.texture(info, true, warnings)?,
                    scale: info.scale.unwrap_or(1.0).clamp(-100.0, 100.0) as f32,
                })
            }),
            alpha,
            two_sided: json.double_sided,
            name: json.name.clone().unwrap_or_default(),
        }
    }

    /// A picture as a factor; `None`, counted, where it cannot be had.
    fn texture(
        &mut self,
        info: &TextureInfo,
        linear: bool,
        warnings: &mut Warnings,
    ) -> Option<TextureRef> {
        let transform = info.extensions.transform.as_ref();
        let set = transform
            .and_then(|t| t.tex_coord)
            .unwrap_or(info.tex_coord);
        if set != 0 {
            warnings.count(
                "pictures placed by another set than TEXCOORD_0: left out",
                1,
            );
            return None;
        }
        let key = (info.index, linear);
        let number = match self.known.get(&key) {
            Some(&number) => number,
            None => {
                let number = match self.map(info.index, linear) {
                    Ok(map) => {
                        self.textures.push(map);
                        Some(self.textures.len() - 1)
                    }
                    Err(why) => {
                        warnings.count(format!("texture {} left out: {why}", info.index), 1);
                        None
                    }
                };
                self.known.insert(key, number);
                number
            }
        };
        let uv_from_mesh = transform.map_or(Affine2::IDENTITY, |t| {
            let [su, sv] = t.scale.unwrap_or([1.0; 2]).map(|s| s as f32);
            let (sin, cos) = (t.rotation as f32).sin_cos();
            // Counter-clockwise as seen, while v runs down.
            let turn = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos));
            let offset = Vec2::new(t.offset[0] as f32, t.offset[1] as f32);
            let matrix = turn * Mat2::from_diagonal(Vec2::new(su, sv));
            Affine2::from_mat2_translation(matrix, offset)
        });
        if !uv_from_mesh.is_finite() {
            warnings.count("texture transforms that are not finite: left out", 1);
            return number.map(TextureRef::new);
        }
        number.map(|texture| TextureRef {
            texture,
            uv_from_mesh,
        })
    }

    fn map(&mut self, index: usize, linear: bool) -> Result<TextureMap, String> {
        let document = self.buffers.document;
        let texture = document.textures.get(index).ok_or("does not exist")?;
        let source = texture.source.ok_or("has no PNG or JPEG picture")?;
        let sampler = texture.sampler.and_then(|s| document.samplers.get(s));
        let wrap = |code: Option<u32>| match code {
            Some(33071) => Wrap::Clamp,
            Some(33648) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let wraps = [
            wrap(sampler.and_then(|s| s.wrap_s)),
            wrap(sampler.and_then(|s| s.wrap_t)),
        ];
        let encoding = if linear {
            Encoding::Linear
        } else {
            Encoding::Srgb
        };
        let picture = self.picture(source)?;
        TextureMap::from_rgba8(picture.size, picture.texels.clone(), encoding, wraps)
            .map_err(|e| e.to_string())
    }

    fn picture(&mut self, index: usize) -> Result<&Picture, String> {
        if !self.pictures.contains_key(&index) {
            let picture = self.read(index)?;
            self.pictures.insert(index, picture);
        }
        Ok(&self.pictures[&index])
    }

    fn read(&self, index: usize) -> Result<Picture, String> {
        let images = &self.buffers.document.images;
        let image = images
            .get(index)
            .ok_or_else(|| format!("image {index} does not exist; there are {}", images.len()))?;
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let name = if uri.starts_with("data:") { "" } else { uri };
                decode(&self.folder.read(uri)?, name)
            }
            (None, Some(view)) => decode(self.buffers.view(view)?.0, ""),
            (None, None) => Err(format!("image {index} has neither uri nor bufferView")),
        }
    }
}

fn unit(x: f64) -> f32 {
    x.clamp(0.0, 1.0) as f32
}
