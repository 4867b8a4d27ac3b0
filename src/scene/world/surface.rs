//! The place where a ray meets a triangle, computed in f64, and the material there.

use glam::{DVec3, Vec2, Vec3A as Vec3, Vec4};

use super::World;
use super::description::{Alpha, Material, TextureRef};
use super::facet::Facet;
use super::geometry::Element;
use crate::rays::Ray;

/// A place on a triangle, camera frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub position: DVec3,
    /// From the ray's origin, mm.
    pub distance: f64,
    /// Unit normal of the front.
    pub normal: Vec3,
    /// Unit normal for shading, on the front's side; before any normal map.
    pub shading: Vec3,
    pub uv: [f32; 2],
    /// Texture coordinates a mm, in the mean over directions.
    pub uv_per_mm: f32,
    /// Directions in which u and v grow; zero where there are no coordinates.
    pub along_uv: [Vec3; 2],
    /// Factor of the material's base colour and alpha.
    pub colour: [f32; 4],
    pub material: usize,
    pub object_id: u16,
}

/// What a texture lookup averages over, in texture coordinates: about a square, or a row of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    /// Side of a square.
    width: f32,
    /// From one end of the row to the other.
    row: [f32; 2],
    /// Squares in the row.
    probes: u32,
}

/// Squares in a row, at most: a surface seen at less than arcsin 1/8 = 7° is blurred along the view.
const MAX_PROBES: f32 = 8.0;

impl Footprint {
    /// A point.
    pub const POINT: Self = Self {
        width: 0.0,
        row: [0.0; 2],
        probes: 1,
    };
}

impl Surface {
    /// The place, moved to the side of a direction so far that rounding to f32 leaves it on that side.
    #[inline(always)]
    pub fn beside(&self, direction: Vec3) -> DVec3 {
        beside(self.position, self.normal, direction)
    }

    /// What a cone of the width `width_mm` covers that comes along `direction`: an ellipse, longer by 1/cos along the
    /// view. A sharp one is a row of squares (P. Heckbert's ellipse, by the probes of J. McCormack et al., *Feline*,
    /// SIGGRAPH 1999); others are the square of the long side.
    #[inline(always)]
    pub fn footprint(&self, width_mm: f32, direction: Vec3, is_sharp: bool) -> Footprint {
        if self.uv_per_mm == 0.0 {
            return Footprint::POINT;
        }
        let along_normal = self.normal.dot(direction);
        let ratio = 1.0 / along_normal.abs().max(0.05);
        let square = Footprint {
            width: width_mm * ratio * self.uv_per_mm,
            ..Footprint::POINT
        };
        let probes = (ratio.min(MAX_PROBES) + 0.5) as u32;
        if !is_sharp || probes < 2 {
            return square;
        }
        let along =
            (direction - self.normal * along_normal).normalize_or_zero() * (width_mm * ratio);
        let [u, v] = self.along_uv;
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let det = uu * vv - uv * uv;
        let (au, av) = (u.dot(along), v.dot(along));
        let row = [(vv * au - uv * av) / det, (uu * av - uv * au) / det];
        if !row.iter().all(|x| x.is_finite()) {
            return square;
        }
        Footprint {
            width: square.width / probes as f32,
            row,
            probes,
        }
    }
}

/// A place on a surface of this normal, moved to the side of a direction ([`Surface::beside`]).
#[inline(always)]
pub(super) fn beside(position: DVec3, normal: Vec3, direction: Vec3) -> DVec3 {
    let step = position.abs().max_element() * (8.0 * f64::from(f32::EPSILON));
    let side = if normal.dot(direction) < 0.0 {
        -1.0
    } else {
        1.0
    };
    position + normal.as_dvec3() * (side * step)
}

impl World {
    /// Where a ray meets a triangle that it is known to meet: rounding is taken back to the triangle's border.
    #[inline(always)]
    pub(super) fn surface(&self, element: Element, ray: &Ray) -> Surface {
        let facet = self.stage.facet(element);
        let mut surface = self.surface_at(element, &facet, facet.barycentric(ray));
        surface.distance = (surface.position - ray.origin_mm).dot(ray.direction);
        surface
    }

    /// A place of a triangle, by the weights of its second and third corner.
    #[inline(always)]
    pub(super) fn surface_at(
        &self,
        element: Element,
        facet: &Facet,
        [b1, b2]: [f64; 2],
    ) -> Surface {
        let placed = &self.stage.placed[element.placed as usize];
        let geometry = &self.stage.geometries[placed.geometry];
        let packet = &geometry.packets[element.packet as usize];
        let lane = usize::from(element.lane);
        let Facet { e1, e2, .. } = *facet;
        let double_area = facet.double_area();
        let normal = facet.normal(placed.mirrored);
        let b = [1.0 - b1 - b2, b1, b2].map(|x| x as f32);
        let part = geometry.parts[packet.parts[lane] as usize];
        let vertices = || {
            let triangle = &geometry.triangles[packet.ids[lane] as usize];
            triangle.vertices.map(|v| v as usize)
        };

        let mut shading = normal;
        if !geometry.normals.is_empty() {
            let [n0, n1, n2] = vertices().map(|v| Vec3::from(geometry.normals[v]));
            let is_smooth = n0 != Vec3::ZERO && n1 != Vec3::ZERO && n2 != Vec3::ZERO;
            let mut n = b[0] * n0 + b[1] * n1 + b[2] * n2;
            if placed.object_id.is_some() {
                // Normals go by the inverse transpose.
                n = placed.mesh_from_camera.matrix3.transpose() * n;
            }
            let n = n.normalize_or_zero();
            if is_smooth && n != Vec3::ZERO {
                shading = if n.dot(normal) < 0.0 { -n } else { n };
            }
        }

        let (mut uv, mut uv_per_mm, mut along_uv) = ([0.0; 2], 0.0, [Vec3::ZERO; 2]);
        if !geometry.uvs.is_empty() && self.traits[part.material as usize].is_textured {
            let at = vertices().map(|v| geometry.uvs[v]);
            uv = std::array::from_fn(|i| b[0] * at[0][i] + b[1] * at[1][i] + b[2] * at[2][i]);
            let [d1, d2] = [1, 2].map(|k| [at[k][0] - at[0][0], at[k][1] - at[0][1]]);
            let det = d1[0] * d2[1] - d1[1] * d2[0];
            if det != 0.0 {
                let (e1, e2) = (e1.as_vec3a(), e2.as_vec3a());
                along_uv = [
                    (e1 * d2[1] - e2 * d1[1]) / det,
                    (e2 * d1[0] - e1 * d2[0]) / det,
                ];
                uv_per_mm = (det.abs() / double_area as f32).sqrt();
            }
        }
        let mut colour = [1.0; 4];
        if !geometry.colours.is_empty() {
            let [c0, c1, c2] = vertices().map(|v| geometry.colours[v]);
            colour = std::array::from_fn(|i| b[0] * c0[i] + b[1] * c1[i] + b[2] * c2[i]);
        }
        Surface {
            position: facet.place([b1, b2]),
            distance: 0.0,
            normal,
            shading,
            uv,
            uv_per_mm,
            along_uv,
            colour,
            material: part.material as usize,
            object_id: placed.object_id.unwrap_or(part.object_id),
        }
    }

    /// R, G, B, A of a picture; white without one.
    #[inline(always)]
    pub(super) fn texel(
        &self,
        reference: Option<TextureRef>,
        uv: [f32; 2],
        footprint: &Footprint,
    ) -> [f32; 4] {
        let Some(r) = reference else {
            return [1.0; 4];
        };
        let map = &self.textures[r.texture];
        let width = footprint.width * r.uv_from_mesh.matrix2.determinant().abs().sqrt();
        let filter = map.filter(width);
        let at = |uv: Vec2| {
            let moved = r.uv_from_mesh.transform_point2(uv).to_array();
            map.filtered(&filter, moved)
        };
        if footprint.probes == 1 {
            return at(uv.into()).to_array();
        }
        let share = 1.0 / footprint.probes as f32;
        let mut mean = Vec4::ZERO;
        for k in 0..footprint.probes {
            let place = (k as f32 + 0.5) * share - 0.5;
            mean += at(Vec2::from(uv) + Vec2::from(footprint.row) * place) * share;
        }
        mean.to_array()
    }

    /// Alpha of a material at a place: 1 where opaque; 0 or 1 for a cut-out.
    pub(super) fn opacity(
        &self,
        material: &Material,
        surface: &Surface,
        footprint: &Footprint,
    ) -> f32 {
        let texel = |alpha: f32| {
            let texture = material.base_colour_texture;
            let texel = texture.map_or(1.0, |t| self.texel(Some(t), surface.uv, footprint)[3]);
            alpha * texel * surface.colour[3]
        };
        match material.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Blend { alpha } => texel(alpha).clamp(0.0, 1.0),
            Alpha::Mask { alpha, cutoff } => f32::from(texel(alpha) >= cutoff),
        }
    }

    /// Whether a cut-out is there, where the ray meets it. The full picture decides: a footprint would make edges
    /// depend on the ray's past.
    pub(super) fn is_solid(&self, element: Element, ray: &Ray) -> bool {
        let surface = self.surface(element, ray);
        self.opacity(
            &self.materials[surface.material],
            &surface,
            &Footprint::POINT,
        ) > 0.0
    }

    /// Radiance that the front (or the back, where that shines too) sends at a place.
    #[inline(always)]
    pub(super) fn emission(
        &self,
        surface: &Surface,
        is_front: bool,
        footprint: &Footprint,
    ) -> Vec3 {
        let material = &self.materials[surface.material];
        if material.emission == [0.0; 3] || !(is_front || material.two_sided) {
            return Vec3::ZERO;
        }
        let [r, g, b, _] = self.texel(material.emission_texture, surface.uv, footprint);
        Vec3::from(material.emission)
            * Vec3::new(r, g, b)
            * self.opacity(material, surface, footprint)
    }
}
