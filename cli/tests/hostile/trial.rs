//! One command under one fault, and whether it kept the promises.

use std::ffi::OsString;
use std::fs::{self, File};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use quadpixel::sampling::hash;

use crate::commands::{Case, Out, options_with_values, program};
use crate::faults::{Fault, copy, input};

/// Longer than any command needs on its small inputs: of processor time, and of waiting without any. On a machine that
/// others keep busy the clock on the wall tells nothing.
const PATIENCE: Duration = Duration::from_secs(60);

pub struct Trial<'a> {
    pub case: &'a Case,
    folder: tempfile::TempDir,
    seed: u64,
    words: Vec<OsString>,
    stdout: PathBuf,
    stderr: PathBuf,
    /// What a shell does before the command.
    before: String,
    /// In mounts of its own, which are gone with it.
    has_mounts: bool,
    /// Exit codes in the place of the fault's.
    codes: Option<&'static [i32]>,
}

impl<'a> Trial<'a> {
    pub fn new(case: &'a Case, base: &Path, seed: u64) -> Self {
        let folder = tempfile::tempdir().unwrap();
        copy(base, &folder.path().join("in"));
        // Somebody's, beside everything: no command touches it.
        fs::write(folder.path().join("in/mine.txt"), b"mine").unwrap();
        Self {
            case,
            stdout: folder.path().join("stdout"),
            stderr: folder.path().join("stderr"),
            folder,
            seed,
            words: case.words().into_iter().map(OsString::from).collect(),
            before: String::new(),
            has_mounts: false,
            codes: None,
        }
    }

    pub fn folder(&self) -> PathBuf {
        self.folder.path().join("in")
    }

    pub fn replace_input(&mut self, replace: impl Fn(&Path)) -> bool {
        let Some(name) = input(self.case, self.seed) else {
            return false;
        };
        replace(&self.folder().join(name));
        true
    }

    pub fn damage(&mut self, damage: impl Fn(&mut Vec<u8>, u64)) -> bool {
        let seed = self.seed;
        self.replace_input(|path| {
            let mut bytes = fs::read(path).unwrap();
            damage(&mut bytes, seed);
            fs::write(path, bytes).unwrap();
        })
    }

    /// Another name in the place of the output's.
    pub fn move_output(&mut self, name: impl Fn(&Path) -> OsString) -> bool {
        let (Out::File(out) | Out::Folder(out)) = self.case.out else {
            return false;
        };
        let new = name(&self.folder());
        let Some(word) = self.words.iter_mut().find(|word| *word == out) else {
            return false;
        };
        *word = new;
        true
    }

    pub fn with_stdout(&mut self, path: &str) -> bool {
        self.stdout = path.into();
        true
    }

    pub fn with_stderr(&mut self, path: &str) -> bool {
        self.stderr = path.into();
        true
    }

    pub fn with_words(&mut self, words: &[&str]) -> bool {
        self.words.extend(words.iter().map(OsString::from));
        true
    }

    /// One of the command's options, by the seed, with one of the values; not those that name an output, and not the
    /// number of a hole in a depth, which may be any.
    pub fn with_value(&mut self, values: &[&str]) -> bool {
        let mut options = options_with_values(self.case);
        options.retain(|name| !["out", "output", "keep-rays", "hole"].contains(&name.as_str()));
        let option = format!(
            "--{}",
            options[hash(self.seed, &[8]) as usize % options.len()]
        );
        let value = values[hash(self.seed, &[9]) as usize % values.len()];
        // In the place of what the line has for it.
        if let Some(at) = self.words.iter().position(|word| *word == *option) {
            self.words.drain(at..at + 2);
        }
        self.words.push(format!("{option}={value}").into());
        true
    }

    pub fn within(&mut self, before: &str) -> bool {
        self.before = before.into();
        true
    }

    /// As [`Self::within`], among mounts of its own: a disk that fails what writes, and nothing else.
    pub fn on_disk(&mut self, before: &str) -> bool {
        self.has_mounts = true;
        self.codes = Some(match self.case.out {
            Out::Nothing => &[0],
            _ => &[1],
        });
        may_mount() && self.within(before)
    }

    /// Runs it: its exit code, or what promise was broken.
    pub fn run(self, fault: &Fault) -> Result<i32, String> {
        let open = |path: &Path| {
            File::options()
                .write(true)
                .create(true)
                .truncate(false)
                .open(path)
                .unwrap()
        };
        let mut command = match self.has_mounts {
            true => Command::new("unshare"),
            false => Command::new("sh"),
        };
        if self.has_mounts {
            command.args(["--mount", "sh"]);
        }
        command.args(["-c", &format!("{}exec \"$0\" \"$@\"", self.before)]);
        command
            .arg(program(self.case.words()[0]))
            .args(&self.words[1..])
            .current_dir(self.folder());
        command.env("QUADPIXEL_CACHE", self.folder.path().join("cache"));
        command
            .stdin(Stdio::null())
            .stdout(open(&self.stdout))
            .stderr(open(&self.stderr));
        let mut child = command.spawn().unwrap();
        let mut pace = Pace::new(child.id());
        let status = loop {
            match child.try_wait().unwrap() {
                Some(status) => break status,
                None if pace.is_of_one_that_hangs() => {
                    child.kill().unwrap();
                    child.wait().unwrap();
                    return Err(format!("hangs: {:?} of work, or without any", PATIENCE));
                }
                None => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        let said = match self.stderr.starts_with("/dev") {
            true => String::new(),
            false => String::from_utf8_lossy(&fs::read(&self.stderr).unwrap()).into_owned(),
        };
        let broken = |what: String| Err(format!("{what}; it said: {}", said.trim()));
        if said.contains("panicked") {
            return broken("panics".into());
        }
        let codes = self.codes.unwrap_or(fault.codes);
        let code = match status.code() {
            Some(code) if codes.contains(&code) => code,
            Some(code) => return broken(format!("exit code {code}, not of {codes:?}")),
            None => return broken(format!("ends by signal {:?}", status.signal())),
        };
        let silent = said.trim().is_empty() && !self.stderr.starts_with("/dev");
        if code != 0 && silent {
            return broken("fails without a word".into());
        }
        if fs::read(self.folder().join("mine.txt")).ok().as_deref() != Some(b"mine") {
            return broken("a file of others is gone".into());
        }
        if let Out::Folder(name) = self.case.out {
            let theirs = self.folder().join(name).join("mine.txt");
            let given = fault.name.contains("of others");
            if given && fs::read(theirs).ok().as_deref() != Some(b"mine") {
                return broken("a file of others in the output folder is gone".into());
            }
        }
        match leftover(&self.folder()).filter(|_| !fault.may_leave) {
            Some(path) => broken(format!("leaves {}", path.display())),
            None => Ok(code),
        }
    }
}

/// How a process gets on.
struct Pace {
    process: u32,
    worked: Duration,
    last: Instant,
}

impl Pace {
    fn new(process: u32) -> Self {
        Self {
            process,
            worked: Duration::ZERO,
            last: Instant::now(),
        }
    }

    fn is_of_one_that_hangs(&mut self) -> bool {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.process)).unwrap_or_default();
        // Behind the name, which is in brackets: fields 14 and 15 of proc(5), in hundredths of a second.
        let fields = stat.rsplit(") ").next().unwrap_or_default();
        let ticks = fields.split(' ').skip(11).take(2);
        let ticks: u64 = ticks.filter_map(|field| field.parse::<u64>().ok()).sum();
        let worked = Duration::from_millis(10 * ticks);
        if worked > self.worked {
            self.worked = worked;
            self.last = Instant::now();
        }
        self.worked > PATIENCE || self.last.elapsed() > PATIENCE
    }
}

/// Whether this process may mount, in a name space of its own.
pub fn may_mount() -> bool {
    static ANSWER: std::sync::OnceLock<bool> = std::sync::OnceLock::new();
    *ANSWER.get_or_init(|| {
        let tried = Command::new("unshare")
            .args(["--mount", "mount", "-t", "tmpfs", "tmpfs", "/tmp"])
            .stderr(Stdio::null())
            .status();
        tried.is_ok_and(|status| status.success())
    })
}

/// Something half made.
fn leftover(folder: &Path) -> Option<PathBuf> {
    for entry in fs::read_dir(folder).ok()?.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        if name.contains(".tmp-") || name.contains("-estimate-") {
            return Some(path);
        }
        if entry.file_type().is_ok_and(|kind| kind.is_dir())
            && let Some(found) = leftover(&path)
        {
            return Some(found);
        }
    }
    None
}
