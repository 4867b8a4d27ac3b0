//! The tables of a mosaic of colour filters, one a colour of microlens, of one simulation of its supercell.
//!
//! The table of colour c at wavelength λ is P of the sub-pixels of a microlens of colour c, per light of λ that falls on one microlens. What its own
//! filter lets through of a foreign colour is in it, what comes over from neighbours through theirs, and what it loses to them: light of green that
//! falls on the green microlens and ends in the red one's silicon is found in the red table at the green wavelength. A renderer of a Bayer sensor
//! weights the rays of wavelength λ on a pixel of colour c with this table at λ; of channels that are bands apart, [`MosaicTables::of_channels`]
//! is all that it needs.

use super::build::{Plan, Simulated, simulated};
use super::{AngularResponse, BuildReport, BuiltTable, ResponseError, TableSettings};
use crate::em::PixelStack;
use crate::em::mosaic::{FilterColour, Mosaic};
use crate::spectrum::ChannelWavelengths;

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

    /// One table for channels that are bands: at each wavelength of a channel, what the microlenses of its colour make of it. Channels know no
    /// light but that of their bands, so what a filter lets through of the others is not in it.
    ///
    /// # Errors
    /// A wavelength of two channels, or one that the tables were not simulated at.
    pub fn of_channels(
        &self,
        wavelengths: &ChannelWavelengths,
    ) -> Result<AngularResponse, ResponseError> {
        let every: usize = (0..3).map(|c| wavelengths.response_nm(c).len()).sum();
        if wavelengths.all_response_nm().len() < every {
            let allowed = "each in the band of one channel";
            let nm = wavelengths.all_response_nm();
            return Err(ResponseError::value(
                "wavelengths_nm",
                format!("{nm:?}"),
                allowed,
            ));
        }
        let pixel = &self.of(FilterColour::Green).table.meta().pixel;
        let mut parts = Vec::with_capacity(every);
        for (channel, colour) in FilterColour::ALL.into_iter().enumerate() {
            for nm in wavelengths.response_nm(channel) {
                parts.push(self.of(colour).table.at_one(nm)?.of_pixel(pixel.clone()));
            }
        }
        AngularResponse::of_wavelengths(&parts, wavelengths.reference_nm())
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
