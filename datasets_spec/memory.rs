//! One budget of memory: asked before an allocation whose size an input decides, so that a small file which declares a
//! large picture is refused with a word and does not take the machine with it.
//!
//! Allowed is the least of: 4/5 of what the system says is free; what the process may still have under its limits
//! (`ulimit -v`, a container's); and of the limit that a program sets once ([`set_limit`]), what is not used yet.
//! Where the system tells nothing, only that last one holds.

use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Set once at the start of a program, as the number of its threads is; 0: none.
static LIMIT: AtomicU64 = AtomicU64::new(0);

/// More memory than is allowed was asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} takes {:.2} GB of memory; allowed: {:.2} GB now (see --max-memory)", giga(*.needed), giga(*.allowed))]
pub struct MemoryError {
    /// What it was for.
    pub what: String,
    /// How much, bytes.
    pub needed: u64,
    /// How much may be, bytes.
    pub allowed: u64,
}

fn giga(bytes: u64) -> f64 {
    bytes as f64 * 1e-9
}

/// Limits all that the process holds from now on, bytes.
pub fn set_limit(bytes: u64) {
    LIMIT.store(bytes, Ordering::Relaxed);
}

/// Whether there may be `needed` bytes more for `what`.
///
/// # Errors
/// There may not.
pub fn check(what: impl Into<String>, needed: u64) -> Result<(), MemoryError> {
    // Small amounts are everywhere, and need no look at the system.
    if needed < 1 << 24 && LIMIT.load(Ordering::Relaxed) == 0 {
        return Ok(());
    }
    match allowed() {
        Some(allowed) if needed > allowed => Err(MemoryError {
            what: what.into(),
            needed,
            allowed,
        }),
        _ => Ok(()),
    }
}

/// What may be asked for now, bytes; `None` where nothing tells.
pub fn allowed() -> Option<u64> {
    let limit = match LIMIT.load(Ordering::Relaxed) {
        0 => None,
        limit => Some(limit.saturating_sub(own("VmRSS:").unwrap_or(0))),
    };
    let free = field("/proc/meminfo", "MemAvailable:").map(|bytes| bytes / 5 * 4);
    let address_space =
        address_space().map(|most| most.saturating_sub(own("VmSize:").unwrap_or(0)));
    [limit, free, container(), address_space]
        .into_iter()
        .flatten()
        .min()
}

fn own(name: &str) -> Option<u64> {
    field("/proc/self/status", name)
}

/// A field of a file of the system that counts kB; bytes.
fn field(path: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: u64 = line.split_whitespace().next()?.parse().ok()?;
    kilobytes.checked_mul(1024)
}

/// `ulimit -v`, bytes.
fn address_space() -> Option<u64> {
    let text = fs::read_to_string("/proc/self/limits").ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// What a container has left, bytes.
fn container() -> Option<u64> {
    let number = |name: &str| -> Option<u64> {
        let text = fs::read_to_string(Path::new("/sys/fs/cgroup").join(name)).ok()?;
        text.trim().parse().ok()
    };
    let reclaimable = fs::read_to_string("/sys/fs/cgroup/memory.stat").ok();
    let reclaimable = reclaimable.and_then(|text| {
        let line = text
            .lines()
            .find_map(|line| line.strip_prefix("inactive_file "))?;
        line.trim().parse::<u64>().ok()
    });
    let used = number("memory.current")?.saturating_sub(reclaimable.unwrap_or(0));
    Some(number("memory.max")?.saturating_sub(used))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn more_than_there_can_be_is_refused_with_both_numbers() {
        check("a chart", 1 << 20).unwrap();
        if allowed().is_none() {
            return; // nothing tells here
        }
        let error = check("a picture of 4294967295 × 4294967295 px", u64::MAX).unwrap_err();
        let text = error.to_string();
        assert!(
            text.starts_with("a picture of") && text.contains("allowed: "),
            "{text}"
        );
    }
}
