//! What lies where an equal one does: no ray sees it, and each that comes there would try all of them.

use std::hash::{DefaultHasher, Hash, Hasher};

/// So many in one place cost a ray little.
const FEW: usize = 1024;

/// Drops items whose key an earlier one has, if there are more than a few items; how many.
pub(super) fn drop_repeated<T, K: Eq + Hash>(items: &mut Vec<T>, key: impl Fn(&T) -> K) -> usize {
    if items.len() <= FEW {
        return 0;
    }
    let hash = |item: &T| {
        let mut hasher = DefaultHasher::new();
        key(item).hash(&mut hasher);
        hasher.finish()
    };
    let mut places: Vec<(u64, u32)> = items.iter().map(hash).zip(0..).collect();
    places.sort_unstable();
    let mut is_repeated = vec![false; items.len()];
    for equal in places
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|run| run.len() > 1)
    {
        let first = key(&items[equal[0].1 as usize]);
        for (_, number) in &equal[1..] {
            let number = *number as usize;
            is_repeated[number] = key(&items[number]) == first;
        }
    }
    let before = items.len();
    let mut is_repeated = is_repeated.into_iter();
    items.retain(|_| is_repeated.next() != Some(true));
    before - items.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_equal_ones_stays_in_its_place() {
        let mut items: Vec<(usize, usize)> = (0..3000).map(|k| (k % 1000, k)).collect();
        assert_eq!(drop_repeated(&mut items, |item| item.0), 2000);
        assert!(items.into_iter().eq((0..1000).map(|k| (k, k))));
        let mut few = vec![7; FEW];
        assert_eq!(drop_repeated(&mut few, |item| *item), 0);
    }
}
