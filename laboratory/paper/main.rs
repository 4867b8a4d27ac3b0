//! Rebuilds what the paper shows and this project can, as a page with pictures: `scripts/figures [--quick] [OUT]`.
//! `cargo run --release -p quadpixel-laboratory --example paper -- --stand-ins` shows how its lenses were chosen.
//!
//! ```text
//! tools (qpgen, qpalgo) ─ steps ─▶ work folder: CSV, SVG, captures, JSON ─ page ─▶ OUT/README.md and its pictures
//! ```
//! Each step leaves its JSON in the work folder and is not repeated while that is there; the page is made anew each
//! time.

mod captures;
mod page;
mod pictures;
mod stand_ins;
mod studies;
mod tools;

use std::error::Error;
use std::path::PathBuf;

use clap::Parser;

use tools::Tools;

/// Rebuilds the paper's figures and its Table 2.
#[derive(Parser)]
struct Arguments {
    /// Folder of the page.
    #[arg(long, default_value = "docs/paper")]
    out: PathBuf,
    /// Folder of the steps; what is there is not computed again.
    #[arg(long, default_value = "target/paper")]
    work: PathBuf,
    /// Folder of the programs qpgen and qpalgo.
    #[arg(long, default_value = "target/release")]
    programs: PathBuf,
    /// Small and coarse, for a look at the machinery: wave level, few rays.
    #[arg(long)]
    quick: bool,
    /// Prints how the lenses were chosen that stand in for the paper's (about ten minutes), and no page.
    #[arg(long)]
    stand_ins: bool,
}

fn main() -> std::process::ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            std::process::ExitCode::FAILURE
        }
    }
}

fn run(args: &Arguments) -> Result<(), Box<dyn Error>> {
    let tools = Tools::new(&args.programs, &args.work, args.quick)?;
    if args.stand_ins {
        return stand_ins::choose(&tools);
    }
    let studies = studies::all(&tools)?;
    let captures = captures::all(&tools)?;
    page::write(&args.out, &tools, &studies, &captures)?;
    println!("{}", args.out.join("README.md").display());
    Ok(())
}
