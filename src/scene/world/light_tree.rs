//! Many lights, each drawn about as often as it matters where it is drawn for.
//!
//! A tree of balls around lights; a node has up to eight. A light is drawn from the root down, at each node a child by
//! its importance for the place (A. Conty Estevez, C. Kulla, *Importance sampling of many lights with adaptive tree
//! splitting*, Proc. ACM Comput. Graph. Interact. Tech. 1(2), 25 (2018)):
//!
//! ```text
//! I = Φ max(0, cos θ_out) max(0, cos θ_in) / max(d², r²)
//! ```
//!
//! Φ the power of the lights in the ball, d from the place to its middle, r its radius, and the largest cosines at
//! which any light in it can send (Lambert's law) and the place can receive. I is 0 only where nothing arrives.
//!
//! Importances do not know what stands in the way. Where the nearest light is hidden, the others would be drawn seldom
//! and with large weights. So a part of the draws goes by power alone (T. Hesterberg, *Technometrics* 37(2), 185
//! (1995): defensive mixtures), and no weight is larger than one over that part of what power alone would give.

use glam::{DVec3, Vec3A as Vec3};

use super::light_bounds::{Group, LightBounds};
use crate::simd::SimdLevel;

/// Children of a node.
const WIDTH: usize = 8;

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

/// Lights, by their place in the list that the tree was made of.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// Of each light, its node and lane.
    lights: Vec<Parent>,
    /// Running sums of the lights' parts of all power.
    shares: Vec<f64>,
    simd: SimdLevel,
}

/// Part of the draws that goes by power alone.
const BY_POWER: f32 = 0.125;

/// A node and a lane in it.
#[derive(Clone, Copy, Debug, Default)]
struct Parent {
    node: u32,
    lane: u32,
}

/// What a lane leads to.
#[derive(Clone, Copy, Debug, Default)]
enum Child {
    #[default]
    Nothing,
    Light(u32),
    Node(u32),
}

/// Up to eight children, field by field.
#[derive(Clone, Debug, Default)]
struct Node {
    parent: Option<Parent>,
    children: [Child; WIDTH],
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
    fn set(&mut self, lane: usize, child: Child, bounds: &LightBounds) {
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

    /// Importance of each child.
    #[inline(always)]
    fn importances(&self, receiver: &Receiver) -> Importances {
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
struct Importances {
    each: [f32; WIDTH],
    /// Sums up to each.
    running: [f32; WIDTH],
}

impl Importances {
    /// Of all; `None` for 0, and for an infinite or undefined one.
    #[inline(always)]
    fn sum(&self) -> Option<f32> {
        let sum = self.running[WIDTH - 1];
        (sum > 0.0 && sum < f32::INFINITY).then_some(sum)
    }

    /// The child that `u` in 0..1 falls on, its chance, and `u` stretched over it.
    #[inline(always)]
    fn draw(&self, u: f32) -> Option<(usize, f32, f32)> {
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

impl LightTree {
    /// Of lights whose power is above 0.
    pub fn new(lights: &[LightBounds]) -> Self {
        let total: f64 = lights.iter().map(|l| l.power).sum();
        let mut sum = 0.0;
        let shares = lights.iter().map(|l| {
            sum += l.power / total;
            sum
        });
        let mut tree = Self {
            nodes: Vec::new(),
            lights: vec![Parent::default(); lights.len()],
            shares: shares.collect(),
            simd: SimdLevel::detect(),
        };
        let mut all: Vec<(u32, LightBounds)> = (0..).zip(lights.iter().copied()).collect();
        if !all.is_empty() {
            tree.add_node(&mut all, None);
        }
        tree
    }

    fn add_node(&mut self, lights: Group<'_>, parent: Option<Parent>) -> u32 {
        let number = self.nodes.len() as u32;
        self.nodes.push(Node {
            parent,
            ..Node::default()
        });
        let groups = LightBounds::groups(lights, WIDTH).into_iter();
        for (lane, (bounds, group)) in groups.enumerate() {
            let here = Parent {
                node: number,
                lane: lane as u32,
            };
            let child = match group {
                [(light, _)] => {
                    self.lights[*light as usize] = here;
                    Child::Light(*light)
                }
                _ => Child::Node(self.add_node(group, Some(here))),
            };
            self.nodes[number as usize].set(lane, child, &bounds);
        }
        number
    }

    /// Whether there are no lights.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The light that `u` in 0..1 falls on, and its chance; `None` for the `u` of lights of which, on a closer look,
    /// nothing arrives.
    #[inline]
    pub fn draw(&self, receiver: &Receiver, u: f32) -> Option<(usize, f32)> {
        if u < BY_POWER {
            let target = f64::from(u / BY_POWER);
            let light = self.shares.partition_point(|s| *s <= target);
            let light = light.min(self.shares.len().checked_sub(1)?);
            return Some((light, self.chance(light, receiver)));
        }
        let u = (u - BY_POWER) / (1.0 - BY_POWER);
        let (light, importance) = self.draw_by_importance(receiver, u)?;
        Some((light, self.mixed(light, importance)))
    }

    /// The chance of a light to be drawn.
    pub fn chance(&self, light: usize, receiver: &Receiver) -> f32 {
        self.mixed(light, self.chance_by_importance(light, receiver))
    }

    /// Of a light, from its chance by importance.
    #[inline]
    fn mixed(&self, light: usize, by_importance: f32) -> f32 {
        let before = light.checked_sub(1).map_or(0.0, |i| self.shares[i]);
        let by_power = (self.shares[light] - before) as f32;
        by_importance + BY_POWER * (by_power - by_importance)
    }

    fn draw_by_importance(&self, receiver: &Receiver, u: f32) -> Option<(usize, f32)> {
        #[cfg(target_arch = "x86_64")]
        if self.simd >= SimdLevel::Avx2 {
            // SAFETY: the level says that the CPU has AVX2.
            return unsafe { self.descend_avx2(receiver, u) };
        }
        self.descend(receiver, u)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn descend_avx2(&self, receiver: &Receiver, u: f32) -> Option<(usize, f32)> {
        self.descend(receiver, u)
    }

    #[inline(always)]
    fn descend(&self, receiver: &Receiver, mut u: f32) -> Option<(usize, f32)> {
        let mut node = self.nodes.first()?;
        let mut chance = 1.0;
        loop {
            let (lane, share, rest) = node.importances(receiver).draw(u)?;
            u = rest;
            chance *= share;
            match node.children[lane] {
                Child::Light(light) => return Some((light as usize, chance)),
                Child::Node(next) => node = &self.nodes[next as usize],
                Child::Nothing => return None,
            }
        }
    }

    pub(super) fn chance_by_importance(&self, light: usize, receiver: &Receiver) -> f32 {
        #[cfg(target_arch = "x86_64")]
        if self.simd >= SimdLevel::Avx2 {
            // SAFETY: the level says that the CPU has AVX2.
            return unsafe { self.ascend_avx2(light, receiver) };
        }
        self.ascend(light, receiver)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn ascend_avx2(&self, light: usize, receiver: &Receiver) -> f32 {
        self.ascend(light, receiver)
    }

    #[inline(always)]
    fn ascend(&self, light: usize, receiver: &Receiver) -> f32 {
        let mut chance = 1.0;
        let mut way = self.lights.get(light).copied();
        while let Some(Parent { node, lane }) = way {
            let node = &self.nodes[node as usize];
            let importances = node.importances(receiver);
            let Some(sum) = importances.sum() else {
                return 0.0;
            };
            chance *= importances.each[lane as usize] / sum;
            way = node.parent;
        }
        chance
    }
}
