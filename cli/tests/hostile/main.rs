//! Every command under every fault: it ends in time by exit code 0, 1 or 2, says why, panics and aborts never, leaves
//! nothing half made, and touches nothing that is somebody else's.
//!
//! A part of the table runs with the other tests. In full, each cell with several seeds:
//!
//! ```sh
//! QUADPIXEL_HOSTILE=6 cargo test --release --workspace --test hostile -- --nocapture
//! ```

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![cfg(target_os = "linux")]

mod commands;
#[path = "../qpgen/common/mod.rs"]
mod common;
mod faults;
mod inputs;
mod trial;

use std::collections::BTreeMap;

use commands::CASES;
use faults::FAULTS;
use inputs::make_inputs;
use quadpixel::sampling::hash;
use rayon::prelude::*;
use trial::Trial;

/// Without QUADPIXEL_HOSTILE, one cell in so many is tried.
const ONE_IN: u64 = 8;

#[test]
fn every_command_keeps_its_promises_under_every_fault() {
    let base = tempfile::tempdir().unwrap();
    make_inputs(base.path());
    let seeds = std::env::var("QUADPIXEL_HOSTILE")
        .ok()
        .map(|text| text.parse::<u64>().unwrap());
    let mut cells = Vec::new();
    for (i, case) in CASES.iter().enumerate() {
        for (j, fault) in FAULTS.iter().enumerate() {
            for seed in 0..seeds.unwrap_or(1) {
                let chosen =
                    seeds.is_some() || hash(1, &[i as u64, j as u64]).is_multiple_of(ONE_IN);
                if chosen {
                    cells.push((case, fault, hash(2, &[i as u64, j as u64, seed])));
                }
            }
        }
    }
    let tried: Vec<_> = cells
        .par_iter()
        .filter_map(|&(case, fault, seed)| {
            let mut trial = Trial::new(case, base.path(), seed);
            let concerns = (fault.befall)(&mut trial);
            concerns.then(|| (case, fault, seed, trial.run(fault)))
        })
        .collect();
    let mut classes: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let mut failures = Vec::new();
    for (case, fault, seed, outcome) in &tried {
        let counts = classes.entry(fault.class).or_default();
        counts[usize::from(outcome.is_err())] += 1;
        if let Err(why) = outcome {
            failures.push(format!(
                "{} | {}: {} (seed {seed}): {why}",
                case.name, fault.class, fault.name
            ));
        }
    }
    println!("class    tried  passed  failed");
    for (class, [passed, failed]) in &classes {
        println!("{class:<8} {:>5} {passed:>7} {failed:>7}", passed + failed);
    }
    println!(
        "all      {:>5} {:>7} {:>7}",
        tried.len(),
        tried.len() - failures.len(),
        failures.len()
    );
    assert!(
        failures.is_empty(),
        "{} of {} trials failed:\n{}",
        failures.len(),
        tried.len(),
        failures.join("\n")
    );
}
