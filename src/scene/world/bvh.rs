//! A bounding volume hierarchy with eight children a node.
//!
//! The tree is built by `obvhs` (PLOC with reinsertion: D. Meister, J. Bittner, TVCG 24(3) (2018) and CGF 37 (2018)) as
//! a binary one and then folded to eight children, which are tested together. The walk ([`super::walk`]) is ours,
//! because rays of this program need boxes that never miss, transformed instances, and triangles without holes
//! ([`super::triangles`]).

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::crowd::{GROUP, crowded};
use super::fold::{Folding, WIDTH};
use super::pages::on_large_pages;
use crate::simd::SimdLevel;

/// Items in a leaf, at most: the lanes of a packet.
pub(super) const LEAF_ITEMS: usize = 4;

/// Share of the nodes that are looked at for a better place in the first of two passes; in the second it is twice that.
/// Of 1: rays meet 3 % fewer nodes than of 0.05, and building takes five times as long.
const REINSERTED: f32 = 0.2;

/// A child: a node's number, or with the top bit a leaf: its number below, its count of items − 1 in bits 29 and 30.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Child(u32);

impl Child {
    fn leaf(number: u32, items: u32) -> Self {
        Self(1 << 31 | (items - 1) << 29 | number)
    }

    #[inline(always)]
    pub fn bits(self) -> u32 {
        self.0
    }

    #[inline(always)]
    pub fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 >> 31 == 1
    }

    /// Of a node or a leaf.
    #[inline(always)]
    pub fn number(self) -> u32 {
        self.0 & ((1 << 29) - 1)
    }

    /// Of a leaf.
    #[inline(always)]
    pub fn items(self) -> u32 {
        (self.0 >> 29 & 3) + 1
    }
}

/// Boxes of eight children as columns: least x, greatest x, least y, …; a child that is not there has an inverted box.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub bounds: [[f32; WIDTH]; 6],
    /// Bits of each [`Child`].
    pub children: [u32; WIDTH],
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Bvh {
    pub(super) nodes: Vec<Node>,
    pub(super) root: Option<Child>,
    pub(super) simd: SimdLevel,
}

/// An axis-aligned box; empty if inverted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub least: Vec3,
    pub greatest: Vec3,
}

impl Bounds {
    pub const EMPTY: Self = Self {
        least: Vec3::INFINITY,
        greatest: Vec3::NEG_INFINITY,
    };

    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    pub fn with(self, p: Vec3) -> Self {
        Self {
            least: self.least.min(p),
            greatest: self.greatest.max(p),
        }
    }

    pub fn union(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            greatest: self.greatest.max(other.greatest),
        }
    }

    /// The largest coordinate, by size.
    pub fn reach(&self) -> f32 {
        self.least.abs().max(self.greatest.abs()).max_element()
    }
}

#[cfg(test)]
impl Bvh {
    pub fn set_simd(&mut self, simd: SimdLevel) {
        self.simd = simd;
    }
}

impl Bvh {
    /// A tree over boxes, which are widened by what rounding may move the edges of what is in them, wherever rays begin
    /// among them. `leaf` hears of the items of each leaf (1 to [`LEAF_ITEMS`] of them) in the order of the leaves'
    /// numbers. At most 2²⁹ items.
    pub fn build(boxes: &[Bounds], leaf: impl FnMut(&[u32])) -> Self {
        let all = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(*b));
        let reach = all.reach();
        Self::build_within(boxes, |_| reach, leaf)
    }

    /// The same, each box widened by what `reach` (of its coordinates, and of those where rays begin) asks for.
    pub fn build_within(
        boxes: &[Bounds],
        reach: impl Fn(&Bounds) -> f32,
        mut leaf: impl FnMut(&[u32]),
    ) -> Self {
        if boxes.is_empty() {
            return Self {
                nodes: Vec::new(),
                root: None,
                simd: SimdLevel::detect(),
            };
        }
        let widened = |b: &Bounds| {
            let pad = Vec3A::splat(reach(b) * 4.0 * f32::EPSILON);
            Aabb::new(Vec3A::from(b.least) - pad, Vec3A::from(b.greatest) + pad)
        };
        let boxes: Vec<Aabb> = boxes.iter().map(widened).collect();
        let mut leaves = 0;
        let mut close = |items: &[u32]| {
            leaf(items);
            leaves += 1;
            Child::leaf(leaves - 1, items.len() as u32)
        };
        let mut tree = Self {
            nodes: on_large_pages(Vec::with_capacity(boxes.len() / 7 + 1)),
            root: None,
            simd: SimdLevel::detect(),
        };
        tree.root = Some(match crowded(&boxes) {
            None => tree.grow(&boxes, LEAF_ITEMS, &mut close),
            Some(order) => tree.grow_groups(&boxes, &order, &mut close),
        });
        tree
    }

    /// The node of a child that is one: of this tree's root, or of a node of it that a ray meets.
    #[inline(always)]
    pub(super) fn node(&self, child: Child) -> &Node {
        debug_assert!(!child.is_leaf() && (child.number() as usize) < self.nodes.len());
        // SAFETY: `fold` gives a child that is a node the number that the node is about to have, and nodes are never
        // taken away. A child that is not there has the number of the first node, and no ray meets it.
        unsafe { self.nodes.get_unchecked(child.number() as usize) }
    }

    /// Adds a tree over boxes and returns its root's entry; `close` makes the entry of a leaf of at most `leaf_items`.
    fn grow(
        &mut self,
        boxes: &[Aabb],
        leaf_items: usize,
        close: &mut dyn FnMut(&[u32]) -> Child,
    ) -> Child {
        let params = BvhBuildParams {
            max_prims_per_leaf: leaf_items as u32,
            reinsertion_batch_ratio: REINSERTED,
            ..BvhBuildParams::medium_build()
        };
        let binary = build_bvh2(boxes, params, &mut std::time::Duration::default());
        self.fold(&binary, close)
    }

    /// The same of a crowd, in groups along `order`, then groups of groups.
    fn grow_groups(
        &mut self,
        boxes: &[Aabb],
        order: &[u32],
        close: &mut dyn FnMut(&[u32]) -> Child,
    ) -> Child {
        let union = |boxes: &[Aabb]| boxes.iter().fold(Aabb::empty(), |all, b| all.union(b));
        let mut group = |numbers: &[u32]| {
            let boxes: Vec<Aabb> = numbers.iter().map(|&k| boxes[k as usize]).collect();
            let mut close = |items: &[u32]| {
                let numbers: Vec<u32> = items.iter().map(|&k| numbers[k as usize]).collect();
                close(&numbers)
            };
            let child = self.grow(&boxes, LEAF_ITEMS, &mut close);
            (union(&boxes), child)
        };
        let mut groups: Vec<(Aabb, Child)> = order.chunks(GROUP).map(&mut group).collect();
        while groups.len() > 1 {
            let above = |groups: &[(Aabb, Child)]| {
                let boxes: Vec<Aabb> = groups.iter().map(|g| g.0).collect();
                let child = self.grow(&boxes, 1, &mut |items| groups[items[0] as usize].1);
                (union(&boxes), child)
            };
            groups = groups.chunks(GROUP).map(above).collect();
        }
        groups[0].1
    }

    /// Folds the binary tree, without recursion, and returns its root's entry.
    fn fold(&mut self, binary: &Bvh2, close: &mut dyn FnMut(&[u32]) -> Child) -> Child {
        let folding = Folding::new(binary);
        // (binary node, the entry to fill in: node and lane)
        let mut open = vec![(0, None::<(usize, usize)>)];
        let mut root = Child(0);
        while let Some((index, place)) = open.pop() {
            let node = &binary.nodes[index];
            let child = if node.is_leaf() {
                let first = node.first_index as usize;
                close(&binary.primitive_indices[first..first + node.prim_count as usize])
            } else {
                let members = folding.members_of(binary, index);
                let number = self.nodes.len();
                self.nodes.push(boxes_of(binary, &members));
                let entries = members.iter().enumerate();
                open.extend(entries.map(|(lane, &m)| (m, Some((number, lane)))));
                Child(number as u32)
            };
            match place {
                Some((parent, lane)) => self.nodes[parent].children[lane] = child.bits(),
                None => root = child,
            }
        }
        root
    }
}

fn boxes_of(binary: &Bvh2, members: &[usize]) -> Node {
    let side = |pick: &dyn Fn(&Aabb) -> f32, absent: f32| {
        std::array::from_fn(|lane| {
            members
                .get(lane)
                .map_or(absent, |&m| pick(binary.nodes[m].aabb()))
        })
    };
    let (up, down) = (f32::INFINITY, f32::NEG_INFINITY);
    Node {
        bounds: [
            side(&|b| b.min.x, up),
            side(&|b| b.max.x, down),
            side(&|b| b.min.y, up),
            side(&|b| b.max.y, down),
            side(&|b| b.min.z, up),
            side(&|b| b.max.z, down),
        ],
        children: [0; WIDTH],
    }
}
