//! One ray's way through a tree, step by step.

use super::bvh::{Child, Node};
use super::fold::WIDTH;
use super::lanes::Lanes;
use super::triangles::WalkRay;

/// Rounding of the six products and differences of a box test, with room (T. Ize, JCGT 2(2), 12 (2013)).
const FAR_FACTOR: f32 = 1.000_000_5;

/// A ray on its way.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    pub ray: WalkRay,
    /// Bounds of each axis that the ray meets first: the least if it runs up.
    near: [usize; 3],
    /// Only what is nearer counts; leaves may lower it.
    pub t_max: f32,
    /// The caller's number of the ray.
    pub number: u32,
    pub current: Child,
    /// What is still to be visited, the first so many, and room for more: entry distance (its bits, which are in the
    /// order of the numbers, as none is below 0) above the child.
    waiting: Vec<u64>,
    left: usize,
}

/// Where a ray meets the boxes of a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Met {
    enter: [f32; WIDTH],
    /// Bit i: child i is met.
    hits: u32,
}

impl Walk {
    /// Sets out.
    #[inline(always)]
    pub fn start(&mut self, number: u32, ray: WalkRay, t_max: f32) {
        self.near = [
            usize::from(ray.inverse.x.is_sign_negative()),
            2 + usize::from(ray.inverse.y.is_sign_negative()),
            4 + usize::from(ray.inverse.z.is_sign_negative()),
        ];
        self.ray = ray;
        self.t_max = t_max;
        self.number = number;
        self.left = 0;
    }

    /// Tests the boxes of a node.
    #[inline(always)]
    pub fn meet<L: Lanes>(&self, node: &Node) -> Met {
        let (o, inv) = (self.ray.origin, self.ray.inverse);
        let origin = [L::splat(o.x), L::splat(o.y), L::splat(o.z)];
        let inverse = [L::splat(inv.x), L::splat(inv.y), L::splat(inv.z)];
        let near = self.near;
        let slab = |axis: usize, bound: usize| {
            L::load(&node.bounds[bound])
                .minus(origin[axis])
                .times(inverse[axis])
        };
        let enter = slab(0, near[0])
            .greatest(slab(1, near[1]))
            .greatest(slab(2, near[2]).greatest(L::splat(0.0)));
        let leave = slab(0, near[0] ^ 1)
            .least(slab(1, near[1] ^ 1))
            .least(slab(2, near[2] ^ 1))
            .times(L::splat(FAR_FACTOR));
        Met {
            enter: enter.store(),
            hits: enter.at_most(leave.least(L::splat(self.t_max))),
        }
    }

    /// Goes on to the nearest child that is met; false at the end.
    #[inline(always)]
    pub fn go_on(&mut self, node: &Node, met: &Met) -> bool {
        let mut hits = met.hits;
        if hits == 0 {
            return self.go_back();
        }
        if self.waiting.len() < self.left + WIDTH {
            self.waiting.resize(2 * (self.left + WIDTH), 0);
        }
        let entry = |hits: u32| {
            let lane = hits.trailing_zeros() as usize % WIDTH;
            u64::from(met.enter[lane].to_bits()) << 32 | u64::from(node.children[lane].bits())
        };
        let mut nearest = entry(hits);
        hits &= hits - 1;
        let waiting = &mut self.waiting[self.left..][..WIDTH];
        let mut more = 0;
        while hits != 0 {
            let next = entry(hits);
            hits &= hits - 1;
            waiting[more] = nearest.max(next);
            nearest = nearest.min(next);
            // Far ones lie deeper. Without a branch that depends on which is farther.
            for i in (0..more).rev() {
                let [a, b] = [waiting[i], waiting[i + 1]];
                (waiting[i], waiting[i + 1]) = (a.max(b), a.min(b));
            }
            more += 1;
        }
        self.left += more;
        self.current = Child::from_bits(nearest as u32);
        true
    }

    /// Goes on to the nearest of what still waits; false if nothing does.
    #[inline(always)]
    pub fn go_back(&mut self) -> bool {
        while let Some(left) = self.left.checked_sub(1) {
            self.left = left;
            let entry = self.waiting[left];
            if f32::from_bits((entry >> 32) as u32) <= self.t_max {
                self.current = Child::from_bits(entry as u32);
                return true;
            }
        }
        false
    }
}
