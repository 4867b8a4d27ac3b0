//! The response of a configuration: from which pixels or files each sample's is drawn.

use quadpixel::em::{Level, ShiftGrid};
use quadpixel::range::OutOfRange;
use quadpixel::sensor::Charge;
use serde::{Deserialize, Serialize};

use super::error::{ConfigError, check_filled};
use super::number::{self, Draw};
use crate::recipe::stored_response::{ResponseKind, StoredResponse};
use crate::recipe::table_choice::TableChoice;

/// Angular response; see [`crate::recipe::ResponseSource`], which is drawn from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(
    try_from = "StoredResponse<StackConfig>",
    into = "StoredResponse<StackConfig>"
)]
pub enum ResponseConfig {
    /// The ideal box.
    Ideal,
    /// Tables of a pixel model.
    Simulated(TableConfig),
    /// Tables from files, such as imported ones.
    Files {
        /// `.npz` files of `qpgen response`; one is drawn per sample.
        files: Vec<String>,
    },
}

/// Tables of a pixel model, of one of these pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct TableConfig {
    /// The pixel model.
    pub level: Level,
    /// Built-in names or `.toml` files; one is drawn per sample.
    pub pixels: Vec<String>,
    /// Thickness of the layers; absent: as the pixels have it.
    pub stack: Option<StackConfig>,
    /// Which of the pixel's tables.
    pub choice: TableChoice,
    /// What charge does before it is collected.
    pub charge: Charge,
}

/// Thickness of a pixel's flat layers. Each value needs a table of its own, so few are made and shared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StackConfig {
    /// Factor on the thickness of all flat layers.
    pub scale: Draw,
    /// Number of values that are drawn for each pixel; one of them is drawn a sample.
    pub variants: usize,
}

impl TryFrom<StoredResponse<StackConfig>> for ResponseConfig {
    type Error = OutOfRange;

    fn try_from(stored: StoredResponse<StackConfig>) -> Result<Self, OutOfRange> {
        Ok(match stored.kind(["pixels", "stack"], "files")? {
            ResponseKind::Ideal => Self::Ideal,
            ResponseKind::File => Self::Files {
                files: stored.files.unwrap_or_default(),
            },
            ResponseKind::Table(level) => Self::Simulated(TableConfig {
                level,
                choice: stored.choice(),
                charge: stored.charge()?,
                pixels: stored.pixels.unwrap_or_default(),
                stack: stored.stack,
            }),
        })
    }
}

impl From<ResponseConfig> for StoredResponse<StackConfig> {
    fn from(config: ResponseConfig) -> Self {
        match config {
            ResponseConfig::Ideal => Self::new(ResponseKind::Ideal),
            ResponseConfig::Files { files } => Self {
                files: Some(files),
                ..Self::new(ResponseKind::File)
            },
            ResponseConfig::Simulated(table) => Self {
                pixels: Some(table.pixels),
                stack: table.stack,
                ..Self::new(ResponseKind::Table(table.level)).with_table(table.choice, table.charge)
            },
        }
    }
}

impl ResponseConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        match self {
            Self::Simulated(table) => {
                check_filled(&[("response.pixels", table.pixels.len())])?;
                let grid = table.choice.shifts.map(|n| ShiftGrid::new(1.0, n));
                grid.transpose().map_err(ConfigError::Shifts)?;
                if let Some(stack) = &table.stack {
                    check_filled(&[("response.stack.variants", stack.variants)])?;
                    number::check(&[("response.stack.scale", Some(stack.scale), [0.5, 2.0])])?;
                }
            }
            Self::Files { files } => check_filled(&[("response.files", files.len())])?,
            Self::Ideal => {}
        }
        Ok(())
    }
}
