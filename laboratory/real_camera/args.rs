//! Arguments of the program, and what it says on its way.

use std::path::PathBuf;

use clap::Parser;

/// Simulates the captures in a folder, measures depth in them, and writes a page.
///
/// Example: real_camera ../captures --out docs/real-camera
#[derive(Parser)]
pub struct Args {
    /// Folder of the captures; see data.rs.
    pub data: PathBuf,
    /// Folder to write.
    #[arg(long, default_value = "docs/real-camera")]
    pub out: PathBuf,
    /// Lens: a built-in name, a .json or a .zmx file.
    #[arg(long, default_value = "lib_50mm_US20210263286_ex1")]
    pub lens: String,
    /// Pixel: a built-in name of `qpgen response`.
    #[arg(long, default_value = "6um-dual")]
    pub pixel: String,
    /// Makes the exact runs of the pixel (minutes each) and writes them to this file; nothing else is done.
    #[arg(long)]
    pub exact_runs: Option<PathBuf>,
}

/// Says what is being done.
pub fn step(text: &str) {
    eprintln!("real_camera: {text}");
}
