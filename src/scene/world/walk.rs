//! Rays on their way through a tree, many at a time.
//!
//! A step of a walk is a chain of dependent operations behind a read that often misses the caches; a processor has room
//! for several such chains. So walks take a step each in turn, and what a walk reads next is asked for a round before.
//! Each meets the same nodes and leaves in the same order as it would alone.

use super::bvh::{Bvh, Child};
#[cfg(target_arch = "x86_64")]
use super::lanes::avx::Avx;
use super::lanes::{Lanes, Portable};
use super::triangles::WalkRay;
#[cfg(target_arch = "x86_64")]
use crate::simd::SimdLevel;

/// Rounding of the six products and differences of a box test, with room (T. Ize, JCGT 2(2), 12 (2013)).
const FAR_FACTOR: f32 = 1.000_000_5;

/// A ray on its way.
#[derive(Clone, Debug, Default)]
pub(super) struct Walk {
    ray: WalkRay,
    /// Bounds of each axis that the ray meets first: the least if it runs up.
    near: [usize; 3],
    /// Only what is nearer counts; leaves may lower it.
    pub t_max: f32,
    /// The caller's number of the ray.
    number: u32,
    current: Child,
    /// What is still to be visited: entry distance and child.
    waiting: Vec<(f32, Child)>,
}

/// Room for walks, used again and again.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct Walks {
    pub(super) outer: Vec<Walk>,
    /// Within an instance's own tree.
    pub(super) inner: Walk,
}

/// What a walk shows at a leaf.
pub(super) struct Visit<'a> {
    /// Of the ray.
    pub number: usize,
    pub ray: &'a WalkRay,
    pub leaf: usize,
    /// Items in the leaf.
    pub items: u32,
    /// See [`Walk::t_max`].
    pub t_max: &'a mut f32,
}

impl Walk {
    /// Sets out from the root.
    #[inline]
    pub fn start(&mut self, number: u32, ray: WalkRay, t_max: f32) {
        self.near = [
            usize::from(ray.inverse.x.is_sign_negative()),
            2 + usize::from(ray.inverse.y.is_sign_negative()),
            4 + usize::from(ray.inverse.z.is_sign_negative()),
        ];
        self.ray = ray;
        self.t_max = t_max;
        self.number = number;
        self.waiting.clear();
    }
}

impl Bvh {
    /// Visits the leaves that each ray may meet before its `t_max`, about from near to far: `leaf` may lower it and
    /// ends that ray's walk by returning true; `expect(leaf)` hears of a leaf that will be visited soon. The walks'
    /// order in the list changes.
    #[inline(always)]
    pub fn walk_all(
        &self,
        walks: &mut [Walk],
        leaf: impl FnMut(Visit<'_>) -> bool,
        expect: impl Fn(usize),
    ) {
        #[cfg(target_arch = "x86_64")]
        if self.simd >= SimdLevel::Avx2 {
            // SAFETY: the level says that the CPU has AVX2.
            unsafe { self.walk_all_avx2(walks, leaf, expect) };
            return;
        }
        self.walk_all_by::<Portable>(walks, leaf, expect);
    }

    /// # Safety
    /// The CPU must have AVX2.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn walk_all_avx2(
        &self,
        walks: &mut [Walk],
        leaf: impl FnMut(Visit<'_>) -> bool,
        expect: impl Fn(usize),
    ) {
        self.walk_all_by::<Avx>(walks, leaf, expect);
    }

    #[inline(always)]
    fn walk_all_by<L: Lanes>(
        &self,
        walks: &mut [Walk],
        mut leaf: impl FnMut(Visit<'_>) -> bool,
        expect: impl Fn(usize),
    ) {
        let Some(root) = self.root else {
            return;
        };
        walks.iter_mut().for_each(|w| w.current = root);
        let mut open = walks.len();
        while open > 0 {
            let mut i = 0;
            while i < open {
                if self.step::<L>(&mut walks[i], &mut leaf) {
                    open -= 1;
                    walks.swap(i, open);
                    continue;
                }
                let next = walks[i].current;
                if next.is_leaf() {
                    expect(next.number() as usize);
                } else if let Some(node) = self.nodes.get(next.number() as usize) {
                    prefetch(node);
                }
                i += 1;
            }
        }
    }

    /// Tests the children of a node, or visits a leaf, and goes on to the nearest child that is left. True at the end.
    #[inline(always)]
    fn step<L: Lanes>(&self, walk: &mut Walk, leaf: &mut impl FnMut(Visit<'_>) -> bool) -> bool {
        let current = walk.current;
        if current.is_leaf() {
            let visit = Visit {
                number: walk.number as usize,
                ray: &walk.ray,
                leaf: current.number() as usize,
                items: current.items(),
                t_max: &mut walk.t_max,
            };
            if leaf(visit) {
                return true;
            }
        } else {
            let node = &self.nodes[current.number() as usize];
            let (o, inv) = (walk.ray.origin, walk.ray.inverse);
            let origin = [L::splat(o.x), L::splat(o.y), L::splat(o.z)];
            let inverse = [L::splat(inv.x), L::splat(inv.y), L::splat(inv.z)];
            let near = walk.near;
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
            let mut hits = enter.at_most(leave.least(L::splat(walk.t_max)));
            if hits != 0 {
                let first = hits.trailing_zeros() as usize;
                hits &= hits - 1;
                walk.current = node.children[first];
                if hits == 0 {
                    return false;
                }
                let enter = enter.store();
                let mut nearest = enter[first];
                let waiting = &mut walk.waiting;
                let kept = waiting.len();
                while hits != 0 {
                    let lane = hits.trailing_zeros() as usize;
                    hits &= hits - 1;
                    let mut entry = (enter[lane], node.children[lane]);
                    if entry.0 < nearest {
                        std::mem::swap(&mut entry.0, &mut nearest);
                        std::mem::swap(&mut entry.1, &mut walk.current);
                    }
                    // Far ones lie deeper.
                    waiting.push(entry);
                    let mut i = waiting.len() - 1;
                    while i > kept && waiting[i - 1].0 < waiting[i].0 {
                        waiting.swap(i - 1, i);
                        i -= 1;
                    }
                }
                return false;
            }
        }
        while let Some((enter, child)) = walk.waiting.pop() {
            if enter <= walk.t_max {
                walk.current = child;
                return false;
            }
        }
        true
    }
}

/// Asks for an item that will be read soon: a walk waits for memory more than for anything else.
#[inline(always)]
pub(super) fn prefetch<T>(item: &T) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..size_of::<T>()).step_by(64) {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: the address lies within the item, and a prefetch reads nothing that could be seen.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(item).cast::<i8>().add(line)) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = item;
}
