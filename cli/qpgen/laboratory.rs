//! How failures of experiments end a command.

use quadpixel::command::CommandError;
use quadpixel_laboratory::error::LaboratoryError;

/// Exit code 2 for what other arguments mend, else 1.
pub fn command_error(error: LaboratoryError) -> CommandError {
    match error.is_input() {
        true => CommandError::input(error),
        false => CommandError::failed(error),
    }
}
