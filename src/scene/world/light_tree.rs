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

use super::light_bounds::{Group, LightBounds};
use super::light_node::{Child, Node, Parent, Receiver, WIDTH};
use super::triangles::WalkRay;

/// Lights, by their place in the list that the tree was made of.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Vec<Node>,
    /// Of each light, its node and lane.
    lights: Vec<Parent>,
    /// Running sums of the lights' parts of all power.
    shares: Vec<f64>,
}

/// Part of the draws that goes by power alone.
const BY_POWER: f32 = 0.125;

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
        };
        let mut all: Vec<(u32, LightBounds)> = (0..).zip(lights.iter().copied()).collect();
        if !all.is_empty() {
            tree.add_node(&mut all, None);
        }
        tree
    }

    fn add_node(&mut self, lights: Group<'_>, parent: Option<Parent>) -> u32 {
        let number = self.nodes.len() as u32;
        self.nodes.push(Node::new(parent));
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

    /// Whether a ray (camera frame, mm) may meet any light; if not, it meets none.
    pub fn may_be_met(&self, ray: &WalkRay) -> bool {
        (self.nodes.first()).is_some_and(|root| self.may_be_met_in(root, ray))
    }

    fn may_be_met_in(&self, node: &Node, ray: &WalkRay) -> bool {
        node.met_by(ray).any(|child| match child {
            Child::Nothing => false,
            Child::Light(_) => true,
            Child::Node(next) => self.may_be_met_in(&self.nodes[next as usize], ray),
        })
    }

    /// The light that `u` in 0..1 falls on, and its chance; `None` for the `u` of lights of which, on a closer look,
    /// nothing arrives.
    #[inline(always)]
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
    #[inline(always)]
    pub fn chance(&self, light: usize, receiver: &Receiver) -> f32 {
        self.mixed(light, self.chance_by_importance(light, receiver))
    }

    /// Of a light, from its chance by importance.
    #[inline(always)]
    fn mixed(&self, light: usize, by_importance: f32) -> f32 {
        let before = light.checked_sub(1).map_or(0.0, |i| self.shares[i]);
        let by_power = (self.shares[light] - before) as f32;
        by_importance + BY_POWER * (by_power - by_importance)
    }

    #[inline(always)]
    fn draw_by_importance(&self, receiver: &Receiver, mut u: f32) -> Option<(usize, f32)> {
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

    #[inline(always)]
    pub(super) fn chance_by_importance(&self, light: usize, receiver: &Receiver) -> f32 {
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
