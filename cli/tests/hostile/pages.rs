//! The table is of every command that there is, and the page of promises says what it tries.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use crate::commands::{Out, cases, program};
use crate::faults::{FAULTS, Fault};

/// Kinds of study without a line: each would take minutes, and does nothing with files and streams that the others do
/// not.
const LONG_STUDIES: [&str; 6] = [
    "cra",
    "flat-field",
    "corrected",
    "size",
    "tungsten",
    "mosaic",
];

/// Every command that has none below it, and every kind of those that ask for one, as `--help` lists them.
fn commands_of(program_name: &str, path: &[String]) -> Vec<Vec<String>> {
    let done = Command::new(program(program_name))
        .args(path)
        .arg("--help")
        .output()
        .unwrap();
    let help = String::from_utf8(done.stdout).unwrap();
    let listed = help.split("\nCommands:\n").nth(1);
    let Some(listed) = listed else {
        return match kinds(&help) {
            none if none.is_empty() => vec![path.to_vec()],
            kinds => kinds
                .into_iter()
                .map(|kind| [path, &[kind]].concat())
                .collect(),
        };
    };
    let names = listed
        .lines()
        .take_while(|line| line.is_empty() || line.starts_with(' '))
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help");
    let below = names.map(|name| [path, &[name.to_owned()]].concat());
    below
        .flat_map(|path| commands_of(program_name, &path))
        .collect()
}

/// The values that the first argument, where it must be given, can have.
fn kinds(help: &str) -> Vec<String> {
    let arguments = help.split("\nArguments:\n").nth(1).unwrap_or_default();
    let arguments = arguments.split("\nOptions:\n").next().unwrap_or_default();
    if !arguments.starts_with("  <") {
        return Vec::new();
    }
    let kind = |line: &str| {
        Some(
            line.trim()
                .strip_prefix("- ")?
                .split_once(':')?
                .0
                .to_owned(),
        )
    };
    arguments.lines().filter_map(kind).collect()
}

#[test]
fn every_command_has_a_line() {
    let mut count = 0;
    for name in ["qpgen", "qpalgo"] {
        for path in commands_of(name, &[]) {
            count += 1;
            let has_line = cases().any(|case| {
                let words = case.words();
                words[0] == name && words[1..].starts_with(&as_words(&path))
            });
            let is_long = path[0] == "study" && LONG_STUDIES.contains(&path[1].as_str());
            assert!(
                has_line != is_long,
                "{name} {path:?}: lines in cli/tests/hostile/commands: {has_line}"
            );
        }
    }
    assert!(count > 32, "{count} commands were found by --help");
}

fn as_words(path: &[String]) -> Vec<&str> {
    path.iter().map(String::as_str).collect()
}

/// Whom a fault concerns.
fn whom(fault: &Fault) -> &'static str {
    match (fault.class, fault.name) {
        ("input" | "damage", _) => "an input",
        ("output", _) => "the output",
        ("disk", _) => "the disk",
        ("stream", "stdout is /dev/full") => "printing",
        _ => "any",
    }
}

fn words_of(codes: &[i32]) -> String {
    let codes: Vec<String> = codes.iter().map(i32::to_string).collect();
    codes.join(" or ")
}

/// The lines of the page that follow from the table.
fn expected() -> Vec<String> {
    let mut lines = vec!["| what befalls a command | exit code |".to_owned()];
    lines.push("|---|---|".to_owned());
    for fault in FAULTS.iter().filter(|fault| fault.class != "none") {
        let codes = match fault.class {
            "disk" => "1; 0 of those that only read".to_owned(),
            _ => words_of(fault.codes),
        };
        lines.push(format!("| {}: {} | {codes} |", whom(fault), fault.name));
    }
    let only_read: BTreeSet<String> = cases()
        .filter(|case| case.out == Out::Nothing)
        .map(|case| format!("`{}`", case.name))
        .collect();
    let only_read: Vec<String> = only_read.into_iter().collect();
    lines.push(format!("Only read: {}.", only_read.join(", ")));
    lines
}

#[test]
fn the_page_of_promises_has_the_exit_codes_of_the_table() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/promises.md");
    // However its lines are broken.
    let flat = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let page = flat(&fs::read_to_string(page).unwrap());
    let missing: Vec<String> = expected()
        .into_iter()
        .filter(|line| !page.contains(&flat(line)))
        .collect();
    assert!(
        missing.is_empty(),
        "docs/promises.md lacks:\n{}",
        missing.join("\n")
    );
}
