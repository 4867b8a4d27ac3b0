//! Rays on their way through a tree, many at a time.
//!
//! A step of a walk is a chain of dependent operations behind a read that often misses the caches, and ends in branches
//! that nobody can foretell. So walks go in rounds: the triangles of all that are at a leaf are tested, then the boxes
//! of all that are at a node, without branches where there are vectors, so that the processor works at many of them at
//! once. Each then goes on to what it has met, which is known by that time: a branch foretold wrongly costs little.
//! What a walk reads next is asked for a round before. Each walk meets the same nodes and leaves in the same order as
//! it would alone.

use super::bvh::{Bvh, Child, Node};
use super::lanes::{Lanes, Portable};
#[cfg(target_arch = "x86_64")]
use super::lanes::{avx::Avx, avx512::Avx512};
use super::triangles::{PacketHits, WalkRay};
use super::walk_step::Walk;
#[cfg(target_arch = "x86_64")]
use crate::simd::SimdLevel;

/// Rays that go through a tree together. The room that they need is used again and again.
#[derive(Clone, Debug, Default)]
pub(super) struct WalkGroup {
    walks: Vec<Walk>,
    /// Of those that have set out.
    count: usize,
    /// Walks that are at a node, and at a leaf: the first so many of each list.
    at_nodes: Vec<u32>,
    at_leaves: Vec<u32>,
    found: Vec<PacketHits>,
}

/// Room for walks, used again and again.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct Walks {
    pub(super) outer: WalkGroup,
    /// Within an instance's own tree.
    pub(super) inner: WalkGroup,
}

/// What a walk shows at a leaf.
pub(super) struct Visit<'a> {
    /// Of the ray.
    pub number: usize,
    pub ray: &'a WalkRay,
    pub leaf: usize,
    /// Items in the leaf.
    pub items: u32,
    /// Only what is nearer counts; may be lowered.
    pub t_max: &'a mut f32,
}

impl WalkGroup {
    /// Forgets all walks.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// One more ray, to set out from the root.
    #[inline(always)]
    pub fn add(&mut self, number: u32, ray: WalkRay, t_max: f32) {
        if self.count == self.walks.len() {
            self.walks.push(Walk::default());
            self.at_nodes.push(0);
            self.at_leaves.push(0);
            self.found.push(PacketHits::default());
        }
        self.walks[self.count].start(number, ray, t_max);
        self.count += 1;
    }

    /// How far the first ray went, or may still go.
    pub fn first_t_max(&self) -> f32 {
        self.walks.first().map_or(0.0, |w| w.t_max)
    }
}

/// What a tree's leaves stand for.
pub(super) trait Leaves {
    /// What a ray meets of a leaf before `t_max`: it is asked of all rays that are at leaves, one after the other.
    fn test(&self, ray: &WalkRay, t_max: f32, leaf: usize, items: u32) -> PacketHits;

    /// A ray is at a leaf, of which it meets `found`: may lower its `t_max`, and ends its walk by returning true.
    fn visit(&mut self, visit: Visit<'_>, found: &PacketHits) -> bool;

    /// Where the leaves lie, and the size of one, bytes: they are asked for before they are read.
    fn memory(&self) -> (*const u8, usize);
}

impl Bvh {
    /// Visits the leaves that each ray may meet before its `t_max`, about from near to far.
    #[inline(always)]
    pub fn walk_all(&self, group: &mut WalkGroup, leaves: &mut impl Leaves) {
        match self.simd {
            // SAFETY: the level says that the CPU has AVX-512.
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx512 => unsafe { self.walk_all_avx512(group, leaves) },
            // SAFETY: the level says that the CPU has AVX2.
            #[cfg(target_arch = "x86_64")]
            SimdLevel::Avx2 => unsafe { self.walk_all_avx2(group, leaves) },
            _ => self.walk_all_by::<Portable>(group, leaves),
        }
    }

    /// The same vectors as for AVX2, of which there are twice as many, and comparisons in registers of their own: 2 %
    /// faster. Sorting in them: 10 %.
    ///
    /// # Safety
    /// The CPU must have AVX-512 F, DQ and VL, and POPCNT.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f,avx512dq,avx512vl,popcnt")]
    unsafe fn walk_all_avx512(&self, group: &mut WalkGroup, leaves: &mut impl Leaves) {
        self.walk_all_by::<Avx512>(group, leaves);
    }

    /// # Safety
    /// The CPU must have AVX2 and POPCNT.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,popcnt")]
    unsafe fn walk_all_avx2(&self, group: &mut WalkGroup, leaves: &mut impl Leaves) {
        self.walk_all_by::<Avx>(group, leaves);
    }

    #[inline(always)]
    fn walk_all_by<L: Lanes>(&self, group: &mut WalkGroup, leaves: &mut impl Leaves) {
        let Some(root) = self.root else {
            return;
        };
        let count = group.count;
        let walks = &mut group.walks[..count];
        let (at_nodes, at_leaves) = (&mut group.at_nodes[..count], &mut group.at_leaves[..count]);
        let found = &mut group.found[..count];
        walks.iter_mut().for_each(|w| w.current = root);
        (0..).zip(&mut *at_nodes).for_each(|(i, at)| *at = i);
        (0..).zip(&mut *at_leaves).for_each(|(i, at)| *at = i);
        let (mut nodes, mut ends) = match root.is_leaf() {
            true => (0, count),
            false => (count, 0),
        };
        let nodes_base = self.nodes.as_ptr().cast::<u8>();
        let (leaf_base, leaf_size) = leaves.memory();
        let ask_for = |next: Child| {
            let number = next.number() as usize;
            let node = nodes_base.wrapping_add(number * size_of::<Node>());
            let leaf = leaf_base.wrapping_add(number * leaf_size);
            prefetch(if next.is_leaf() { leaf } else { node });
        };
        // Checks of bounds took 4 % of a path. They could not fail: each walk is in one of the lists at most, by its
        // number below `count`; `nodes` and `ends` count what was written.
        while nodes + ends > 0 {
            for (&i, found) in at_leaves[..ends].iter().zip(&mut *found) {
                // SAFETY: see above.
                let walk = unsafe { walks.get_unchecked(i as usize) };
                let (leaf, items) = (walk.current.number() as usize, walk.current.items());
                *found = leaves.test(&walk.ray, walk.t_max, leaf, items);
            }
            for k in 0..std::mem::take(&mut ends) {
                // SAFETY: see above.
                let (i, found) = unsafe { (*at_leaves.get_unchecked(k), found.get_unchecked(k)) };
                // SAFETY: see above.
                let walk = unsafe { walks.get_unchecked_mut(i as usize) };
                let visit = Visit {
                    number: walk.number as usize,
                    ray: &walk.ray,
                    leaf: walk.current.number() as usize,
                    items: walk.current.items(),
                    t_max: &mut walk.t_max,
                };
                let is_ended = found.mask != 0 && leaves.visit(visit, found);
                if !is_ended && walk.go_back() {
                    ask_for(walk.current);
                    // SAFETY: see above; so many were read of both lists that there is room.
                    unsafe {
                        list(
                            i,
                            walk.current,
                            (at_nodes, &mut nodes),
                            (at_leaves, &mut ends),
                        )
                    };
                }
            }
            for &i in &at_nodes[..nodes] {
                // SAFETY: see above.
                let walk = unsafe { walks.get_unchecked_mut(i as usize) };
                walk.open::<L>(self.node(walk.current));
            }
            for k in 0..std::mem::take(&mut nodes) {
                // SAFETY: see above.
                let i = unsafe { *at_nodes.get_unchecked(k) };
                // SAFETY: see above.
                let walk = unsafe { walks.get_unchecked_mut(i as usize) };
                if walk.go_back() {
                    ask_for(walk.current);
                    // SAFETY: see above; so many were read of both lists that there is room.
                    unsafe {
                        list(
                            i,
                            walk.current,
                            (at_nodes, &mut nodes),
                            (at_leaves, &mut ends),
                        )
                    };
                }
            }
        }
    }
}

/// Writes walk `i` to the list of those at nodes or at leaves, by what it is at, without a branch.
///
/// # Safety
/// Both lists are longer than the numbers of walks in them.
#[inline(always)]
unsafe fn list(
    i: u32,
    at: Child,
    (at_nodes, nodes): (&mut [u32], &mut usize),
    (at_leaves, ends): (&mut [u32], &mut usize),
) {
    // SAFETY: as the caller says.
    unsafe {
        *at_nodes.get_unchecked_mut(*nodes) = i;
        *at_leaves.get_unchecked_mut(*ends) = i;
    }
    let is_leaf = usize::from(at.is_leaf());
    *nodes += 1 - is_leaf;
    *ends += is_leaf;
}

/// Asks for the four cache lines from an address on, wherever that is.
#[inline(always)]
fn prefetch(address: *const u8) {
    #[cfg(target_arch = "x86_64")]
    for line in 0..4 {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch reads nothing that could be seen, and no address makes it fail.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64 * line).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}
