//! Every command: at least one line for each (`every_command_has_a_line`).

mod qpalgo;
mod qpgen;

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

pub fn cases() -> impl Iterator<Item = &'static Case> {
    qpgen::CASES.iter().chain(&qpalgo::CASES)
}

pub fn program(name: &str) -> &'static str {
    match name {
        "qpgen" => env!("CARGO_BIN_EXE_qpgen"),
        _ => env!("CARGO_BIN_EXE_qpalgo"),
    }
}
