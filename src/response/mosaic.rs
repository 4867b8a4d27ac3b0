//! The tables of a mosaic of colour filters, one a colour of microlens, of one simulation of its supercell.
//!
//! The table of colour c at wavelength λ is P of the sub-pixels of a microlens of colour c, per light of λ that falls on one microlens. What its own
//! filter lets through of a foreign colour is in it, what comes over from neighbours through theirs, and what it loses to them: light of green that
//! falls on the green microlens and ends in the red one's silicon is found in the red table at the green wavelength. A renderer of a Bayer sensor
//! weights the rays of wavelength λ on a pixel of colour c with this table at λ.

use super::build::{Plan, Simulated, simulated};
use super::{BuildReport, BuiltTable, ResponseError, TableSettings};
use crate::em::PixelStack;
use crate::em::mosaic::{FilterColour, Mosaic};

/// One table a colour.
#[derive(Clone, Debug)]
pub struct MosaicTables([BuiltTable; 3]);

impl MosaicTables {
    /// The table of the microlenses of a colour; of green the mean of both.
    pub fn of(&self, colour: FilterColour) -> &BuiltTable {
        let [red, green, blue] = &self.0;
        match colour {
            FilterColour::Red => red,
            FilterColour::Green => green,
            FilterColour::Blue => blue,
        }
    }
}

/// Simulates the tables of a mosaic, on all threads. `progress(done, total)` counts runs. Refuses pixels without one.
pub fn build_mosaic_tables(
    stack: &PixelStack,
    settings: &TableSettings,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<MosaicTables, ResponseError> {
    settings.check()?;
    stack.check()?;
    let Some(mosaic) = &stack.mosaic else {
        let allowed = "red and blue filters in [mosaic]";
        return Err(ResponseError::value("mosaic", "absent", allowed));
    };
    let of_colour = |colour| {
        let mut one = stack.clone();
        one.mosaic = Some(Mosaic {
            colour,
            ..mosaic.clone()
        });
        one
    };
    let count = stack.subpixels.count();
    // All colours in a row stand for the sub-pixels of one.
    let mut plan = Plan::new(stack, settings, settings.model.is_pulsed());
    plan.count = count * FilterColour::ALL.len();
    let own = |absorbed: &[f64]| -> Vec<f64> {
        let of = |colour| stack.share_of(colour, absorbed);
        FilterColour::ALL.into_iter().flat_map(of).collect()
    };
    let (all, _) = simulated(&plan, stack, settings, &own, None, progress)?;
    plan.count = count;
    let table = |place: usize| {
        let mut report = BuildReport {
            least: f64::INFINITY,
            largest_sum: 0.0,
            ..all.report.clone()
        };
        let mut nodes = all.nodes.clone();
        for p in nodes.iter_mut().flat_map(|by_node| by_node.values_mut()) {
            *p = p[place * count..][..count].to_vec();
            report.note_shares(p);
        }
        let stack = of_colour(FilterColour::ALL[place]);
        plan.table(&stack, settings, Simulated { nodes, report })
    };
    Ok(MosaicTables([table(0)?, table(1)?, table(2)?]))
}
