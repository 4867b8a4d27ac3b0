//! Every reader of files over its corpus and thousands of damaged copies of it: an answer each time, never a panic. The
//! same functions are fuzz targets (`tests/fuzz/README.md`); here they run on the stable compiler.
//!
//! `QUADPIXEL_MUTATIONS` sets the number of copies of each file (default 300).

#![allow(clippy::unwrap_used)] // because tests fail by panicking

mod damage;
mod entries;

use std::fs;
use std::path::{Path, PathBuf};

use damage::damaged;
use entries::ENTRIES;

fn copies() -> u64 {
    let asked = std::env::var("QUADPIXEL_MUTATIONS").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(300)
}

fn corpus(name: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/fuzz/corpus")
        .join(name);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.sort();
    paths
        .into_iter()
        .map(|p| (p.clone(), fs::read(p).unwrap()))
        .collect()
}

#[test]
fn every_corpus_has_files_that_are_accepted() {
    for (name, read) in ENTRIES {
        let accepted = corpus(name).iter().filter(|(_, bytes)| read(bytes)).count();
        assert!(
            accepted > 0,
            "{name}: none of its files is read, so damages test nothing"
        );
    }
}

#[test]
fn damaged_files_of_every_kind_are_read_or_refused() {
    for (name, read) in ENTRIES {
        let began = std::time::Instant::now();
        let (mut accepted, mut refused) = (0, 0);
        for (path, bytes) in corpus(name) {
            for key in 0..copies() {
                let copy = damaged(&bytes, key);
                let answer = std::panic::catch_unwind(|| read(&copy)).unwrap_or_else(|_| {
                    panic!("{name}: copy {key} of {} makes it panic", path.display())
                });
                match answer {
                    true => accepted += 1,
                    false => refused += 1,
                }
            }
        }
        println!(
            "{name}: {accepted} accepted, {refused} refused, {:.2} s",
            began.elapsed().as_secs_f64()
        );
        assert!(refused > 0, "{name}: no damage is noticed");
    }
}

#[test]
fn every_entry_has_a_fuzz_target() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fuzz");
    let manifest = fs::read_to_string(root.join("Cargo.toml")).unwrap();
    for (name, _) in ENTRIES {
        let source = fs::read_to_string(root.join(format!("fuzz_targets/{name}.rs"))).unwrap();
        assert!(source.contains(&format!("entries::{name}(")), "{name}");
        assert!(manifest.contains(&format!("name = \"{name}\"")), "{name}");
    }
}
