//! `qpalgo`.

use std::process::ExitCode;

use quadpixel_cli::memory::Guarded;
use quadpixel_cli::qpalgo;

#[global_allocator]
static MEMORY: Guarded = Guarded;

fn main() -> ExitCode {
    ExitCode::from(qpalgo::main(std::env::args_os()))
}
