//! What a material is asked about at every surface, looked up once.

use super::description::{Alpha, Material};

/// See the module.
#[derive(Clone, Copy, Debug)]
pub(super) struct Traits {
    /// It is diffuse and nothing else, so that its parts need not be weighed.
    pub is_matt: bool,
    /// It asks for texture coordinates.
    pub is_textured: bool,
    /// It may have holes.
    pub is_cut_out: bool,
    /// Shadow rays may pass.
    pub lets_through: bool,
    /// It sends light of its own.
    pub shines: bool,
}

impl Traits {
    pub fn new(material: &Material) -> Self {
        let m = material;
        Self {
            is_matt: m.alpha == Alpha::Opaque
                && m.metallic == 0.0
                && m.ior == 1.0
                && m.transmission == 0.0
                && m.normal_map.is_none(),
            is_textured: m.base_colour_texture.is_some()
                || m.metallic_roughness_texture.is_some()
                || m.emission_texture.is_some()
                || m.normal_map.is_some(),
            is_cut_out: matches!(m.alpha, Alpha::Mask { .. }),
            lets_through: matches!(m.alpha, Alpha::Blend { .. })
                || (m.thin_walled && m.transmission > 0.0),
            shines: m.emission != [0.0; 3],
        }
    }
}
