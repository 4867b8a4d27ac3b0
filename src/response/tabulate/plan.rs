//! What a table is made of, the same way for all models.
//!
//! ```text
//! directions × lens shifts × wavelengths × colours
//!   ─▶ runs (one of every orbit under symmetry) ─ solver (or journal) ─▶ P of the period
//!   ─ symmetry, cubic ─▶ one AngularResponse per colour
//! ```

use std::path::Path;

use super::report::BuiltTable;
use super::runs::{Run, RunJournal, Runs};
use super::shipped_runs::{shipped_runs, ships};
use super::table_of_runs::AboutPixel;
use crate::em::PixelStack;
use crate::em::light::{Incidence, Light, PixelSolver, SolverTask, colours};
use crate::em::mosaic::FilterColour;
use crate::journal::JournalError;
use crate::progress::Progress;
use crate::response::{ResponseError, TableSettings};
use crate::shard::Shard;

/// A table, or those of all colours of a mosaic: all its colours come of one simulation of the period.
#[derive(Clone, Debug, PartialEq)]
pub struct TablePlan {
    stack: PixelStack,
    settings: TableSettings,
    each_wavelength: Option<f64>,
}

impl TablePlan {
    /// The table of a pixel. Of one in a mosaic it is that of the mosaic's colour, and the tables of the others are
    /// made with it.
    ///
    /// # Errors
    /// A pixel or settings out of range, or a shifted lens of a table of all lens shifts.
    pub fn new(stack: &PixelStack, settings: &TableSettings) -> Result<Self, ResponseError> {
        settings.check()?;
        stack.check()?;
        let plan = Self {
            stack: stack.clone(),
            settings: settings.clone(),
            each_wavelength: None,
        };
        plan.runs()?;
        Ok(plan)
    }

    /// The same table, whose wavelengths are simulated and kept apart, so that another set of wavelengths uses again
    /// those that it shares. How a lens shift moves the response, and which shift chief rays need, is then taken from
    /// the wavelength nearest to `reference_nm`.
    #[must_use]
    pub fn each_wavelength(self, reference_nm: f64) -> Self {
        Self {
            each_wavelength: Some(reference_nm),
            ..self
        }
    }

    /// The pixel.
    pub fn stack(&self) -> &PixelStack {
        &self.stack
    }

    /// What is tabulated of it.
    pub fn settings(&self) -> &TableSettings {
        &self.settings
    }

    /// The colour that the table is of: the mosaic's; without a mosaic there is one.
    pub fn colour(&self) -> FilterColour {
        let mosaic = self.stack.mosaic.as_ref();
        mosaic.map(|m| m.colour).unwrap_or_default()
    }

    /// The colours that tables are made of.
    pub fn colours(&self) -> Vec<FilterColour> {
        colours(&self.stack)
    }

    /// The same plan, if the pixel is in a mosaic of colour filters.
    ///
    /// # Errors
    /// It is not.
    pub fn of_mosaic(self) -> Result<Self, ResponseError> {
        match self.stack.mosaic {
            Some(_) => Ok(self),
            None => {
                let allowed = "red and blue filters in [mosaic]";
                Err(ResponseError::value("mosaic", "absent", allowed))
            }
        }
    }

    /// The plan of another colour of the mosaic: the same simulation.
    #[must_use]
    pub fn with_colour(&self, colour: FilterColour) -> Self {
        Self {
            stack: self.stack.with_colour(colour),
            ..self.clone()
        }
    }

    /// Hash of model, pixel and settings: the same key means the same table.
    ///
    /// # Errors
    /// Settings that JSON has no form for.
    pub fn key(&self) -> Result<String, ResponseError> {
        self.settings.key(&self.stack)
    }

    /// Plane waves to simulate.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn count(&self) -> Result<usize, ResponseError> {
        Ok(self.runs()?.count())
    }

    /// Whether the answers to all plane waves come with the program: nothing is left to simulate.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn is_shipped(&self) -> Result<bool, ResponseError> {
        let Some((_, plans)) = self.parted() else {
            return Ok(ships(&self.simulation_key()?));
        };
        for plan in plans {
            if !ships(&plan.simulation_key()?) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Simulates the tables on all threads, in the order of [`Self::colours`]. `journal` is a file that keeps the runs
    /// done: a build that was stopped goes on with them, and the file is removed at the end; that it cannot be kept is
    /// no harm. `progress` hears of plane waves, from any thread.
    ///
    /// # Errors
    /// A pixel that the model has no answer for.
    pub fn build_colours(
        &self,
        journal: Option<&Path>,
        progress: &dyn Progress,
    ) -> Result<Vec<BuiltTable>, ResponseError> {
        let key = self.simulation_key()?;
        let journal = journal.map(|path| RunJournal::open(path, &key, progress));
        let (journal, no_journal) = match journal.transpose() {
            Ok(journal) => (journal, None),
            Err(JournalError::Stopped { path }) => return Err(ResponseError::Stopped { path }),
            Err(e) => (None, Some(e.to_string())),
        };
        let mut built = self.build_with(journal.as_ref(), progress)?;
        let trouble = no_journal.or(journal.and_then(RunJournal::remove));
        for built in &mut built {
            built.report.journal_trouble.clone_from(&trouble);
        }
        Ok(built)
    }

    /// [`Self::build_colours`], of them that of the pixel's colour.
    ///
    /// # Errors
    /// As there.
    pub fn build(
        &self,
        journal: Option<&Path>,
        progress: &dyn Progress,
    ) -> Result<BuiltTable, ResponseError> {
        self.of_colour(self.build_colours(journal, progress)?)
    }

    /// That of the pixel's colour, of what there is one per colour of.
    pub(in crate::response) fn of_colour<T>(&self, all: Vec<T>) -> Result<T, ResponseError> {
        let mut by_colour = self.colours().into_iter().zip(all);
        let wanted = by_colour.find(|(colour, _)| *colour == self.colour());
        let none = || ResponseError::value("tables", 0, "one per colour");
        wanted.map(|(_, one)| one).ok_or_else(none)
    }

    /// What the runs depend on: all colours share them.
    pub(in crate::response) fn simulation_key(&self) -> Result<String, ResponseError> {
        self.with_colour(FilterColour::default()).key()
    }

    /// The plans of each wavelength with the reference wavelength, where they are kept apart.
    pub(in crate::response) fn parted(&self) -> Option<(f64, Vec<Self>)> {
        let reference_nm = self.each_wavelength?;
        let one = |&nm: &f64| Self {
            settings: TableSettings {
                wavelengths_nm: vec![nm],
                ..self.settings.clone()
            },
            each_wavelength: None,
            stack: self.stack.clone(),
        };
        let plans = self.settings.wavelengths_nm.iter().map(one).collect();
        Some((reference_nm, plans))
    }

    /// [`Self::build_colours`] with a journal that is open and stays.
    pub(in crate::response) fn build_with(
        &self,
        journal: Option<&RunJournal>,
        progress: &dyn Progress,
    ) -> Result<Vec<BuiltTable>, ResponseError> {
        let runs = self.runs()?;
        let solvers = self.solvers(journal)?;
        let shipped = shipped_runs(&self.simulation_key()?);
        let simulated = match shipped.and_then(|lights| runs.answered(lights)) {
            Some(simulated) => simulated,
            None => runs.simulate(journal, progress, &|run, waves| {
                answers(&solvers, run, waves)
            })?,
        };
        let first = solvers.first().map(|solver| solver.frame()).transpose()?;
        let fits = solvers.iter().filter_map(|s| s.correction_fit());
        let mut about = AboutPixel {
            frame: match first {
                Some(frame) => frame,
                None => self.stack.moving_frame(self.settings.wavelengths_nm[0])?,
            },
            corrections: fits.collect(),
            layout: None,
        };
        let table = |colour, about: &AboutPixel| {
            let stack = self.stack.with_colour(colour);
            runs.table(&stack, &self.settings, about, &simulated)
        };
        // One layout of microlenses serves all colours: that of green, which light of the reference wavelength has.
        let green = table(FilterColour::Green, &about)?;
        about.layout = green.table.meta().chief_ray_shifts.clone();
        let mut green = Some(green);
        let colours = self.colours().into_iter();
        let one = |colour| match green.take_if(|_| colour == FilterColour::Green) {
            Some(green) => Ok(green),
            None => table(colour, &about),
        };
        colours.map(one).collect()
    }

    /// Simulates one part of the directions into `journal`: how many plane waves they are, and how many of them it
    /// held.
    pub(in crate::response) fn build_part(
        &self,
        shard: Shard,
        journal: &RunJournal,
        progress: &dyn Progress,
    ) -> Result<(usize, usize), ResponseError> {
        let mut runs = self.runs()?;
        runs.keep_part(shard);
        let solvers = self.solvers(Some(journal))?;
        let simulated = runs.simulate(Some(journal), progress, &|run, waves| {
            answers(&solvers, run, waves)
        })?;
        Ok((runs.count(), simulated.reused))
    }

    /// The answers to all runs of a plan of one wavelength and lens shift, in their order.
    #[cfg(test)]
    pub(super) fn simulate_all(&self) -> Result<Vec<Light>, ResponseError> {
        let (runs, solvers) = (self.runs()?, self.solvers(None)?);
        let ask = |run: &Run, waves: &[Incidence]| answers(&solvers, run, waves);
        let simulated = runs.simulate(None, &(), &ask)?;
        Ok(simulated.answers.into_iter().flatten().flatten().collect())
    }

    /// That to one of them.
    #[cfg(test)]
    pub(super) fn simulate_run(&self, number: usize) -> Result<Light, ResponseError> {
        let (mut runs, solvers) = (self.runs()?, self.solvers(None)?);
        runs.runs = vec![runs.runs.swap_remove(number)];
        let ask = |run: &Run, waves: &[Incidence]| answers(&solvers, run, waves);
        let mut simulated = runs.simulate(None, &(), &ask)?;
        Ok(simulated
            .answers
            .swap_remove(0)
            .swap_remove(0)
            .swap_remove(0))
    }

    fn runs(&self) -> Result<Runs, ResponseError> {
        let pulsed = self.settings.model.is_pulsed();
        Runs::new(&self.stack, &self.settings, pulsed)
    }

    fn solvers(
        &self,
        journal: Option<&RunJournal>,
    ) -> Result<Vec<Box<dyn PixelSolver>>, ResponseError> {
        Ok(self.settings.model.solvers(&SolverTask {
            stack: &self.stack,
            wavelengths_nm: &self.settings.wavelengths_nm,
            any_shift: self.settings.shifts.is_some(),
            folder: journal.and_then(|j| j.path().parent()),
        })?)
    }
}

/// [`TablePlan::build`] of a pixel and settings, with no cache.
///
/// # Errors
/// A pixel or settings out of range, or a pixel that the model has no answer for.
pub fn build_table(
    stack: &PixelStack,
    settings: &TableSettings,
    journal: Option<&Path>,
    progress: &dyn Progress,
) -> Result<BuiltTable, ResponseError> {
    TablePlan::new(stack, settings)?.build(journal, progress)
}

/// The answers of the solver of a run's first wavelength.
fn answers(
    solvers: &[Box<dyn PixelSolver>],
    run: &Run,
    waves: &[Incidence],
) -> Result<Vec<Vec<Light>>, ResponseError> {
    let none = || ResponseError::value("solvers", solvers.len(), "one per wavelength");
    let solver = solvers.get(run.wavelengths.start).ok_or_else(none)?;
    Ok(solver.light(waves, run.wavelengths.len(), &|_| ())?)
}
