//! `qpgen`.

use std::process::ExitCode;

use quadpixel_cli::memory::Guarded;
use quadpixel_cli::qpgen;

#[global_allocator]
static MEMORY: Guarded = Guarded;

fn main() -> ExitCode {
    ExitCode::from(qpgen::main(std::env::args_os()))
}
