//! `qpgen response`: a pixel's angular response, as a table for the renderer or at a few angles for a person.

mod args;
mod colours;
mod directions;
mod tables;

pub use self::args::ResponseArgs;

use crate::exit::CommandError;
use crate::log::Log;
use crate::out;
use quadpixel::em::PixelStack;
use quadpixel::sensor::check_simulated;
use quadpixel_generators::assemble::pixel;

/// Computes, prints, writes.
///
/// # Errors
/// Bad arguments (2), or a disk that fails (1).
pub fn run(args: &ResponseArgs, log: Log) -> Result<(), CommandError> {
    let mut stack = pixel(&args.pixel)?;
    if let Some(subpixels) = args.subpixels {
        check_simulated("pixel", subpixels).map_err(CommandError::input)?;
        stack.subpixels = subpixels;
    }
    args.model.check(false)?;
    let all_colours = match args.colour {
        Some(colour) => colours::choose(colour, &mut stack)?,
        None => false,
    };
    if args.print_pixel {
        return print_pixel(args, &stack);
    }
    if all_colours {
        return colours::tables(args, &stack, log);
    }
    if let Some(csv) = &args.import {
        tables::import(args, &stack, csv)
    } else if args.theta_deg.is_empty() {
        tables::table(args, &stack, log)
    } else {
        directions::print(args, &stack, log.json(args.json))
    }
}

fn print_pixel(args: &ResponseArgs, stack: &PixelStack) -> Result<(), CommandError> {
    let commented = PixelStack::builtin_toml(&args.pixel)
        .filter(|_| args.subpixels.is_none() && args.colour.is_none());
    match commented {
        Some(text) => out!("{text}"),
        None => {
            let text =
                toml::to_string(stack).map_err(|e| CommandError::failed(format!("pixel: {e}")))?;
            out!(
                "# `qpgen response --pixel 2.8um-tungsten --print-pixel` explains every field.\n{text}"
            );
        }
    }
    Ok(())
}
