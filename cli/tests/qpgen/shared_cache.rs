//! Several processes with one cache: one makes what others wait for, and kills at random instants change no byte.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use quadpixel::sampling::{hash, uniform};

use crate::common::generator::{number_from, send};
use crate::common::small::{SMALL, SMALL_TABLE, with_values};
use crate::common::{files, journal_in, json};

/// Processes at once.
const AT_ONCE: usize = 4;
/// Of two tables, each wanted by half of the processes: some share a journal, some only the folder.
const WAVELENGTHS_NM: [&str; 2] = ["550", "610"];

struct Processes {
    folder: PathBuf,
    running: Vec<Child>,
}

impl Processes {
    fn output(folder: &Path, number: usize) -> PathBuf {
        folder.join(format!("{number}.npz"))
    }

    fn command(folder: &Path, number: usize) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        command.args(SMALL_TABLE);
        let wavelength = WAVELENGTHS_NM[number % WAVELENGTHS_NM.len()];
        command.args(["--wavelength-nm", wavelength, "-o"]);
        command
            .arg(Self::output(folder, number))
            .env("QUADPIXEL_CACHE", folder.join("cache"))
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
    }

    fn new(folder: &Path) -> Self {
        let spawn = |number| Self::command(folder, number).spawn().unwrap();
        Self {
            folder: folder.to_owned(),
            running: (0..AT_ONCE).map(spawn).collect(),
        }
    }

    /// Kills one and starts it again; false where it had come to its end.
    fn kill(&mut self, number: usize) -> bool {
        let child = &mut self.running[number];
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success(), "process {number}: {status}");
            return false;
        }
        child.kill().unwrap();
        child.wait().unwrap();
        self.running[number] = Self::command(&self.folder, number).spawn().unwrap();
        true
    }

    /// To their ends; their tables, and what is in the cache.
    fn finished(mut self) -> (Vec<Vec<u8>>, BTreeMap<String, Vec<u8>>) {
        for (number, child) in self.running.iter_mut().enumerate() {
            let status = child.wait().unwrap();
            assert!(status.success(), "process {number}: {status}");
        }
        let table = |number| fs::read(Self::output(&self.folder, number)).unwrap();
        let kept = files(&self.folder.join("cache"));
        ((0..AT_ONCE).map(table).collect(), kept)
    }
}

/// QUADPIXEL_KILLS: how many kills (6).
#[test]
fn four_processes_with_one_cache_killed_at_any_instant_give_the_same_bytes() {
    let base = tempfile::tempdir().unwrap();
    let folder = |name: &str| {
        let path = base.path().join(name);
        fs::create_dir(&path).unwrap();
        path
    };
    let began = Instant::now();
    let undisturbed = Processes::new(&folder("undisturbed")).finished();
    let seconds = began.elapsed().as_secs_f64();
    assert_eq!(undisturbed.1.len(), WAVELENGTHS_NM.len(), "tables only");
    assert!(undisturbed.0[0] == undisturbed.0[2] && undisturbed.0[1] == undisturbed.0[3]);
    let wanted = number_from("QUADPIXEL_KILLS", 6);
    let (mut killed, mut rounds) = (0, 0);
    while killed < wanted {
        let place = folder(&rounds.to_string());
        let mut processes = Processes::new(&place);
        // Instants over the time of a run; a run is over when all that were asked had come to their ends.
        for instant in 0_u64.. {
            let key = [rounds, instant];
            std::thread::sleep(Duration::from_secs_f64(0.3 * seconds * uniform(5, &key)));
            let number = hash(6, &key) as usize % AT_ONCE;
            let hit = processes.kill(number);
            killed += usize::from(hit);
            if !hit || killed >= wanted {
                break;
            }
        }
        let (tables, kept) = processes.finished();
        assert!(tables == undisturbed.0, "round {rounds}: other tables");
        let tables_kept: Vec<_> = kept.iter().filter(|(n, _)| n.ends_with(".npz")).collect();
        assert!(
            tables_kept.into_iter().eq(&undisturbed.1),
            "round {rounds}: other tables in the cache"
        );
        rounds += 1;
    }
    println!(
        "{killed} kills in {rounds} rounds of {AT_ONCE} processes; a round takes {seconds:.2} s"
    );
}

fn qpgen(cache: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    command.args(arguments).env("QUADPIXEL_CACHE", cache);
    command
}

#[test]
fn two_processes_that_want_the_same_table_make_it_once() {
    let folder = tempfile::tempdir().unwrap();
    let spawn = |name: &str| {
        let output = folder.path().join(name);
        let output = ["--json", "-o", output.to_str().unwrap()];
        let arguments = [&SMALL_TABLE[..], &output].concat();
        let mut command = qpgen(&folder.path().join("cache"), &arguments);
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let both = ["a.npz", "b.npz"]
        .map(spawn)
        .map(|child| json(&child.wait_with_output().unwrap()));
    let made = both
        .iter()
        .filter(|said| said["from_cache"] == false)
        .count();
    assert_eq!(made, 1, "{both:?}");
}

#[test]
fn who_waits_for_the_table_of_another_says_so_and_stops_at_the_first_signal() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let config = folder.path().join("c.toml");
    let values = [
        ("response.model", "\"wave\""),
        ("response.pixels", "[\"2.8um\"]"),
        ("response.preset", "\"draft\""),
        ("sensor.pitch_um", ""),
    ];
    fs::write(&config, with_values(SMALL, &values)).unwrap();
    let dataset = |name: &str| {
        let out = folder.path().join(name);
        let [config, out] = [&config, &out].map(|path| path.to_str().unwrap());
        let mut command = qpgen(&cache, &["dataset", "--config", config, "--out", out]);
        command.stdout(Stdio::null());
        command
    };
    // Whoever makes it holds its journal, and comes no further.
    let mut maker = dataset("maker").stderr(Stdio::null()).spawn().unwrap();
    while journal_in(&cache).is_none_or(|text| text.is_empty()) {
        let ended = maker.try_wait().unwrap();
        assert!(ended.is_none(), "it ended before it could be stopped");
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    send(&maker, "STOP");
    let mut waiting = dataset("waiting").stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(waiting.stderr.take().unwrap())
        .lines()
        .map(Result::unwrap);
    let said =
        lines.find(|line| line.contains("waiting for another process that makes this table"));
    assert!(said.is_some());
    send(&waiting, "TERM");
    assert_eq!(waiting.wait().unwrap().code(), Some(1));
    let rest: Vec<String> = lines.collect();
    let stopped = rest
        .iter()
        .any(|line| line.contains("stopped while waiting"));
    assert!(stopped, "{rest:?}");
    maker.kill().unwrap();
    maker.wait().unwrap();
}
