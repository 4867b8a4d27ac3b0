//! A bounding volume hierarchy with four children a node, and the walk of a ray through it.
//!
//! The tree is built by `obvhs` (PLOC with reinsertion: D. Meister, J. Bittner, TVCG 24(3) (2018) and CGF 37 (2018)) as a binary one and then
//! folded to four children, which one vector instruction tests together. The walk is ours, because rays of this program need
//! boxes that never miss, transformed instances, and triangles without holes ([`super::triangles`]).

use glam::{Vec3, Vec3A, Vec4};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use super::triangles::WalkRay;

/// Items in a leaf, at most: the lanes of a packet.
pub(super) const LEAF_ITEMS: usize = 4;

/// Rounding of the six products and differences of a box test, with room (T. Ize, JCGT 2(2), 12 (2013)).
const FAR_FACTOR: f32 = 1.000_000_5;

/// A child: a node's number, or with the top bit a leaf: its number below, its count of items − 1 in bits 29 and 30.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Child(u32);

impl Child {
    fn leaf(number: u32, items: u32) -> Self {
        Self(1 << 31 | (items - 1) << 29 | number)
    }
}

/// Boxes of four children as columns: least x, greatest x, least y, …; a child that is not there has an inverted box.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Node {
    bounds: [Vec4; 6],
    children: [Child; 4],
}

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct Bvh {
    nodes: Vec<Node>,
    root: Option<Child>,
}

/// What is still to be visited: entry distance and child.
#[derive(Clone, Debug, Default)]
pub(in crate::scene) struct Stack(Vec<(f32, Child)>);

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

    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
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

impl Bvh {
    /// A tree over boxes, which are widened by what rounding may move the edges of what is in them. `leaf` hears of the items of each leaf (1
    /// to [`LEAF_ITEMS`] of them) in the order of the leaves' numbers. At most 2²⁹ items.
    pub fn build(boxes: &[Bounds], mut leaf: impl FnMut(&[u32])) -> Self {
        if boxes.is_empty() {
            return Self {
                nodes: Vec::new(),
                root: None,
            };
        }
        let all = boxes.iter().fold(Bounds::EMPTY, |a, b| a.union(*b));
        let pad = Vec3::splat(all.reach() * 4.0 * f32::EPSILON);
        let boxes: Vec<Aabb> = boxes
            .iter()
            .map(|b| Aabb::new(Vec3A::from(b.least - pad), Vec3A::from(b.greatest + pad)))
            .collect();
        let params = BvhBuildParams {
            max_prims_per_leaf: LEAF_ITEMS as u32,
            collapse_traversal_cost: std::env::var("CTC").map_or(3.0, |v| v.parse().unwrap()),
            reinsertion_batch_ratio: std::env::var("RBR").map_or(0.05, |v| v.parse().unwrap()),
            ..BvhBuildParams::medium_build()
        };
        let binary = build_bvh2(&boxes, params, &mut std::time::Duration::default());
        let mut folded = Self {
            nodes: Vec::with_capacity(binary.nodes.len() / 3 + 1),
            root: None,
        };
        let mut leaves = 0;
        folded.root = Some(folded.fold(&binary, 0, &mut leaves, &mut leaf));
        folded
    }

    /// Folds the binary subtree of node `index`, without recursion, and returns its child entry.
    fn fold(
        &mut self,
        binary: &Bvh2,
        index: usize,
        leaves: &mut u32,
        leaf: &mut impl FnMut(&[u32]),
    ) -> Child {
        // (binary node, the entry to fill in: node and lane)
        let mut open = vec![(index, None::<(usize, usize)>)];
        let mut root = Child(0);
        while let Some((index, place)) = open.pop() {
            let node = &binary.nodes[index];
            let child = if node.is_leaf() {
                let first = node.first_index as usize;
                leaf(&binary.primitive_indices[first..first + node.prim_count as usize]);
                *leaves += 1;
                Child::leaf(*leaves - 1, node.prim_count)
            } else {
                let members = four_of(binary, node.first_index as usize);
                let number = self.nodes.len();
                self.nodes.push(boxes_of(binary, &members));
                let entries = members.iter().enumerate();
                open.extend(entries.map(|(lane, &m)| (m, Some((number, lane)))));
                Child(number as u32)
            };
            match place {
                Some((parent, lane)) => self.nodes[parent].children[lane] = child,
                None => root = child,
            }
        }
        root
    }

    /// Visits the leaves that the ray may meet before `t_max`, about from near to far: `leaf(number, items, t_max)` may lower `t_max` and
    /// ends the walk by returning true.
    #[inline(always)]
    pub fn walk(
        &self,
        ray: &WalkRay,
        t_max: &mut f32,
        stack: &mut Stack,
        mut leaf: impl FnMut(u32, u32, &mut f32, &mut Stack) -> bool,
    ) {
        let Some(mut current) = self.root else {
            return;
        };
        let base = stack.0.len();
        let (o, inv) = (ray.origin, ray.inverse);
        let origin = [Vec4::splat(o.x), Vec4::splat(o.y), Vec4::splat(o.z)];
        let inverse = [Vec4::splat(inv.x), Vec4::splat(inv.y), Vec4::splat(inv.z)];
        // Bounds of an axis that a ray meets first: the least if it runs up.
        let near = [
            usize::from(inv.x.is_sign_negative()),
            2 + usize::from(inv.y.is_sign_negative()),
            4 + usize::from(inv.z.is_sign_negative()),
        ];
        loop {
            if current.0 >> 31 == 1 {
                let number = current.0 & ((1 << 29) - 1);
                if leaf(number, (current.0 >> 29 & 3) + 1, t_max, stack) {
                    stack.0.truncate(base);
                    return;
                }
            } else {
                let node = &self.nodes[current.0 as usize];
                let slab =
                    |axis: usize, bound: usize| (node.bounds[bound] - origin[axis]) * inverse[axis];
                let enter = slab(0, near[0])
                    .max(slab(1, near[1]))
                    .max(slab(2, near[2]).max(Vec4::ZERO));
                let leave = slab(0, near[0] ^ 1)
                    .min(slab(1, near[1] ^ 1))
                    .min(slab(2, near[2] ^ 1))
                    * FAR_FACTOR;
                let mut hits = enter.cmple(leave.min(Vec4::splat(*t_max))).bitmask();
                if hits != 0 {
                    let enter = enter.to_array();
                    let first = hits.trailing_zeros() as usize;
                    hits &= hits - 1;
                    current = node.children[first];
                    if hits != 0 {
                        let mut nearest = enter[first];
                        let pushed = stack.0.len();
                        while hits != 0 {
                            let lane = hits.trailing_zeros() as usize;
                            hits &= hits - 1;
                            let mut entry = (enter[lane], node.children[lane]);
                            if entry.0 < nearest {
                                std::mem::swap(&mut entry.0, &mut nearest);
                                std::mem::swap(&mut entry.1, &mut current);
                            }
                            // Far ones lie deeper.
                            stack.0.push(entry);
                            let mut i = stack.0.len() - 1;
                            while i > pushed && stack.0[i - 1].0 < stack.0[i].0 {
                                stack.0.swap(i - 1, i);
                                i -= 1;
                            }
                        }
                    }
                    continue;
                }
            }
            loop {
                if stack.0.len() == base {
                    return;
                }
                let Some((enter, child)) = stack.0.pop() else {
                    return;
                };
                if enter <= *t_max {
                    current = child;
                    break;
                }
            }
        }
    }
}

/// Up to four descendants of the pair at `first` in the binary tree: the inner one of the largest surface is opened again and again.
fn four_of(binary: &Bvh2, first: usize) -> Vec<usize> {
    let mut members = vec![first, first + 1];
    while members.len() < 4 {
        let inner = members
            .iter()
            .enumerate()
            .filter(|(_, m)| !binary.nodes[**m].is_leaf());
        let area = |m: usize| binary.nodes[m].aabb().half_area();
        let Some((place, &largest)) = inner.max_by(|a, b| area(*a.1).total_cmp(&area(*b.1))) else {
            break;
        };
        let child = binary.nodes[largest].first_index as usize;
        members[place] = child;
        members.push(child + 1);
    }
    members
}

fn boxes_of(binary: &Bvh2, members: &[usize]) -> Node {
    let side = |pick: &dyn Fn(&Aabb) -> f32, absent: f32| {
        Vec4::from_array(std::array::from_fn(|lane| {
            members
                .get(lane)
                .map_or(absent, |&m| pick(binary.nodes[m].aabb()))
        }))
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
        children: [Child(0); 4],
    }
}
