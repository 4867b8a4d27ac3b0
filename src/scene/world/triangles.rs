//! Rays against triangles, four at a time, without holes along shared edges.
//!
//! After S. Woop, C. Benthin, I. Wald, *Watertight ray/triangle intersection*, JCGT 2(1), 65 (2013): the vertices are
//! moved and sheared so that the ray runs along z from the origin; then the signs of three 2-D edge functions decide.
//! For f32 vertices a non-zero difference of two rounded products has the exact sign (rounding is monotonic), and a
//! zero one is done again in f64, where the products are exact. So two triangles that share an edge always agree on
//! which side of it a ray passes.

use glam::{Vec3, Vec4};

/// A ray of the walk, f32: hits are found with it and then computed again in f64.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct WalkRay {
    pub origin: Vec3,
    /// Its inverse direction, each component finite.
    pub inverse: Vec3,
    /// Axes in the order x, y, z of the sheared frame.
    axes: [usize; 3],
    /// The shear of x and y, and the scale of z.
    shear: Vec3,
}

/// Axes of the sheared frame by its z, and in the order that keeps the winding if the ray runs down it.
const AXES: [[[usize; 3]; 2]; 3] = [
    [[1, 2, 0], [2, 1, 0]],
    [[2, 0, 1], [0, 2, 1]],
    [[0, 1, 2], [1, 0, 2]],
];

impl WalkRay {
    #[inline(always)]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let d = direction.to_array();
        let [a, b, c] = d.map(f32::abs);
        // The longest component, without branches that nobody can foretell.
        let is_x = (a > b) & (a > c);
        let is_y = !is_x & (b > c);
        let z = 2 - 2 * usize::from(is_x) - usize::from(is_y);
        let axes = AXES[z][usize::from(d[z] < 0.0)];
        let [x, y, _] = axes;
        // A direction component of 0 becomes so small a one that the box test stays finite.
        let finite = |x: f32| {
            if x.abs() < 1e-30 {
                1e30f32.copysign(x)
            } else {
                1.0 / x
            }
        };
        let inverse = d.map(finite);
        let scale = inverse[z];
        Self {
            origin,
            inverse: Vec3::from(inverse),
            axes,
            shear: Vec3::new(d[x] * scale, d[y] * scale, scale),
        }
    }
}

/// Up to four triangles as columns: `vertices[vertex][axis]`. Unused lanes repeat the last.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Packet {
    vertices: [[Vec4; 3]; 3],
    /// Triangle numbers in their geometry.
    pub ids: [u32; 4],
    /// Their parts: what a hit asks for first lies beside what it was found with.
    pub parts: [u32; 4],
}

/// What a ray meets of a packet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PacketHits {
    /// Distance in units of the direction.
    pub t: [f32; 4],
    /// Bit i: lane i is met.
    pub mask: u32,
}

impl PacketHits {
    /// Something may be met.
    pub const SOME: Self = Self {
        t: [0.0; 4],
        mask: 1,
    };
}

impl Packet {
    /// From at least one triangle, its number and its part; more than four are left out.
    pub fn new(triangles: &[([[f32; 3]; 3], u32, u32)]) -> Self {
        let lane = |i: usize| &triangles[i.min(triangles.len() - 1)];
        Self {
            vertices: std::array::from_fn(|v| {
                std::array::from_fn(|axis| {
                    Vec4::from_array(std::array::from_fn(|i| lane(i).0[v][axis]))
                })
            }),
            ids: std::array::from_fn(|i| lane(i).1),
            parts: std::array::from_fn(|i| lane(i).2),
        }
    }

    /// Triangles in it: lanes up to the last that is not a repetition.
    pub fn len(&self) -> usize {
        1 + self.ids.windows(2).take_while(|w| w[0] != w[1]).count()
    }

    /// The corners of a lane.
    #[inline(always)]
    pub fn corners(&self, lane: usize) -> [Vec3; 3] {
        let corner = |v: &[Vec4; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        let [a, b, c] = &self.vertices;
        [corner(a), corner(b), corner(c)]
    }

    /// Hits of the first `count` lanes at 0 < t < `t_max`.
    #[inline(always)]
    pub fn intersect(&self, ray: &WalkRay, t_max: f32, count: u32) -> PacketHits {
        let [x, y, z] = ray.axes;
        let (ox, oy, oz) = (
            Vec4::splat(ray.origin[x]),
            Vec4::splat(ray.origin[y]),
            Vec4::splat(ray.origin[z]),
        );
        let (sx, sy, sz) = (
            Vec4::splat(ray.shear.x),
            Vec4::splat(ray.shear.y),
            Vec4::splat(ray.shear.z),
        );
        let sheared = |v: &[Vec4; 3]| {
            let depth = v[z] - oz;
            ((v[x] - ox) - sx * depth, (v[y] - oy) - sy * depth, depth)
        };
        let [a, b, c] = &self.vertices;
        let ((ax, ay, az), (bx, by, bz), (cx, cy, cz)) = (sheared(a), sheared(b), sheared(c));
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        let zero = Vec4::ZERO;
        let on_edge = (u.cmpeq(zero) | v.cmpeq(zero) | w.cmpeq(zero)).bitmask();
        if on_edge != 0 {
            u = exact(on_edge, u, cx, by, cy, bx);
            v = exact(on_edge, v, ax, cy, ay, cx);
            w = exact(on_edge, w, bx, ay, by, ax);
        }
        let inside = (u.cmpge(zero) & v.cmpge(zero) & w.cmpge(zero))
            | (u.cmple(zero) & v.cmple(zero) & w.cmple(zero));
        let lanes = (1u32 << count) - 1;
        let det = u + v + w;
        let t = sz * (u * az + v * bz + w * cz) / det;
        // A vanishing determinant makes t infinite or NaN, which fails.
        let ahead = t.cmpgt(zero) & t.cmplt(Vec4::splat(t_max));
        PacketHits {
            t: t.to_array(),
            mask: (inside & ahead).bitmask() & lanes,
        }
    }
}

/// a·b − c·d again in f64 in the lanes of `mask`: its sign is exact there.
#[cold]
fn exact(mask: u32, rounded: Vec4, a: Vec4, b: Vec4, c: Vec4, d: Vec4) -> Vec4 {
    let (a, b) = (a.to_array(), b.to_array());
    let (c, d) = (c.to_array(), d.to_array());
    let mut out = rounded.to_array();
    for i in (0..4).filter(|i| mask >> i & 1 == 1) {
        let value = f64::from(a[i]) * f64::from(b[i]) - f64::from(c[i]) * f64::from(d[i]);
        // A difference below the smallest f32 keeps its sign.
        out[i] = if value == 0.0 {
            0.0
        } else {
            (value.abs().max(f64::from(f32::MIN_POSITIVE)) as f32).copysign(value as f32)
        };
    }
    Vec4::from_array(out)
}
