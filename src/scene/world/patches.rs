//! Four-cornered patches that shine: the surfaces of a picture with depth.
//!
//! Each patch stands for one sample of a picture and is two triangles. Its radiance is the same in all directions and
//! bilinear between the middles of neighbouring patches: in each quarter of a patch between the samples around the
//! corner there, those that are not there left out.

use glam::{DVec3, Vec3};

use super::bvh::{Bounds, Bvh};
use super::triangles::{Packet, PacketHits, WalkRay};
use super::walk::{Leaves, Visit, Walks};
use crate::rays::RaySlices;
use crate::scene::hits::NO_SURFACE;

/// No sample, no patch.
const NONE: u32 = u32::MAX;
/// Rays begin within so much of the first lens vertex, mm.
const ORIGINS_MM: f32 = 100.0;
/// Rays that walk the tree together.
const TOGETHER: usize = 16;

/// One patch. Corners are in the order upper left, upper right, lower left, lower right of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patch {
    /// Numbers of the corners' positions.
    pub corners: [u32; 4],
    /// Samples around each corner: the patches upper left, upper right, lower left and lower right of it.
    pub around: [[Option<u32>; 4]; 4],
    /// Surface that it is a part of, for occlusion.
    pub surface: u16,
}

/// Patches in the camera frame, mm, and the tree over them.
#[derive(Clone, Debug)]
pub struct Patches {
    positions: Vec<Vec3>,
    corners: Vec<[u32; 4]>,
    around: Vec<[[u32; 4]; 4]>,
    surfaces: Vec<u16>,
    bvh: Bvh,
    packets: Vec<Packet>,
}

/// Where rays meet patches, one entry per ray.
#[derive(Clone, Debug, Default)]
pub struct PatchHits {
    /// Number of the patch, and the place in it from its middle, −½ to ½ to the right and down.
    met: Vec<(u32, [f32; 2])>,
    walks: Walks,
}

/// The nearest triangle of each ray on its way.
struct NearestPatches<'a> {
    packets: &'a [Packet],
    nearest: [u32; TOGETHER],
}

impl Leaves for NearestPatches<'_> {
    #[inline(always)]
    fn test(&self, ray: &WalkRay, t_max: f32, leaf: usize, items: u32) -> PacketHits {
        self.packets[leaf].intersect(ray, t_max, items)
    }

    fn visit(&mut self, v: Visit<'_>, found: &PacketHits) -> bool {
        for lane in (0..4).filter(|lane| found.mask >> lane & 1 == 1) {
            if found.t[lane] < *v.t_max {
                *v.t_max = found.t[lane];
                self.nearest[v.number] = self.packets[v.leaf].ids[lane];
            }
        }
        false
    }

    #[inline(always)]
    fn memory(&self) -> (*const u8, usize) {
        (self.packets.as_ptr().cast(), size_of::<Packet>())
    }
}

impl Patches {
    /// From positions, mm, and patches that name them; at most 2²⁸ patches.
    pub fn new(positions_mm: &[DVec3], patches: &[Patch]) -> Self {
        let positions: Vec<Vec3> = positions_mm.iter().map(|p| p.as_vec3()).collect();
        let corner = |t: usize| triangle(&patches[t / 2].corners, t % 2);
        let points = |t: usize| corner(t).map(|v| positions[v as usize]);
        let boxes: Vec<Bounds> = (0..2 * patches.len())
            .map(|t| Bounds::from_points(points(t)))
            .collect();
        let mut packets = Vec::with_capacity(patches.len());
        // A sky far away must not widen the boxes of what is near.
        let reach = |b: &Bounds| b.reach().max(ORIGINS_MM);
        let bvh = Bvh::build_within(&boxes, reach, |items| {
            let lane = |&t: &u32| (points(t as usize).map(|p| p.to_array()), t, 0);
            let lanes: Vec<_> = items.iter().map(lane).collect();
            packets.push(Packet::new(&lanes));
        });
        let stored = |around: [[Option<u32>; 4]; 4]| around.map(|c| c.map(|s| s.unwrap_or(NONE)));
        Self {
            corners: patches.iter().map(|p| p.corners).collect(),
            around: patches.iter().map(|p| stored(p.around)).collect(),
            surfaces: patches.iter().map(|p| p.surface).collect(),
            positions,
            bvh,
            packets,
        }
    }

    /// Patches.
    pub fn count(&self) -> usize {
        self.corners.len()
    }

    /// First hits of the rays that are alive: their distances, mm, and surfaces.
    pub(in crate::scene) fn intersect(
        &self,
        rays: RaySlices<'_>,
        (distance_mm, surface): (&mut [f64], &mut [u16]),
        hits: &mut PatchHits,
    ) {
        hits.met.clear();
        hits.met.resize(distance_mm.len(), (NONE, [0.0; 2]));
        let mut alive = rays.alive();
        loop {
            let mut some = [None; TOGETHER];
            let walks = &mut hits.walks.outer;
            walks.clear();
            let mut count = 0;
            for (k, (number, ray)) in alive.by_ref().take(TOGETHER).enumerate() {
                some[k] = Some((number, ray));
                let walk = WalkRay::new(ray.origin_mm.as_vec3(), ray.direction.as_vec3());
                walks.add(k as u32, walk, f32::INFINITY);
                count = k + 1;
            }
            if count == 0 {
                return;
            }
            let mut leaves = NearestPatches {
                packets: &self.packets,
                nearest: [NONE; TOGETHER],
            };
            self.bvh.walk_all(walks, &mut leaves);
            for ((number, ray), id) in some.iter().flatten().zip(leaves.nearest) {
                if id != NONE {
                    let (distance, place) = self.place(id, [ray.origin_mm, ray.direction]);
                    distance_mm[*number] = distance;
                    surface[*number] = self.surfaces[id as usize / 2];
                    hits.met[*number] = (id / 2, place);
                }
            }
        }
    }

    /// Distance of a ray's hit with a triangle, and its place in the patch.
    fn place(&self, id: u32, [origin, direction]: [DVec3; 2]) -> (f64, [f32; 2]) {
        let (patch, half) = (id as usize / 2, id as usize % 2);
        let corners = triangle(&self.corners[patch], half);
        let [p0, p1, p2] = corners.map(|v| self.positions[v as usize].as_dvec3());
        let (e1, e2) = (p1 - p0, p2 - p0);
        let n = e1.cross(e2);
        let t = n.dot(p0 - origin) / n.dot(direction);
        let q = origin + t * direction - p0;
        let squared = n.length_squared();
        // A ray along the plane makes these NaN: then the first corner serves.
        let within = |x: f64| if x > 0.0 { x.min(1.0) } else { 0.0 };
        let right = within(n.dot(q.cross(e2)) / squared);
        let down = within(n.dot(e1.cross(q)) / squared);
        let sign = if half == 0 { 1.0 } else { -1.0 };
        let place = [right, down].map(|b| (sign * (b - 0.5)) as f32);
        (if t.is_finite() { t } else { 0.0 }, place)
    }

    /// Radiance of a colour channel along rays whose first hits are known, by that of each patch's middle; that of
    /// rays which meet nothing is `elsewhere`.
    pub(in crate::scene) fn radiance(
        &self,
        hits: &PatchHits,
        (samples, channel): (&[[f32; 3]], usize),
        elsewhere: f32,
        out: &mut [f32],
    ) {
        for (out, &(patch, [x, y])) in out.iter_mut().zip(&hits.met) {
            if patch == NONE {
                *out = elsewhere;
                continue;
            }
            let corner = usize::from(x >= 0.0) + 2 * usize::from(y >= 0.0);
            // From the sample to the left, or above.
            let part = |x: f32| if x >= 0.0 { x } else { 1.0 + x };
            let (fx, fy) = (part(x), part(y));
            let weights = [
                (1.0 - fx) * (1.0 - fy),
                fx * (1.0 - fy),
                (1.0 - fx) * fy,
                fx * fy,
            ];
            let (mut sum, mut all) = (0.0, 0.0);
            for (&sample, weight) in self.around[patch as usize][corner].iter().zip(weights) {
                if sample != NONE {
                    sum += weight * samples[sample as usize][channel];
                    all += weight;
                }
            }
            *out = sum / all;
        }
    }
}

/// Corners of the upper left or lower right half of a patch: its first corner, then those beside it in x and y.
fn triangle(corners: &[u32; 4], half: usize) -> [u32; 3] {
    let [a, b, c, d] = *corners;
    match half {
        0 => [a, b, c],
        _ => [d, c, b],
    }
}

/// The surface of a number, which never is that of none.
pub(crate) fn surface_number(number: usize) -> u16 {
    (number % usize::from(NO_SURFACE)) as u16
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::rays::RayBatch;

    /// Two patches side by side, 1 mm wide, 10 mm away, one surface or two.
    fn pair(one_surface: bool) -> Patches {
        let mut positions = Vec::new();
        for y in [1.0, 0.0] {
            positions.extend([0.0, 1.0, 2.0].map(|x| DVec3::new(x, y, -10.0)));
        }
        let beside = |own: u32, other: u32, at_right: bool| {
            let other = one_surface.then_some(other);
            let (left, right) = match at_right {
                true => ([Some(own), Some(own)], [Some(own), other]),
                false => ([other, Some(own)], [Some(own), Some(own)]),
            };
            let corner = |[a, b]: [Option<u32>; 2]| [a, b, a, b];
            [corner(left), corner(right), corner(left), corner(right)]
        };
        let patch = |k: u32| Patch {
            corners: [k, k + 1, k + 3, k + 4],
            around: beside(k, 1 - k, k == 0),
            surface: if one_surface { 0 } else { k as u16 },
        };
        Patches::new(&positions, &[patch(0), patch(1)])
    }

    fn seen(patches: &Patches, x: f64) -> (f64, u16, f32) {
        let mut batch = RayBatch::default();
        batch.push(DVec3::new(x, 0.4, 0.0), -DVec3::Z);
        let (mut distance, mut surface) = ([f64::INFINITY], [NO_SURFACE]);
        let mut hits = PatchHits::default();
        let rays = RaySlices::from_batch(&batch);
        patches.intersect(rays, (&mut distance, &mut surface), &mut hits);
        let mut out = [0.0];
        patches.radiance(&hits, (&[[1.0; 3], [3.0; 3]], 1), 7.0, &mut out);
        (distance[0], surface[0], out[0])
    }

    #[test]
    fn radiance_is_bilinear_on_a_surface_and_jumps_between_two() {
        let one = pair(true);
        for (x, expected) in [(0.1, 1.0), (0.5, 1.0), (0.75, 1.5), (1.25, 2.5), (1.9, 3.0)] {
            let (distance, surface, radiance) = seen(&one, x);
            assert!((distance - 10.0).abs() < 1e-6 && surface == 0);
            assert!((radiance - expected).abs() < 1e-5, "{x}: {radiance}");
        }
        let two = pair(false);
        for (x, expected) in [(0.9, 1.0), (1.1, 3.0)] {
            let (_, _, radiance) = seen(&two, x);
            assert!((radiance - expected).abs() < 1e-5, "{x}: {radiance}");
        }
        assert_eq!([0.9, 1.1].map(|x| seen(&two, x).1), [0, 1]);
        assert_eq!(seen(&two, 2.5), (f64::INFINITY, NO_SURFACE, 7.0));
    }
}
