//! Every command: at least one line for each (`every_command_has_a_line`).

mod qpalgo;
mod qpgen;

use std::process::Command;

/// A command line whose words are relative to the folder of a trial.
pub struct Case {
    pub name: &'static str,
    line: &'static str,
    inputs: &'static str,
    pub out: Out,
}

/// What it writes, by its word on the command line.
#[derive(Clone, Copy, PartialEq)]
pub enum Out {
    Nothing,
    /// What it reads is changed, or what it writes is gone at its end.
    InPlace,
    File(&'static str),
    Folder(&'static str),
}

/// One line; words and files are separated by spaces.
const fn case(name: &'static str, line: &'static str, inputs: &'static str, out: Out) -> Case {
    Case {
        name,
        line,
        inputs,
        out,
    }
}

impl Case {
    /// The program's name, and its arguments.
    pub fn words(&self) -> Vec<&'static str> {
        self.line.split_whitespace().collect()
    }

    /// Files that it reads and that a stranger may have made.
    pub fn inputs(&self) -> Vec<&'static str> {
        self.inputs.split_whitespace().collect()
    }
}

/// Options that take a value, as a command's `--help` lists them.
pub fn options_with_values(case: &Case) -> Vec<String> {
    let words = case.words();
    let names = words[1..].iter().take_while(|word| !word.starts_with('-'));
    let mut command = Command::new(program(words[0]));
    // Words behind the command's name are no matter to `--help`.
    let done = command.args(names).arg("--help").output().unwrap();
    let help = String::from_utf8(done.stdout).unwrap();
    let option = |line: &str| {
        let (_, name) = line.split_once("--")?;
        let (name, _) = name.split_once(" <")?;
        let in_front = line.trim_start().starts_with('-');
        (in_front && !name.contains(' ')).then(|| name.to_owned())
    };
    help.lines().filter_map(option).collect()
}

pub fn cases() -> impl Iterator<Item = &'static Case> {
    qpgen::CASES.iter().chain(&qpalgo::CASES)
}

pub fn program(name: &str) -> &'static str {
    match name {
        "qpgen" => env!("CARGO_BIN_EXE_qpgen"),
        _ => env!("CARGO_BIN_EXE_qpalgo"),
    }
}
