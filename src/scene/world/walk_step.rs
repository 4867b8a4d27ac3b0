//! One ray's way through a tree, step by step.

use super::bvh::{Child, Node};
use super::fold::WIDTH;
use super::lanes::Lanes;
use super::triangles::WalkRay;

/// Rounding of the six products and differences of a box test, with room (T. Ize, JCGT 2(2), 12 (2013)).
const FAR_FACTOR: f32 = 1.000_000_5;

/// From the one bound of an axis to the other, in bytes.
const OTHER: usize = size_of::<[f32; WIDTH]>();

/// A ray on its way.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    pub ray: WalkRay,
    /// Where a node's bounds of each axis lie that the ray meets first, in bytes: the least if it runs up.
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

impl Walk {
    /// Sets out.
    #[inline(always)]
    pub fn start(&mut self, number: u32, ray: WalkRay, t_max: f32) {
        let first = |axis: usize, inverse: f32| {
            OTHER * (2 * axis + usize::from(inverse.is_sign_negative()))
        };
        let inverse = ray.inverse;
        self.near = [
            first(0, inverse.x),
            first(1, inverse.y),
            first(2, inverse.z),
        ];
        self.ray = ray;
        self.t_max = t_max;
        self.number = number;
        self.left = 0;
    }

    /// What is met of a node waits from now on, the nearest on top.
    #[inline(always)]
    pub fn open<L: Lanes>(&mut self, node: &Node) {
        let (o, inv) = (self.ray.origin, self.ray.inverse);
        let origin = [L::splat(o.x), L::splat(o.y), L::splat(o.z)];
        let inverse = [L::splat(inv.x), L::splat(inv.y), L::splat(inv.z)];
        let near = self.near;
        let slab = |axis: usize, place: usize| {
            // SAFETY: `start` makes the places of bounds 0 or 1, 2 or 3, 4 or 5, in bytes; the other of a pair is
            // one list of bounds away.
            let bound = unsafe { &*node.bounds.as_ptr().byte_add(place) };
            L::load(bound).minus(origin[axis]).times(inverse[axis])
        };
        let enter = slab(0, near[0])
            .greatest(slab(1, near[1]))
            .greatest(slab(2, near[2]).greatest(L::splat(0.0)));
        let leave = slab(0, near[0] ^ OTHER)
            .least(slab(1, near[1] ^ OTHER))
            .least(slab(2, near[2] ^ OTHER))
            .times(L::splat(FAR_FACTOR));
        let hits = enter.at_most(leave.least(L::splat(self.t_max)));
        if self.waiting.len() < self.left + WIDTH {
            self.waiting.resize(2 * (self.left + WIDTH), 0);
        }
        if let Some(room) = self.waiting[self.left..].first_chunk_mut() {
            self.left += enter.push(hits, &node.children, room);
        }
    }

    /// Goes on to the nearest of what still waits; false if nothing does.
    #[inline(always)]
    pub fn go_back(&mut self) -> bool {
        while let Some(left) = self.left.checked_sub(1) {
            self.left = left;
            // SAFETY: what waits is `left` entries at most: see `open`.
            let entry = unsafe { *self.waiting.get_unchecked(left) };
            if f32::from_bits((entry >> 32) as u32) <= self.t_max {
                self.current = Child::from_bits(entry as u32);
                return true;
            }
        }
        false
    }
}
