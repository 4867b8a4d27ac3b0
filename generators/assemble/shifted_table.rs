//! The wave table of all lens shifts that a recipe asks for: made and kept if that takes minutes, else one that was
//! made before.

use quadpixel::em::{Level, ModelChoice, PixelStack, Preset};
use quadpixel::progress::Progress;
use quadpixel::response::{CachedTable, ResponseCache, TablePlan, TableSettings};

use crate::recipe::RecipeError;

/// Seconds of one core that a dataset spends on a table unasked.
const MOST_SECONDS: f64 = 900.0;

/// A table asked for.
pub(crate) struct ShiftedTable<'a> {
    pixel: &'a str,
    /// Factor on the thickness of the pixel's layers.
    scale: f64,
    stack: &'a PixelStack,
    settings: TableSettings,
    per_pitch: usize,
    preset: Preset,
}

impl<'a> ShiftedTable<'a> {
    /// By the wave model, `per_pitch` shifts per pitch: the table of `qpgen response --shifts`.
    pub fn wave(
        pixel: &'a str,
        scale: f64,
        stack: &'a PixelStack,
        (per_pitch, preset): (usize, Preset),
    ) -> Self {
        let choice = ModelChoice::new(Level::Wave, preset);
        Self {
            pixel,
            scale,
            stack,
            settings: TableSettings::for_all_shifts(&choice, stack, per_pitch),
            per_pitch,
            preset,
        }
    }

    /// The same table at these wavelengths, nm.
    pub fn at(mut self, wavelengths_nm: &[f64]) -> Self {
        self.settings.wavelengths_nm = wavelengths_nm.to_vec();
        self
    }

    /// What has to be made by the wave model; `None` if it is kept.
    ///
    /// # Errors
    /// It takes long: with the command that makes it.
    pub fn to_make(&self, cache: &ResponseCache) -> Result<Option<TablePlan>, RecipeError> {
        let plan = self.plan()?;
        if matches!(cache.find(&plan), Ok(Some(_))) {
            return Ok(None);
        }
        let runs = plan.count()?;
        let seconds = seconds_by_wave(self.stack, runs);
        if seconds > MOST_SECONDS {
            return Err(self.missing(&format!("{:.0} minutes of one core", seconds / 60.0)));
        }
        Ok(Some(plan))
    }

    fn plan(&self) -> Result<TablePlan, RecipeError> {
        Ok(TablePlan::new(self.stack, &self.settings)?)
    }

    /// From the cache, or made for it if that is soon done.
    pub fn made(
        &self,
        cache: &ResponseCache,
        progress: &dyn Progress,
    ) -> Result<CachedTable, RecipeError> {
        self.to_make(cache)?;
        Ok(cache.table(&self.plan()?, progress)?)
    }

    fn missing(&self, time: &str) -> RecipeError {
        let shifts = self.per_pitch;
        let preset = match self.preset.is_standard() {
            true => String::new(),
            false => format!(" --preset {}", self.preset),
        };
        let (pixel, subpixels) = (self.pixel, self.stack.subpixels);
        let command = format!(
            "qpgen response --model wave{preset} --pixel {pixel} --subpixels {subpixels} --shifts {shifts}"
        );
        let scaled = if self.scale == 1.0 {
            String::new()
        } else {
            format!(
                " (of a pixel file whose layers are {} times as thick; name that file here too)",
                self.scale
            )
        };
        RecipeError::NoTable {
            table: format!(
                "wave table of all lens shifts of pixel {pixel} ({subpixels}), {shifts} per pitch, is kept"
            ),
            time: format!("make it first, in about {time}"),
            command: command + &scaled,
        }
    }
}

/// What `runs` runs of the wave model take about, on one core.
fn seconds_by_wave(stack: &PixelStack, runs: usize) -> f64 {
    // Measured: `benches/runs/2026-11-21/cra.md`.
    1.5e-3 * (stack.pitch_um / 1.6).powi(3) * runs as f64
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_table_that_takes_long_is_asked_for_by_the_command_that_makes_it() {
        let folder = tempfile::tempdir().unwrap();
        let cache = ResponseCache::open(folder.path());
        let stack = PixelStack::builtin("3.5um").unwrap();
        let wave = ShiftedTable::wave("3.5um", 1.0, &stack, (32, Preset::Standard));
        let why = wave.made(&cache, &|_, _| ()).unwrap_err().to_string();
        assert!(
            why.contains("qpgen response --model wave --pixel 3.5um --subpixels 2x2 --shifts 32"),
            "{why}"
        );
    }

    #[test]
    fn a_table_soon_made_is_made_once_and_then_found() {
        let folder = tempfile::tempdir().unwrap();
        let cache = ResponseCache::open(folder.path());
        let stack = PixelStack::builtin("1.6um").unwrap();
        let mut asked = ShiftedTable::wave("1.6um", 1.0, &stack, (4, Preset::Standard));
        asked.settings.steps = 3;
        asked.settings.cosine_max = 0.6;
        let first = asked.made(&cache, &|_, _| ()).unwrap();
        assert!(first.report.is_some() && first.table.meta().shift_grid.is_some());
        let plan = asked.plan().unwrap();
        assert_eq!(cache.find(&plan).unwrap(), Some(first.table));
    }
}
