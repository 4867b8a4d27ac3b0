//! Which nodes of a binary tree become the children of one wide node.

use obvhs::bvh2::Bvh2;

/// Children of a wide node.
pub(super) const WIDTH: usize = 8;

/// How a binary tree is folded so that the surfaces of its wide nodes are least in sum: about so many of them a ray
/// meets. Found from the leaves up (H. Ylitie, T. Karras, S. Laine, *Efficient incoherent ray traversal on GPUs through
/// compressed wide BVHs*, HPG 2017, section 4.1).
pub(super) struct Folding {
    /// Of each binary node and each number i + 1 of entries that its subtree may take in a wide node: the entries of
    /// its first child, or 0 where the subtree takes one only, as a leaf or a wide node of its own. At i = 0: those of
    /// its first child in that wide node.
    first: Vec<[u8; WIDTH]>,
}

impl Folding {
    /// The best of a tree.
    pub fn new(binary: &Bvh2) -> Self {
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&index) = order.get(next) {
            let node = &binary.nodes[index];
            if !node.is_leaf() {
                let first = node.first_index as usize;
                order.extend([first, first + 1]);
            }
            next += 1;
        }
        let mut cost = vec![[0.0f32; WIDTH]; binary.nodes.len()];
        let mut first = vec![[0; WIDTH]; binary.nodes.len()];
        // Parents stand before their children in `order`.
        for &index in order.iter().rev() {
            let node = &binary.nodes[index];
            if node.is_leaf() {
                continue;
            }
            let child = node.first_index as usize;
            let (left, right) = (cost[child], cost[child + 1]);
            // In two entries or more; one for the first child where surfaces are too large for f32.
            let mut shared = [(f32::INFINITY, 1); WIDTH];
            for entries in 2..=WIDTH {
                shared[entries - 1] = shared[entries - 2];
                for k in 1..entries {
                    let sum = left[k - 1] + right[entries - k - 1];
                    if sum < shared[entries - 1].0 {
                        shared[entries - 1] = (sum, k as u8);
                    }
                }
            }
            let alone = node.aabb().half_area() + shared[WIDTH - 1].0;
            for i in 0..WIDTH {
                let is_alone = alone <= shared[i].0;
                cost[index][i] = if is_alone { alone } else { shared[i].0 };
                first[index][i] = if is_alone { 0 } else { shared[i].1 };
            }
            // As a wide node.
            first[index][0] = shared[WIDTH - 1].1;
        }
        Self { first }
    }

    /// The binary nodes that become the children of the wide node of the binary node `index`.
    pub fn members_of(&self, binary: &Bvh2, index: usize) -> Vec<usize> {
        let mut members = Vec::with_capacity(WIDTH);
        let child = binary.nodes[index].first_index as usize;
        let k = usize::from(self.first[index][0]);
        let mut open = vec![(child + 1, WIDTH - k), (child, k)];
        while let Some((index, entries)) = open.pop() {
            let k = match entries {
                1 => 0,
                _ => usize::from(self.first[index][entries - 1]),
            };
            if k == 0 {
                members.push(index);
            } else {
                let child = binary.nodes[index].first_index as usize;
                open.extend([(child + 1, entries - k), (child, k)]);
            }
        }
        members
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform;
    use glam::Vec3A;
    use obvhs::BvhBuildParams;
    use obvhs::aabb::Aabb;
    use obvhs::bvh2::builder::build_bvh2;

    /// The least sum of surfaces of wide nodes of a subtree that takes so many entries at most: all ways are tried.
    fn least(binary: &Bvh2, index: usize, entries: usize) -> f64 {
        let node = &binary.nodes[index];
        if node.is_leaf() {
            return 0.0;
        }
        let child = node.first_index as usize;
        let shared = |entries: usize| {
            let ways = (1..entries)
                .map(|k| least(binary, child, k) + least(binary, child + 1, entries - k));
            ways.fold(f64::INFINITY, f64::min)
        };
        match entries {
            1 => f64::from(node.aabb().half_area()) + shared(WIDTH),
            _ => shared(entries).min(least(binary, index, 1)),
        }
    }

    /// The sum of the folded tree; `leaves` is raised by its leaves.
    fn folded(binary: &Bvh2, folding: &Folding, index: usize, leaves: &mut usize) -> f64 {
        let node = &binary.nodes[index];
        if node.is_leaf() {
            *leaves += 1;
            return 0.0;
        }
        let members = folding.members_of(binary, index);
        assert!((2..=WIDTH).contains(&members.len()), "{}", members.len());
        let below: f64 = (members.iter())
            .map(|m| folded(binary, folding, *m, leaves))
            .sum();
        f64::from(node.aabb().half_area()) + below
    }

    /// A binary tree of so many boxes, each in a leaf.
    fn binary(seed: u64, boxes: usize, side: f32) -> Bvh2 {
        let u = |k: usize, d: u64| side * uniform(seed, &[k as u64, d]) as f32;
        let point = |k: usize, d: u64| Vec3A::new(u(k, d), u(k, d + 1), u(k, d + 2));
        let boxes: Vec<Aabb> = (0..boxes)
            .map(|k| Aabb::new(point(k, 0), point(k, 0) + 0.4 * point(k, 3)))
            .collect();
        let params = BvhBuildParams {
            max_prims_per_leaf: 1,
            ..BvhBuildParams::medium_build()
        };
        build_bvh2(&boxes, params, &mut std::time::Duration::default())
    }

    #[test]
    fn no_way_of_folding_has_less_surface() {
        for (seed, boxes) in (0..).zip([2, 3, 8, 9, 10, 12, 14, 16]) {
            let binary = binary(seed, boxes, 1.0);
            let mut leaves = 0;
            let sum = folded(&binary, &Folding::new(&binary), 0, &mut leaves);
            let best = least(&binary, 0, 1);
            assert_eq!(leaves, boxes);
            assert!((sum - best).abs() <= 1e-5 * best, "{sum}, not {best}");
        }
    }

    #[test]
    fn surfaces_too_large_for_f32_lose_no_leaf() {
        for boxes in [2, 9, 40, 300] {
            let binary = binary(7, boxes, 1e25);
            let mut leaves = 0;
            folded(&binary, &Folding::new(&binary), 0, &mut leaves);
            assert_eq!(leaves, boxes);
        }
    }
}
