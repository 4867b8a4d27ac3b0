//! Every command under every fault: it ends in time by exit code 0, 1 or 2, says why, panics and aborts never, leaves
//! nothing half made, and touches nothing that is somebody else's.
//!
//! A part of the table runs with the other tests. In full, each cell with several seeds:
//!
//! ```sh
//! QUADPIXEL_HOSTILE=5 QUADPIXEL_HOSTILE_LOG=hostile.tsv cargo test --release --workspace --test hostile -- --nocapture
//! ```
//!
//! Each trial that ends is a line of the log; stopped and started again, the same command tries only what the log does
//! not have, and what failed. QUADPIXEL_HOSTILE_ONLY takes one class of faults, such as `disk`, or one line, such as
//! `lens info`.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![cfg(target_os = "linux")]

mod commands;
#[path = "../qpgen/common/mod.rs"]
mod common;
mod faults;
mod inputs;
mod log;
mod pages;
mod trial;

use std::collections::BTreeMap;

use commands::{Case, cases};
use faults::{FAULTS, Fault};
use inputs::make_inputs;
use log::TrialLog;
use quadpixel::sampling::hash;
use rayon::prelude::*;
use trial::Trial;

/// Without QUADPIXEL_HOSTILE, one cell in so many is tried.
const ONE_IN: u64 = 10;

/// A command, what befalls it, and the seed of where.
type Cell = (&'static Case, &'static Fault, u64);

fn cells() -> Vec<Cell> {
    let seeds = std::env::var("QUADPIXEL_HOSTILE")
        .ok()
        .map(|text| text.parse::<u64>().unwrap());
    let only = std::env::var("QUADPIXEL_HOSTILE_ONLY").ok();
    let is_wanted = |case: &Case, fault: &Fault| {
        only.as_deref()
            .is_none_or(|only| only == case.name || only == fault.class)
    };
    let mut cells = Vec::new();
    for seed in 0..seeds.unwrap_or(1) {
        for (i, case) in cases().enumerate() {
            for (j, fault) in FAULTS.iter().enumerate() {
                let chosen =
                    seeds.is_some() || hash(1, &[i as u64, j as u64]).is_multiple_of(ONE_IN);
                if chosen && is_wanted(case, fault) {
                    cells.push((case, fault, hash(2, &[i as u64, j as u64, seed])));
                }
            }
        }
    }
    cells
}

#[test]
fn every_command_keeps_its_promises_under_every_fault() {
    let log = TrialLog::from_environment();
    let base = tempfile::tempdir().unwrap();
    make_inputs(base.path());
    let tried: Vec<_> = cells()
        .par_iter()
        .filter_map(|&(case, fault, seed)| {
            let mut trial = Trial::new(case, base.path(), seed);
            let concerns = (fault.befall)(&mut trial);
            concerns.then(|| {
                let place = format!("{}\t{}: {}\t{seed}", case.name, fault.class, fault.name);
                let outcome = log.passed(&place).map_or_else(
                    || {
                        let outcome = trial.run(fault);
                        log.add(&place, &outcome);
                        outcome
                    },
                    Ok,
                );
                (fault.class, place, outcome)
            })
        })
        .collect();
    let mut classes: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let mut failures = Vec::new();
    for (class, place, outcome) in &tried {
        let counts = classes.entry(class).or_default();
        counts[usize::from(outcome.is_err())] += 1;
        if let Err(why) = outcome {
            failures.push(format!("{place}: {why}"));
        }
    }
    if !trial::may_mount() {
        println!("skipped: faults of disks, for want of a right to mount");
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
