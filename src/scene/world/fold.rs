//! Which nodes of a binary tree become the children of one wide node.

use obvhs::bvh2::Bvh2;

/// Children of a wide node.
pub(super) const WIDTH: usize = 8;

/// Leaves under each node of a binary tree.
pub(super) fn leaf_counts(binary: &Bvh2) -> Vec<u32> {
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
    // Parents stand before their children in `order`.
    let mut counts = vec![1; binary.nodes.len()];
    for &index in order.iter().rev() {
        let node = &binary.nodes[index];
        if !node.is_leaf() {
            let first = node.first_index as usize;
            counts[index] = counts[first] + counts[first + 1];
        }
    }
    counts
}

/// Up to [`WIDTH`] descendants of the pair at `first`. The one of the largest surface is opened again and again; but a
/// subtree that fits into a node of its own is opened only if all its leaves find room, so that the lowest nodes are
/// not left half empty.
pub(super) fn members_of(binary: &Bvh2, counts: &[u32], first: usize) -> Vec<usize> {
    let mut members = vec![first, first + 1];
    while members.len() < WIDTH {
        let room = (WIDTH - members.len()) as u32;
        let is_opened = |m: usize| {
            !binary.nodes[m].is_leaf() && (counts[m] > WIDTH as u32 || counts[m] - 1 <= room)
        };
        let area = |m: usize| binary.nodes[m].aabb().half_area();
        let candidates = members.iter().enumerate().filter(|(_, m)| is_opened(**m));
        let largest = candidates.max_by(|a, b| area(*a.1).total_cmp(&area(*b.1)));
        let Some((place, &largest)) = largest else {
            break;
        };
        let child = binary.nodes[largest].first_index as usize;
        members[place] = child;
        members.push(child + 1);
    }
    members
}
