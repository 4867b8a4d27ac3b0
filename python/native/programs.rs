//! The programs `qpgen` and `qpalgo`, as the commands run them that a wheel installs.

use std::ffi::OsString;
use std::io::Write;
use std::panic::catch_unwind;

use pyo3::prelude::*;

/// Exit code of a Rust program with a fault.
const FAULT: u8 = 101;

/// Runs `qpgen` in this process, once; `args`: its own name first. Returns its exit code.
#[pyfunction]
pub fn qpgen(py: Python<'_>, args: Vec<OsString>) -> u8 {
    run(py, args, quadpixel_cli::qpgen::main)
}

/// As [`qpgen`], of `qpalgo`.
#[pyfunction]
pub fn qpalgo(py: Python<'_>, args: Vec<OsString>) -> u8 {
    run(py, args, quadpixel_cli::qpalgo::main)
}

fn run(py: Python<'_>, args: Vec<OsString>, program: fn(Vec<OsString>) -> u8) -> u8 {
    py.detach(|| {
        // The fault has been said on stderr.
        let code = catch_unwind(|| program(args)).unwrap_or(FAULT);
        // As at the end of a Rust program; what cannot be written was noticed by the command that printed it.
        let _ = std::io::stdout().flush();
        code
    })
}
