//! Memory of the process: the limit that a user sets, and what happens where the system has no more.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

use quadpixel::memory;

use crate::exit::CommandError;

/// The system's memory. Where there is no more (`ulimit -v`), the process ends with exit code 1 and a word on stderr,
/// and not by the signal that Rust's default raises.
pub struct Guarded;

// SAFETY: each call is the system allocator's with the same arguments; of its answers only null is not passed on, and
// then nothing is returned at all.
unsafe impl GlobalAlloc for Guarded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promises are those that the system allocator asks for.
        there(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        there(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        there(unsafe { System.realloc(old, layout, size) }, size)
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(old, layout) }
    }
}

fn there(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() {
        // Nothing here asks for memory: numbers are written digit by digit.
        let _ = writeln!(
            std::io::stderr(),
            "out of memory: {bytes} bytes more were asked for, and the system has none"
        );
        std::process::exit(1);
    }
    memory
}

/// Bytes of `--max-memory`: a number with M or G behind it, such as 512M or 4G (10⁶, 10⁹).
///
/// # Errors
/// Another text.
pub fn parse_bytes(text: &str) -> Result<u64, String> {
    let factor = match text.bytes().last() {
        Some(b'M' | b'm') => 1_000_000,
        Some(b'G' | b'g') => 1_000_000_000,
        _ => return Err("allowed: a number with M or G behind it, such as 512M or 4G".into()),
    };
    let number: u64 = text[..text.len() - 1].parse().map_err(|e| format!("{e}"))?;
    match number.checked_mul(factor) {
        Some(bytes) if bytes >= LEAST_BYTES => Ok(bytes),
        _ => Err("allowed: 64M to 18446744073G".into()),
    }
}

/// Below this no command does anything.
const LEAST_BYTES: u64 = 64_000_000;

/// Takes `--max-memory`, and says no before the work where the system has not even the least of it.
///
/// # Errors
/// There is no memory to work in (1).
pub fn limit(bytes: Option<u64>) -> Result<(), CommandError> {
    if let Some(bytes) = bytes {
        memory::set_limit(bytes);
    }
    memory::check("the program", 1 << 20).map_err(CommandError::failed)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::parse_bytes;

    #[test]
    fn a_limit_has_a_unit() {
        assert_eq!(parse_bytes("512M").unwrap(), 512_000_000);
        assert_eq!(parse_bytes("4g").unwrap(), 4_000_000_000);
        for bad in ["", "4", "G", "-1G", "1M", "4é", "99999999999999999999G"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }
}
