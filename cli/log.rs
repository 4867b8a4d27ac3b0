//! What goes to stderr, and how: lines for people, or one JSON object per line for programs. A plain value, made from
//! the arguments in `main` and passed to every command.

use clap::ValueEnum;
use serde_json::{Map, Value};

use crate::print::say;

/// How much is said; each level includes those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub enum Level {
    /// Why the command failed.
    Error,
    /// Also warnings.
    Warn,
    /// Also what the command does, and its progress.
    Info,
    /// Also details.
    Debug,
}

impl Level {
    fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warn => "warning",
            Self::Info => "info",
            Self::Debug => "debug",
        }
    }
}

/// How much is said, and in which form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Log {
    /// What is less urgent is not said.
    pub level: Level,
    /// One JSON object per line.
    pub json: bool,
}

impl Default for Log {
    fn default() -> Self {
        Self {
            level: Level::Info,
            json: false,
        }
    }
}

impl Log {
    /// The same level, in JSON or not.
    pub fn json(self, json: bool) -> Self {
        Self { json, ..self }
    }

    /// Whether that level is said.
    pub fn says(self, level: Level) -> bool {
        level <= self.level
    }

    /// Says a line. `fields` are for programs, which get them in place of what the text tells of them.
    pub fn line(self, level: Level, text: &str, fields: &[(&str, Value)]) {
        if self.says(level) {
            say(&self.formatted(level, text, fields));
        }
    }

    fn formatted(self, level: Level, text: &str, fields: &[(&str, Value)]) -> String {
        if !self.json {
            return match level {
                Level::Error => format!("qpgen: {text}"),
                Level::Warn => format!("warning: {text}"),
                Level::Info | Level::Debug => text.to_string(),
            };
        }
        let mut object = Map::new();
        object.insert("level".into(), level.name().into());
        object.insert("text".into(), text.into());
        object.extend(
            fields
                .iter()
                .map(|(name, value)| ((*name).to_string(), value.clone())),
        );
        Value::Object(object).to_string()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_line_is_text_for_people_and_an_object_for_programs() {
        let log = Log::default();
        let fields = [("done", Value::from(3))];
        assert_eq!(
            log.formatted(Level::Warn, "a \"b\"", &fields),
            "warning: a \"b\""
        );
        let line = log.json(true).formatted(Level::Warn, "a \"b\"\n", &fields);
        assert!(!line.contains('\n'));
        let object: Value = serde_json::from_str(&line).unwrap();
        assert_eq!(
            object,
            serde_json::json!({"level": "warning", "text": "a \"b\"\n", "done": 3})
        );
    }

    #[test]
    fn quiet_says_warnings_and_errors_only() {
        let quiet = Log {
            level: Level::Warn,
            json: false,
        };
        let said = [Level::Error, Level::Warn, Level::Info, Level::Debug].map(|l| quiet.says(l));
        assert_eq!(said, [true, true, false, false]);
    }
}
