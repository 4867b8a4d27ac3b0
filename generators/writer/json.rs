//! JSON files, and the version of the program in them.

use std::path::Path;

use super::error::WriteError;

/// Version of this program, as written into the files.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Most characters of a line of several numbers.
const WIDTH: usize = 100;

/// Pretty JSON with a final line feed; lists without objects stand in as few lines as they fit into.
pub(super) fn json<T: serde::Serialize>(path: &Path, value: &T) -> Result<Vec<u8>, WriteError> {
    let pretty = serde_json::to_string_pretty(value).map_err(|cause| WriteError::Json {
        path: path.to_path_buf(),
        cause,
    })?;
    let lines: Vec<&str> = pretty.lines().collect();
    let mut text = String::with_capacity(pretty.len());
    filled(&lines, &mut text);
    Ok(text.into_bytes())
}

/// Lines of pretty JSON, which has one value, key or bracket in each.
fn filled(lines: &[&str], to: &mut String) {
    let mut at = 0;
    while let Some(line) = lines.get(at) {
        let Some(list) = list(&lines[at..]) else {
            to.push_str(line);
            to.push('\n');
            at += 1;
            continue;
        };
        at += list.len();
        let (inside, end) = (&list[1..list.len() - 1], list[list.len() - 1]);
        if let Some(whole) = joined(list, WIDTH.saturating_sub(indent(line))) {
            to.push_str(&" ".repeat(indent(line)));
            to.push_str(&whole);
        } else {
            to.push_str(line);
            to.push('\n');
            match inside.iter().any(|line| line.ends_with('[')) {
                true => filled(inside, to),
                false => rows(inside, to),
            }
            to.push_str(end);
        }
        to.push('\n');
    }
}

/// The lines of the list that begins with the first, if it does and has no object in it.
fn list<'a, 'b>(lines: &'b [&'a str]) -> Option<&'b [&'a str]> {
    let first = lines.first().filter(|line| line.ends_with('['))?;
    let is_end = |line: &&str| indent(line) == indent(first) && line.trim_start().starts_with(']');
    let end = lines.iter().skip(1).position(is_end)? + 1;
    let list = &lines[..=end];
    (!list.iter().any(|line| line.ends_with('{'))).then_some(list)
}

/// The list in one line, if that has so many bytes at most.
fn joined(list: &[&str], most: usize) -> Option<String> {
    let mut text = String::new();
    for line in list {
        let line = line.trim_start();
        if text.ends_with(',') {
            text.push(' ');
        }
        text.push_str(line);
        if text.len() > most {
            return None;
        }
    }
    Some(text)
}

/// Values, as many in a line as it holds.
fn rows(values: &[&str], to: &mut String) {
    let mut row = String::new();
    for value in values {
        if row.is_empty() {
            row.push_str(value);
        } else if row.len() + 1 + value.trim_start().len() <= WIDTH {
            row.push(' ');
            row.push_str(value.trim_start());
        } else {
            to.push_str(&row);
            to.push('\n');
            row = (*value).to_owned();
        }
    }
    to.push_str(&row);
    to.push('\n');
}

fn indent(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_share_lines_and_mean_the_same() {
        let value = serde_json::json!({
            "short": [1.5, -2, null],
            "empty": [],
            "long": (0..100).map(f64::from).collect::<Vec<f64>>(),
            "pairs": vec![[0.25, -1e-7]; 40],
            "objects": [{"a": [1, 2]}, {"b": "]{[,"}],
            "strings": ["[", "a, {", "}"],
        });
        let text = String::from_utf8(json(Path::new("x.json"), &value).unwrap()).unwrap();
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&text).unwrap(),
            value
        );
        assert!(text.contains("\n  \"short\": [1.5, -2, null]"), "{text}");
        assert!(text.contains("\n    [0.25, -1e-7],\n"), "{text}");
        assert!(text.contains("\n      \"a\": [1, 2]\n"), "{text}");
        assert!(text.lines().all(|line| line.len() <= WIDTH));
        assert!(
            text.lines().filter(|l| l.contains(".0, ")).count() < 10,
            "{text}"
        );
    }
}
