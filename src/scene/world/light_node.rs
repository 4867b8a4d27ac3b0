//! A node of the tree of lights ([`super::light_tree`]) and what its children may give a place.

use glam::{DVec3, Vec3A as Vec3};

use super::light_bounds::LightBounds;
use super::triangles::WalkRay;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// Where light is to be received.
#[derive(Clone, Copy, Debug)]
pub(super) struct Receiver {
    /// Camera frame, mm.
    pub place: Vec3,
    /// Unit normal of the side that receives: nothing arrives from behind it.
    pub normal: Vec3,
}

impl Receiver {
    /// A place in the camera frame, mm.
    pub fn new(place: DVec3, normal: Vec3) -> Self {
        Self {
            place: place.as_vec3a(),
            normal,
        }
    }
}

/// A node and a lane in it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Parent {
    pub node: u32,
    pub lane: u32,
}

/// What a lane leads to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) enum Child {
    #[default]
    Nothing,
    Light(u32),
    Node(u32),
}

/// Up to eight children, field by field.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    pub parent: Option<Parent>,
    pub children: [Child; WIDTH],
    /// Middles of their boxes, half of the boxes' sides, radius of the balls around them.
    x: [f32; WIDTH],
    y: [f32; WIDTH],
    z: [f32; WIDTH],
    half_x: [f32; WIDTH],
    half_y: [f32; WIDTH],
    half_z: [f32; WIDTH],
    radius: [f32; WIDTH],
    /// Middle of the directions of all normals, and cosine and sine of the largest angle to it.
    axis_x: [f32; WIDTH],
    axis_y: [f32; WIDTH],
    axis_z: [f32; WIDTH],
    cos: [f32; WIDTH],
    sin: [f32; WIDTH],
    power: [f32; WIDTH],
}

/// Boxes and balls are larger by this part, for rounding.
const ROOM: f32 = 1.0 + 1e-4;
/// Normals within 2 mrad of their axis are alike.
const FLAT: f32 = 1.0 - 2e-6;
/// Square of the least distance that counts, mm².
const LEAST_SQUARED: f32 = 1e-12;

impl Node {
    /// Without children yet.
    pub fn new(parent: Option<Parent>) -> Self {
        Self {
            parent,
            ..Self::default()
        }
    }

    pub fn set(&mut self, lane: usize, child: Child, bounds: &LightBounds) {
        let (centre, half) = bounds.middle_and_half();
        let half = half * ROOM + centre.abs().max_element() * (4.0 * f32::EPSILON);
        self.children[lane] = child;
        [self.x[lane], self.y[lane], self.z[lane]] = centre.to_array();
        [self.half_x[lane], self.half_y[lane], self.half_z[lane]] = half.to_array();
        self.radius[lane] = half.length() * ROOM;
        [self.axis_x[lane], self.axis_y[lane], self.axis_z[lane]] = bounds.axis.to_array();
        self.cos[lane] = bounds.cos;
        self.sin[lane] = (1.0 - bounds.cos * bounds.cos).max(0.0).sqrt();
        self.power[lane] = bounds.power as f32;
    }

    /// The children in whose boxes a ray (camera frame, mm) may meet something; it never meets what is in others. By
    /// the boxes' slabs (T. Kay, J. Kajiya, SIGGRAPH 1986).
    #[inline(always)]
    pub fn met_by(&self, ray: &WalkRay) -> impl Iterator<Item = Child> {
        let (origin, inverse) = (ray.origin, ray.inverse);
        // What rounding moves the ray's origin by, and what is found of it, with room.
        let pad = origin.abs().max_element() * (16.0 * f32::EPSILON);
        let mut is_met = [false; WIDTH];
        for (i, is_met) in is_met.iter_mut().enumerate() {
            let slab = |middle: f32, half: f32, origin: f32, inverse: f32| {
                let middle = (middle - origin) * inverse;
                let half = (half + pad) * inverse.abs();
                (middle - half, middle + half)
            };
            let x = slab(self.x[i], self.half_x[i], origin.x, inverse.x);
            let y = slab(self.y[i], self.half_y[i], origin.y, inverse.y);
            let z = slab(self.z[i], self.half_z[i], origin.z, inverse.z);
            let enter = at_least(at_least(x.0, y.0), at_least(z.0, 0.0));
            let leave = at_most(at_most(x.1, y.1), z.1);
            // Of what overflows nothing is known.
            let is_missed = enter > leave;
            *is_met = !is_missed;
        }
        (self.children.iter().zip(is_met)).filter_map(|(child, is_met)| is_met.then_some(*child))
    }

    /// Importance of each child.
    #[inline(always)]
    pub fn importances(&self, receiver: &Receiver) -> Importances {
        let Receiver { place, normal } = *receiver;
        let mut importances = [0.0; WIDTH];
        for (i, importance) in importances.iter_mut().enumerate() {
            let (x, y, z) = (
                self.x[i] - place.x,
                self.y[i] - place.y,
                self.z[i] - place.z,
            );
            let squared = x * x + y * y + z * z;
            let radius = self.radius[i];
            let inverse = 1.0 / at_least(squared, LEAST_SQUARED).sqrt();
            // Half of the angle at which the ball is seen.
            let ball = with_cosine(radius * inverse);
            let ahead = -(self.axis_x[i] * x + self.axis_y[i] * y + self.axis_z[i] * z);
            let height = normal.x * x + normal.y * y + normal.z * z;
            let rise = normal.x.abs() * self.half_x[i]
                + normal.y.abs() * self.half_y[i]
                + normal.z.abs() * self.half_z[i];
            // Of normals that are all alike, what is behind all of their planes gets nothing.
            let is_behind = self.cos[i] > FLAT
                && ahead
                    + self.axis_x[i].abs() * self.half_x[i]
                    + self.axis_y[i].abs() * self.half_y[i]
                    + self.axis_z[i].abs() * self.half_z[i]
                    <= 0.0;
            let [sends, _] = less(
                less(with_sine(ahead * inverse), [self.cos[i], self.sin[i]]),
                ball,
            );
            let [receives, _] = less(with_sine(height * inverse), ball);
            // Nothing in the box is higher above the receiver's plane, nor nearer than the ball.
            let distance = squared * inverse;
            let steepest = (height + rise) / at_least(distance - radius, LEAST_SQUARED);
            let outside = at_least(sends, 0.0) * at_least(at_most(receives, steepest), 0.0);
            let near = if height + rise > 0.0 { 1.0 } else { 0.0 };
            let cosines = if distance > radius { outside } else { near };
            let cosines = if is_behind { 0.0 } else { cosines };
            let nearest = at_least(at_least(squared, radius * radius), LEAST_SQUARED);
            *importance = self.power[i] * cosines / nearest;
        }
        let mut sum = 0.0;
        let running = importances.map(|i| {
            sum += i;
            sum
        });
        Importances {
            each: importances,
            running,
        }
    }
}

/// Of the children of a node.
pub(super) struct Importances {
    pub each: [f32; WIDTH],
    /// Sums up to each.
    running: [f32; WIDTH],
}

impl Importances {
    /// Of all; `None` for 0, and for an infinite or undefined one.
    #[inline(always)]
    pub fn sum(&self) -> Option<f32> {
        let sum = self.running[WIDTH - 1];
        (sum > 0.0 && sum < f32::INFINITY).then_some(sum)
    }

    /// The child that `u` in 0..1 falls on, its chance, and `u` stretched over it.
    #[inline(always)]
    pub fn draw(&self, u: f32) -> Option<(usize, f32, f32)> {
        let sum = self.sum()?;
        let target = u * sum;
        let passed: usize = self.running.iter().map(|r| usize::from(*r <= target)).sum();
        // The last child that has a share is for what rounding leaves.
        let lane = match passed < WIDTH {
            true => passed,
            false => self.each.iter().rposition(|i| *i > 0.0)?,
        };
        let before = lane.checked_sub(1).map_or(0.0, |i| self.running[i]);
        let own = self.each[lane];
        let rest = ((target - before) / own).clamp(0.0, 1.0 - f32::EPSILON);
        Some((lane, own / sum, rest))
    }
}

/// The larger one; `f32::max` has NaN to mind.
#[inline(always)]
fn at_least(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[inline(always)]
fn at_most(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn with_sine(cos: f32) -> [f32; 2] {
    [cos, at_least(1.0 - cos * cos, 0.0).sqrt()]
}

#[inline(always)]
fn with_cosine(sin: f32) -> [f32; 2] {
    [at_least(1.0 - sin * sin, 0.0).sqrt(), sin]
}

/// Cosine and sine of an angle less another, 0 at least.
#[inline(always)]
fn less([cos_a, sin_a]: [f32; 2], [cos_b, sin_b]: [f32; 2]) -> [f32; 2] {
    let difference = [cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b];
    match cos_a > cos_b {
        true => [1.0, 0.0],
        false => difference,
    }
}
