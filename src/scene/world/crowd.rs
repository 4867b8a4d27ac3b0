//! Boxes that lie in one another: equal triangles, instances in one place, fans of growing triangles.
//!
//! Parallel locally-ordered clustering joins boxes that are each other's nearest. In a crowd all are nearest to the
//! same few, so that a pass joins one pair and n boxes take n passes. So crowds are cut along the Morton curve (G. M.
//! Morton, IBM (1966)) into groups, each a tree of its own under a tree of groups: n passes become those of a group.

use glam::Vec3A;
use obvhs::aabb::Aabb;

/// Boxes of a group, at most.
pub(super) const GROUP: usize = 64;
/// Neighbours along the curve that are looked at, and how many of them make a crowd: the two triangles of a flat square
/// have one box.
const NEIGHBOURS: usize = 8;
const CLOSE: usize = 4;
/// Boxes in one another that a plain tree still takes in its stride.
const FEW: usize = 1024;
/// Bits of the curve per axis.
const BITS: u32 = 10;

/// The boxes' numbers along the Morton curve of their middles if more than a few lie in one another; else `None`.
pub(super) fn crowded(boxes: &[Aabb]) -> Option<Vec<u32>> {
    if boxes.len() <= FEW {
        return None;
    }
    let order = along_curve(boxes);
    let is_within = |a: &Aabb, b: &Aabb| a.min.cmpge(b.min).all() && a.max.cmple(b.max).all();
    let is_crowded = |place: usize| {
        let own = &boxes[order[place] as usize];
        let next = order[place + 1..].iter().take(NEIGHBOURS);
        next.map(|&k| &boxes[k as usize])
            .filter(|other| is_within(own, other) || is_within(other, own))
            .count()
            >= CLOSE
    };
    let nested = (0..order.len()).filter(|&place| is_crowded(place)).count();
    (nested > FEW).then_some(order)
}

/// The boxes' numbers along the curve, equal places by number.
fn along_curve(boxes: &[Aabb]) -> Vec<u32> {
    let middle = |b: &Aabb| 0.5 * b.min + 0.5 * b.max;
    let (mut least, mut greatest) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for b in boxes {
        least = least.min(middle(b));
        greatest = greatest.max(middle(b));
    }
    let cells = ((1u32 << BITS) - 1) as f32;
    let scale = cells / (greatest - least).max(Vec3A::splat(f32::MIN_POSITIVE));
    let code = |b: &Aabb| {
        let cell = ((middle(b) - least) * scale).min(Vec3A::splat(cells));
        spread(cell.x as u32) << 2 | spread(cell.y as u32) << 1 | spread(cell.z as u32)
    };
    let mut keys: Vec<(u32, u32)> = boxes.iter().map(code).zip(0..).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, number)| number).collect()
}

/// The ten lowest bits, two zeros between each.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(middle: Vec3A, half: f32) -> Aabb {
        Aabb::new(middle - half, middle + half)
    }

    #[test]
    fn bits_are_spread_three_apart() {
        for x in [0, 1, 2, 3, 513, 1023] {
            let wanted = (0..BITS).map(|k| (x >> k & 1) << (3 * k)).sum::<u32>();
            assert_eq!(spread(x), wanted);
        }
    }

    #[test]
    fn crowds_are_found_and_heaps_of_small_boxes_are_none() {
        const N: usize = 3000;
        let size = |k: usize| (k + 1) as f32 / N as f32;
        let equal = vec![cube(Vec3A::ZERO, 1.0); N];
        let nested: Vec<_> = (0..N).map(|k| cube(Vec3A::ZERO, size(k))).collect();
        let fan: Vec<_> = (0..N)
            .map(|k| cube(Vec3A::splat(size(k)), size(k)))
            .collect();
        for boxes in [&equal, &nested, &fan] {
            let mut order = crowded(boxes).expect("a crowd");
            order.sort_unstable();
            assert!(order.into_iter().eq(0..N as u32));
        }
        let place = |k: usize| Vec3A::new((k % 15) as f32, (k / 15 % 15) as f32, (k / 225) as f32);
        // Two triangles of a square have one box.
        let heap: Vec<_> = (0..N).map(|k| cube(place(k / 2), 0.4)).collect();
        assert!(crowded(&heap).is_none());
    }
}
