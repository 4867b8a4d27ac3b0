//! Printing on stdout, the one way to do it: what cannot be printed (a full disk behind it) is a failure of the
//! command, and no panic. Texts of files and names reach a terminal as text: what would command it is shown as U+FFFD.

use std::fmt;
use std::io::Write;

use crate::exit::CommandError;

/// Prints a line on stdout, or returns the [`CommandError`] that it could not be printed.
#[macro_export]
macro_rules! outln {
    ($($argument:tt)*) => {
        $crate::print::print(format_args!("{}\n", format_args!($($argument)*)))?
    };
}

/// As [`outln!`], without the end of the line.
#[macro_export]
macro_rules! out {
    ($($argument:tt)*) => {
        $crate::print::print(format_args!($($argument)*))?
    };
}

/// Prints on stdout, through to whom it goes.
///
/// # Errors
/// Why it cannot be printed (1).
pub fn print(text: fmt::Arguments<'_>) -> Result<(), CommandError> {
    let mut out = std::io::stdout().lock();
    let text = plain(&text.to_string());
    let printed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    printed.map_err(|e| CommandError::failed(format!("stdout: cannot write: {e}")))
}

/// Says a line on stderr. Where that is not possible there is nobody to tell.
pub fn say(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{}", plain(text));
}

/// Lines of text, with U+FFFD for control characters other than line feed and tab.
fn plain(text: &str) -> String {
    let shown = |c: char| match c {
        '\n' | '\t' => c,
        c if c.is_control() => char::REPLACEMENT_CHARACTER,
        c => c,
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn a_name_cannot_command_the_terminal() {
        assert_eq!(
            plain("a\tb\n\u{1b}]0;x\u{7}\u{9b}31m"),
            "a\tb\n\u{fffd}]0;x\u{fffd}\u{fffd}31m"
        );
    }
}
