//! What is known of a light, or of several together: where they are, where to they shine, how much. And their parting
//! into groups that lie together, by which a tree of them is made.

use glam::Vec3;

/// A box of lights (camera frame, mm), a cone of their normals and the sum of their power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    least: Vec3,
    greatest: Vec3,
    /// Middle of the cone.
    pub axis: Vec3,
    /// Cosine of half of its angle; −1 holds all directions.
    pub cos: f32,
    /// Radiance × mm² of a surface, radiance × mm² (intensity) of a point: only ratios within one tree count.
    pub power: f64,
}

/// Lights, each with its place in the list of all, that are parted in place.
pub(super) type Group<'a> = &'a mut [(u32, LightBounds)];

/// Bins of an axis in the search of a place to part lights.
const BINS: usize = 12;

impl LightBounds {
    /// A triangle by its corners, counter-clockwise seen from the front. It shines from there, or from both sides.
    pub fn triangle(corners: [Vec3; 3], two_sided: bool, power: f64) -> Self {
        let [p, q, r] = corners;
        let normal = (q - p).cross(r - p).normalize_or_zero();
        let is_one_way = !two_sided && normal != Vec3::ZERO;
        Self {
            least: p.min(q).min(r),
            greatest: p.max(q).max(r),
            axis: if is_one_way { normal } else { Vec3::Z },
            // Less than 1 by what rounding may turn a normal.
            cos: if is_one_way { 1.0 - 1e-6 } else { -1.0 },
            power,
        }
    }

    /// A point, which shines everywhere.
    pub fn point(place: Vec3, power: f64) -> Self {
        Self {
            least: place,
            greatest: place,
            axis: Vec3::Z,
            cos: -1.0,
            power,
        }
    }

    /// Of all lights of a group, one at least.
    fn of(group: &[(u32, Self)]) -> Self {
        let mut all = group[0].1;
        group[1..].iter().for_each(|(_, one)| all.join(one));
        all
    }

    fn join(&mut self, other: &Self) {
        self.least = self.least.min(other.least);
        self.greatest = self.greatest.max(other.greatest);
        (self.axis, self.cos) = joined((self.axis, self.cos), (other.axis, other.cos));
        self.power += other.power;
    }

    /// Middle of the box and half of its sides, mm.
    pub fn middle_and_half(&self) -> (Vec3, Vec3) {
        let middle = self.middle();
        (middle, self.greatest - middle)
    }

    fn middle(&self) -> Vec3 {
        0.5 * (self.least + self.greatest)
    }

    /// What a group costs in noise: power, by the box's surface and the solid angle to which it shines.
    fn cost(&self) -> f64 {
        let side = self.greatest - self.least;
        let surface = side.x * side.y + side.y * side.z + side.z * side.x;
        // Each of the cone's directions lights half of all around it, less with the angle.
        let half = self.cos.clamp(-1.0, 1.0).acos();
        let reach = (half + 0.5 * std::f32::consts::PI).min(std::f32::consts::PI);
        let solid = 4.0 * (1.0 - self.cos) + 2.0 * reach * half.sin()
            - (half - 2.0 * reach).cos()
            - 2.0 * half * half.sin()
            + self.cos;
        // Lights in a row have a box without surface, those at one place one without a length.
        let size = surface + 1e-3 * side.length_squared() + f32::MIN_POSITIVE;
        self.power * f64::from(size) * f64::from(solid.max(0.0) + 1e-3)
    }

    /// Parts lights, one at least, into at most `most` groups that lie together, each with its bounds.
    pub fn groups(lights: Group<'_>, most: usize) -> Vec<(Self, Group<'_>)> {
        let mut groups = vec![(Self::of(lights), lights)];
        while groups.len() < most {
            let costs = groups.iter().map(|(bounds, group)| match group.len() {
                1 => -1.0,
                _ => bounds.cost(),
            });
            let costliest = costs.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
            let Some((costliest, _)) = costliest.filter(|(_, cost)| *cost >= 0.0) else {
                break;
            };
            let (_, group) = groups.swap_remove(costliest);
            let (a, b) = parted(group);
            groups.extend([a, b].map(|group| (Self::of(group), group)));
        }
        groups
    }
}

/// The cone around two.
fn joined((axis_a, cos_a): (Vec3, f32), (axis_b, cos_b): (Vec3, f32)) -> (Vec3, f32) {
    // Most of many lights: balls and points.
    if cos_a == -1.0 || cos_b == -1.0 {
        return (Vec3::Z, -1.0);
    }
    let [half_a, half_b] = [cos_a, cos_b].map(|c| c.clamp(-1.0, 1.0).acos());
    let between = axis_a.dot(axis_b).clamp(-1.0, 1.0).acos();
    let pi = std::f32::consts::PI;
    if (between + half_b).min(pi) <= half_a {
        return (axis_a, cos_a);
    }
    if (between + half_a).min(pi) <= half_b {
        return (axis_b, cos_b);
    }
    let half = 0.5 * (half_a + half_b + between);
    let across = axis_a.cross(axis_b).normalize_or_zero();
    if half >= pi || across == Vec3::ZERO {
        return (Vec3::Z, -1.0);
    }
    // From a towards b, so that a's far side is on the edge; with room for the rounding of these angles.
    let (sin, cos) = (half - half_a).sin_cos();
    let axis = axis_a * cos + across.cross(axis_a) * sin;
    (axis.normalize(), (half + 1e-3).min(pi).cos())
}

/// Two groups of two or more lights, neither empty.
fn parted(lights: Group<'_>) -> (Group<'_>, Group<'_>) {
    let middles = || lights.iter().map(|(_, b)| b.middle());
    let least = middles().fold(Vec3::INFINITY, Vec3::min);
    let greatest = middles().fold(Vec3::NEG_INFINITY, Vec3::max);
    let bin = |b: &LightBounds, axis: usize| {
        let along = (b.middle()[axis] - least[axis]) / (greatest[axis] - least[axis]);
        ((along * BINS as f32) as usize).min(BINS - 1)
    };
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in (0..3).filter(|a| greatest[*a] > least[*a]) {
        let mut bins: [Option<LightBounds>; BINS] = [None; BINS];
        for (_, bounds) in lights.iter() {
            add(&mut bins[bin(bounds, axis)], bounds);
        }
        for first in 1..BINS {
            let [mut below, mut above] = [None; 2];
            bins[..first]
                .iter()
                .flatten()
                .for_each(|b| add(&mut below, b));
            bins[first..]
                .iter()
                .flatten()
                .for_each(|b| add(&mut above, b));
            if let (Some(below), Some(above)) = (below, above) {
                let cost = below.cost() + above.cost();
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, first));
                }
            }
        }
    }
    let half = match best {
        Some((_, axis, first)) => {
            let mut below = 0;
            for i in 0..lights.len() {
                if bin(&lights[i].1, axis) < first {
                    lights.swap(i, below);
                    below += 1;
                }
            }
            below
        }
        // All at one place.
        None => lights.len() / 2,
    };
    lights.split_at_mut(half)
}

fn add(sum: &mut Option<LightBounds>, one: &LightBounds) {
    match sum {
        Some(all) => all.join(one),
        None => *sum = Some(*one),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform;

    #[test]
    fn a_joined_cone_holds_both() {
        let u = |k: u64, d: u64| uniform(9, &[k, d]) as f32;
        for k in 0..2000 {
            let cone = |d| {
                let axis = Vec3::new(u(k, d), u(k, d + 1), u(k, d + 2)) - 0.5;
                (axis.normalize(), 1.0 - 2.0 * u(k, d + 3).powi(3))
            };
            let (a, b) = (cone(0), cone(4));
            let (axis, cos) = joined(a, b);
            for (own_axis, own_cos) in [a, b] {
                for i in 0..16 {
                    let (x, y) = own_axis.any_orthonormal_pair();
                    let (s, c) = (i as f32 * 0.4).sin_cos();
                    let sin = (1.0 - own_cos * own_cos).sqrt();
                    let edge = own_axis * own_cos + (x * c + y * s) * sin;
                    assert!(axis.dot(edge) >= cos - 1e-5, "{axis} {cos}: {edge}");
                }
            }
        }
    }
}
