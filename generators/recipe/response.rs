//! The pixel's angular response: the ideal box, the table of a pixel model, or a file. Model, preset, shifts and colour
//! are the words of `qpgen response`.

use quadpixel::em::mosaic::FilterColour;
use quadpixel::em::{Level, ModelChoice, PixelStack};
use quadpixel::range::OutOfRange;
use quadpixel::response::TableSettings;
use quadpixel::sensor::Charge;
use quadpixel_datasets::TableColour;
use serde::{Deserialize, Serialize};

use super::stored_response::{ResponseKind, StoredResponse};
use super::table_choice::{ExactModel, TableChoice, one_colour};

/// Where the response comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "StoredResponse", into = "StoredResponse")]
pub enum ResponseSource {
    /// The ideal box of the paper's equation 2 (its classic mode), [`Level::IDEAL`].
    Ideal {
        /// Focal length of the microlens, µm; absent: as fits the F-number of the main lens.
        focal_length_um: Option<f64>,
    },
    /// The table of a pixel model.
    Simulated(TableRecipe),
    /// A table from a file.
    File {
        /// `.npz` file of an angular response.
        file: String,
    },
}

/// The table of a pixel: made where that is soon done, else shipped or made by `qpgen response`.
#[derive(Clone, Debug, PartialEq)]
pub struct TableRecipe {
    /// The pixel model.
    pub level: Level,
    /// Name of a built-in pixel or path of a `.toml` file.
    pub pixel: String,
    /// Factor on the thickness of every flat layer between lens and silicon.
    pub stack_scale: f64,
    /// Which of the pixel's tables.
    pub choice: TableChoice,
    /// What charge does before it is collected.
    pub charge: Charge,
}

impl ResponseSource {
    /// The table of a pixel model, if it is one.
    pub fn table(&self) -> Option<&TableRecipe> {
        match self {
            Self::Simulated(table) => Some(table),
            Self::Ideal { .. } | Self::File { .. } => None,
        }
    }
}

impl TryFrom<StoredResponse> for ResponseSource {
    type Error = OutOfRange;

    fn try_from(stored: StoredResponse) -> Result<Self, OutOfRange> {
        Ok(match stored.kind(["pixel", "stack_scale"], "file")? {
            ResponseKind::Ideal => Self::Ideal {
                focal_length_um: stored.focal_length_um,
            },
            ResponseKind::File => Self::File {
                file: stored.file.unwrap_or_default(),
            },
            ResponseKind::Table(level) => Self::Simulated(TableRecipe {
                level,
                choice: stored.choice(),
                charge: stored.charge()?,
                pixel: stored.pixel.unwrap_or_default(),
                stack_scale: stored.stack_scale.unwrap_or(1.0),
            }),
        })
    }
}

impl From<ResponseSource> for StoredResponse {
    fn from(source: ResponseSource) -> Self {
        match source {
            ResponseSource::Ideal { focal_length_um } => Self {
                focal_length_um,
                ..Self::new(ResponseKind::Ideal)
            },
            ResponseSource::File { file } => Self {
                file: Some(file),
                ..Self::new(ResponseKind::File)
            },
            ResponseSource::Simulated(table) => Self {
                pixel: Some(table.pixel),
                stack_scale: Some(table.stack_scale).filter(|scale| *scale != 1.0),
                ..Self::new(ResponseKind::Table(table.level)).with_table(table.choice, table.charge)
            },
        }
    }
}

impl TableRecipe {
    /// The usual table of a pixel by a model.
    pub fn new(level: Level, pixel: impl Into<String>) -> Self {
        Self {
            level,
            pixel: pixel.into(),
            stack_scale: 1.0,
            choice: TableChoice::default(),
            charge: Charge::default(),
        }
    }

    /// The settings of the table, at these wavelengths, nm.
    pub fn settings(&self, stack: &PixelStack, nm: &[f64]) -> TableSettings {
        let usual = ModelChoice::new(self.level, self.choice.preset);
        let exact = self.choice.exact.map(|e| (e.model, e.preset, e.runs));
        let model = ModelChoice {
            exact: exact.unwrap_or(usual.exact),
            ..usual
        };
        let settings = match self.choice.shifts {
            Some(per_pitch) => TableSettings::for_all_shifts(&model, stack, per_pitch),
            None => TableSettings::for_choice(&model, stack),
        };
        TableSettings {
            wavelengths_nm: nm.to_vec(),
            ..settings
        }
    }

    /// The command that makes the table.
    pub fn command(&self, stack: &PixelStack, nm: &[f64]) -> String {
        let mut words = vec![format!("qpgen response --model {}", self.level)];
        let choice = &self.choice;
        if !choice.preset.is_standard() {
            words.push(format!("--preset {}", choice.preset));
        }
        if let Some(exact) = &choice.exact {
            let ExactModel {
                model,
                preset,
                runs,
            } = exact;
            words.push(format!(
                "--exact {model} --exact-preset {preset} --exact-runs {runs}"
            ));
        }
        words.push(format!(
            "--pixel {} --subpixels {}",
            self.pixel, stack.subpixels
        ));
        if let Some(shifts) = choice.shifts {
            words.push(format!("--shifts {shifts}"));
        }
        if let Some(colour) = choice.colour {
            let name = one_colour(colour).map_or("bands", FilterColour::name);
            words.push(format!("--colour {name}"));
        }
        if choice.colour == Some(TableColour::Bands) {
            words.push(format!("--band-wavelengths {}", nm.len() / 3));
        } else {
            let nm: Vec<String> = nm.iter().map(f64::to_string).collect();
            words.push(format!("--wavelength-nm {}", nm.join(",")));
        }
        if self.stack_scale != 1.0 {
            words.push(format!(
                "(of a pixel file whose layers are {} times as thick; name that file here too)",
                self.stack_scale
            ));
        }
        words.join(" ")
    }
}
