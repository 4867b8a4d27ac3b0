//! Which effects are simulated, by arguments.

use crate::number::number;
use clap::Args;
use quadpixel::effects::{Choice, Tolerance};
use quadpixel_datasets::Effect;

/// Arguments that choose the effects.
#[derive(Args)]
pub struct EffectArgs {
    #[arg(long, value_name = "auto|all|none|LIST", help = help())]
    effects: Option<Choice>,
    /// With auto: root-mean-square difference, in % of the signal, below which an effect is left out [default: 0.5].
    #[arg(value_parser = number, long, value_name = "PERCENT", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// With auto: shift, in px, below which an effect is left out [default: 0.02].
    #[arg(value_parser = number, long, value_name = "PX", allow_negative_numbers = true)]
    tolerance_px: Option<f64>,
}

/// Of `--effects`, with the names of all that can be chosen.
fn help() -> String {
    let names = Effect::SELECTABLE.map(|effect| effect.name()).join(", ");
    format!(
        "Effects that are simulated: auto (those whose absence would be seen), all, none, or a list separated by commas of {names}; absent: as the file says, else auto"
    )
}

impl EffectArgs {
    /// Puts what was given in the place of what a file says.
    pub fn apply(&self, effects: &mut Choice, tolerance: &mut Tolerance) {
        if let Some(choice) = &self.effects {
            effects.clone_from(choice);
        }
        tolerance.signal_percent = self.tolerance.unwrap_or(tolerance.signal_percent);
        tolerance.shift_px = self.tolerance_px.unwrap_or(tolerance.shift_px);
    }
}
