//! Train, val and test by scene: frames of one scene never part.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A split of the dataset.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Split {
    /// 8 scenes in 10.
    Train,
    /// 1 scene in 10.
    Val,
    /// 1 scene in 10.
    Test,
}

impl Split {
    /// All three, in order.
    pub const ALL: [Split; 3] = [Split::Train, Split::Val, Split::Test];

    /// Its name in paths.
    pub fn name(self) -> &'static str {
        match self {
            Split::Train => "train",
            Split::Val => "val",
            Split::Test => "test",
        }
    }
}

/// The split of a scene: BLAKE3, keyed with a fixed context, of its id, modulo 10; 0 to 7 train, 8 val, 9 test. It
/// depends on nothing else, so a scene stays where it is when a dataset grows or is merged with another.
pub fn split_of_scene(scene: &str) -> Split {
    match scene_hash(scene) % 10 {
        0..=7 => Split::Train,
        8 => Split::Val,
        _ => Split::Test,
    }
}

/// The splits of a whole dataset's scenes: [`split_of_scene`], but a dataset so small that no scene falls into train
/// puts the one of the least hash there.
pub fn split_scenes<'a>(scenes: impl IntoIterator<Item = &'a str>) -> BTreeMap<String, Split> {
    let scenes: BTreeSet<&str> = scenes.into_iter().collect();
    let with_split = |scene: &&str| ((*scene).to_string(), split_of_scene(scene));
    let mut splits: BTreeMap<String, Split> = scenes.iter().map(with_split).collect();
    if !splits.values().any(|split| *split == Split::Train)
        && let Some(first) = scenes.iter().min_by_key(|scene| scene_hash(scene))
    {
        splits.insert((*first).to_string(), Split::Train);
    }
    splits
}

fn scene_hash(scene: &str) -> u64 {
    let key = blake3::derive_key(
        "quadpixel dataset split by scene, version 1",
        scene.as_bytes(),
    );
    let mut first = [0; 8];
    first.copy_from_slice(&key[..8]);
    u64::from_le_bytes(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_fall_into_the_splits_as_8_1_1() {
        let names: Vec<String> = (0..10_000).map(|i| format!("scene-{i}")).collect();
        let splits = split_scenes(names.iter().map(String::as_str));
        for (split, share) in [
            (Split::Train, 0.8_f64),
            (Split::Val, 0.1),
            (Split::Test, 0.1),
        ] {
            let count = splits.values().filter(|s| **s == split).count() as f64;
            // Four standard deviations of a binomial.
            let sigma = (10_000.0 * share * (1.0 - share)).sqrt();
            assert!(
                (count - 10_000.0 * share).abs() < 4.0 * sigma,
                "{split:?}: {count}"
            );
        }
    }

    #[test]
    fn a_scene_never_moves_and_a_tiny_set_still_trains() {
        let outside: Vec<String> = (0..200)
            .map(|i| format!("s{i}"))
            .filter(|s| split_of_scene(s) != Split::Train)
            .collect();
        let alone = split_scenes([outside[0].as_str(), outside[0].as_str()]);
        assert_eq!(alone.len(), 1);
        assert_eq!(alone[&outside[0]], Split::Train);
        let trio = split_scenes(outside[..3].iter().map(String::as_str));
        assert_eq!(trio.values().filter(|s| **s == Split::Train).count(), 1);
        assert!(split_scenes([]).is_empty());
    }
}
