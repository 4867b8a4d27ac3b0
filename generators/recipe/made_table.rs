//! Tables that `qpgen response` makes before a dataset uses them: model, preset, shifts and colour mean the same words
//! here and there.

use quadpixel::em::mosaic::FilterColour;
use quadpixel::em::{Level, ModelChoice, PixelStack, Preset};
use quadpixel::response::TableSettings;
pub use quadpixel_datasets::TableColour;
use serde::{Deserialize, Serialize};

/// Which exact model corrects the wave model of the corrected level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExactModel {
    /// The exact model.
    pub model: Level,
    /// How finely it computes.
    pub preset: Preset,
    /// How many directions of it the correction is fitted to.
    pub runs: usize,
}

/// A table made before, of one pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MadeTable {
    /// Name of a built-in pixel or path of a `.toml` file.
    pub pixel: String,
    /// How finely its model computes.
    #[serde(default, skip_serializing_if = "Preset::is_standard")]
    pub preset: Preset,
    /// Lens shifts per pitch of a table of all lens shifts; absent: the table of the centred lens, moved along with the
    /// lens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shifts: Option<usize>,
    /// Colour of the microlens, of a pixel in a mosaic of colour filters; absent: as the pixel says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<TableColour>,
    /// Of the corrected level, its exact model; absent: 16 draft runs of fdtd.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<ExactModel>,
}

/// Tables made before, of one of several pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MadeTables {
    /// Built-in names or `.toml` files; one is drawn per sample.
    pub pixels: Vec<String>,
    /// How finely its model computes.
    #[serde(default, skip_serializing_if = "Preset::is_standard")]
    pub preset: Preset,
    /// Lens shifts per pitch of a table of all lens shifts; absent: the table of the centred lens, moved along with the
    /// lens.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shifts: Option<usize>,
    /// Colour of the microlens, of a pixel in a mosaic of colour filters; absent: as the pixel says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub colour: Option<TableColour>,
    /// Of the corrected level, its exact model; absent: 16 draft runs of fdtd.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exact: Option<ExactModel>,
}

impl MadeTables {
    /// The table of one of the pixels.
    pub fn of_pixel(&self, pixel: String) -> MadeTable {
        MadeTable {
            pixel,
            preset: self.preset,
            shifts: self.shifts,
            colour: self.colour,
            exact: self.exact,
        }
    }
}

/// The one colour, if it is one.
pub fn one_colour(colour: TableColour) -> Option<FilterColour> {
    match colour {
        TableColour::Red => Some(FilterColour::Red),
        TableColour::Green => Some(FilterColour::Green),
        TableColour::Blue => Some(FilterColour::Blue),
        TableColour::Bands => None,
    }
}

fn colour_name(colour: TableColour) -> &'static str {
    one_colour(colour).map_or("bands", FilterColour::name)
}

impl MadeTable {
    fn choice(&self, level: Level) -> ModelChoice {
        let usual = ModelChoice::new(level, self.preset);
        let exact = self.exact.map(|e| (e.model, e.preset, e.runs));
        ModelChoice {
            exact: exact.unwrap_or(usual.exact),
            ..usual
        }
    }

    /// Whether it is the one that comes with the program: of FDTD, standard, of the centred lens.
    pub fn is_usual(&self) -> bool {
        self.preset.is_standard() && self.shifts.is_none() && self.colour.is_none()
    }

    /// The settings of the table.
    pub fn settings(&self, level: Level, stack: &PixelStack, nm: &[f64]) -> TableSettings {
        let choice = self.choice(level);
        let settings = match self.shifts {
            Some(per_pitch) => TableSettings::for_all_shifts(&choice, stack, per_pitch),
            None => TableSettings::for_choice(&choice, stack),
        };
        TableSettings {
            wavelengths_nm: nm.to_vec(),
            ..settings
        }
    }

    /// The command that makes the table.
    pub fn command(&self, level: Level, stack: &PixelStack, nm: &[f64]) -> String {
        let mut words = vec![format!("qpgen response --model {level}")];
        if !self.preset.is_standard() {
            words.push(format!("--preset {}", self.preset));
        }
        if let Some(exact) = &self.exact {
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
        if let Some(shifts) = self.shifts {
            words.push(format!("--shifts {shifts}"));
        }
        if let Some(colour) = self.colour {
            words.push(format!("--colour {}", colour_name(colour)));
        }
        if self.colour == Some(TableColour::Bands) {
            words.push(format!("--band-wavelengths {}", nm.len() / 3));
        } else {
            let nm: Vec<String> = nm.iter().map(f64::to_string).collect();
            words.push(format!("--wavelength-nm {}", nm.join(",")));
        }
        words.join(" ")
    }
}
