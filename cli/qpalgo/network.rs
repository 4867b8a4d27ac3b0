//! The flag that has a network tell the disparity.

use std::path::PathBuf;

use crate::exit::CommandError;
use clap::Args;
use quadpixel::file;
use quadpixel_algorithms::dense::Network;

use crate::qpalgo::inputs::in_file;

/// `--network`, with or without a file.
#[derive(Clone, Debug, Args)]
pub struct NetworkArgs {
    /// At every pixel, as matching (--dense) and a network tell it together, each where it is surer; the network was
    /// trained on pictures of this project (learn/README.md). With =FILE: another one, an archive that learn/export.py
    /// wrote.
    #[arg(
        long,
        group = "every_pixel",
        value_name = "FILE",
        num_args = 0..=1,
        require_equals = true,
        conflicts_with_all = ["search", "window", "stride"]
    )]
    network: Option<Option<PathBuf>>,
}

impl NetworkArgs {
    /// Whether a network is asked for.
    pub fn is_given(&self) -> bool {
        self.network.is_some()
    }

    /// The network that is asked for.
    pub fn read(&self) -> Result<Option<Network>, CommandError> {
        let network = match &self.network {
            None => return Ok(None),
            Some(None) => Network::shipped().map_err(CommandError::input)?,
            Some(Some(path)) => {
                let bytes = file::read(path).map_err(CommandError::input)?;
                Network::from_archive(&bytes).map_err(in_file(path))?
            }
        };
        Ok(Some(network))
    }
}
