//! What befalls a command: its inputs, its outputs, its streams, its limits.

use std::ffi::OsString;
use std::fs::{self, OpenOptions};
use std::os::unix::ffi::OsStringExt;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

use quadpixel::sampling::hash;

use crate::commands::{Case, Out};
use crate::trial::Trial;

/// A fault, and how a command may end under it.
pub struct Fault {
    pub class: &'static str,
    pub name: &'static str,
    /// False: it does not concern this command.
    pub befall: fn(&mut Trial<'_>) -> bool,
    /// Exit codes that keep the promises.
    pub codes: &'static [i32],
    /// Whether a process that is stopped from outside may leave what it was about to name.
    pub may_leave: bool,
}

const fn fault(
    class: &'static str,
    name: &'static str,
    befall: fn(&mut Trial<'_>) -> bool,
    codes: &'static [i32],
) -> Fault {
    Fault {
        class,
        name,
        befall,
        codes,
        may_leave: false,
    }
}

const REFUSED: &[i32] = &[1, 2];
const ANY: &[i32] = &[0, 1, 2];

pub const FAULTS: [Fault; 25] = [
    fault("none", "sound inputs", |_| true, &[0]),
    fault(
        "input",
        "is missing",
        |t| t.replace_input(|path| fs::remove_file(path).unwrap()),
        REFUSED,
    ),
    fault(
        "input",
        "is empty",
        |t| t.replace_input(|path| fs::write(path, b"").unwrap()),
        REFUSED,
    ),
    fault(
        "input",
        "is a folder",
        |t| {
            t.replace_input(|path| {
                fs::remove_file(path).unwrap();
                fs::create_dir(path).unwrap();
            })
        },
        REFUSED,
    ),
    fault(
        "input",
        "is a pipe",
        |t| {
            t.replace_input(|path| {
                fs::remove_file(path).unwrap();
                assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
            })
        },
        REFUSED,
    ),
    fault(
        "input",
        "leads to /dev/zero",
        |t| {
            t.replace_input(|path| {
                fs::remove_file(path).unwrap();
                symlink("/dev/zero", path).unwrap();
            })
        },
        REFUSED,
    ),
    fault(
        "input",
        "is endless (sparse, 1 TB)",
        |t| {
            t.replace_input(|path| {
                let file = OpenOptions::new().write(true).open(path).unwrap();
                file.set_len(1 << 40).unwrap();
            })
        },
        REFUSED,
    ),
    fault(
        "damage",
        "bytes changed",
        |t| {
            t.damage(|bytes, seed| {
                for k in 0..=hash(seed, &[1]) % 4 {
                    let at = hash(seed, &[2, k]) as usize % bytes.len();
                    bytes[at] ^= 1 << (hash(seed, &[3, k]) % 8);
                }
            })
        },
        ANY,
    ),
    fault(
        "damage",
        "cut off",
        |t| t.damage(|bytes, seed| bytes.truncate(hash(seed, &[4]) as usize % bytes.len())),
        ANY,
    ),
    fault(
        "damage",
        "a part twice",
        |t| {
            t.damage(|bytes, seed| {
                let at = hash(seed, &[5]) as usize % bytes.len();
                bytes.extend_from_within(at..);
            })
        },
        ANY,
    ),
    fault(
        "damage",
        "a number of another size",
        |t| {
            t.damage(|bytes, seed| {
                let digits: Vec<usize> = (0..bytes.len())
                    .filter(|&i| bytes[i].is_ascii_digit())
                    .collect();
                if let Some(&at) = digits.get(hash(seed, &[6]) as usize % digits.len().max(1)) {
                    let odd: [&[u8]; 6] = [
                        b"-1",
                        b"1e308",
                        b"99999999999999999999",
                        b"1e-300",
                        b"nan",
                        b"4294967296",
                    ];
                    let new = odd[hash(seed, &[7]) as usize % odd.len()];
                    bytes.splice(at..=at, new.iter().copied());
                }
            })
        },
        ANY,
    ),
    fault(
        "output",
        "its folder is a file",
        |t| {
            t.move_output(|folder| {
                fs::write(folder.join("blocked"), b"mine").unwrap();
                "blocked/out".into()
            })
        },
        REFUSED,
    ),
    fault(
        "output",
        "is /dev/full",
        |t| t.move_output(|_| "/dev/full".into()),
        REFUSED,
    ),
    fault(
        "output",
        "is a folder of others",
        |t| match t.case.out {
            Out::Folder(name) => {
                fs::create_dir(t.folder().join(name)).unwrap();
                fs::write(t.folder().join(name).join("mine.txt"), b"mine").unwrap();
                true
            }
            _ => false,
        },
        ANY,
    ),
    fault(
        "output",
        "has a name that is no UTF-8",
        |t| t.move_output(|_| OsString::from_vec(b"o\xff.npz".to_vec())),
        &[0],
    ),
    fault(
        "disk",
        "is read-only",
        |t| t.on_disk("mount --bind . . && mount -o remount,bind,ro . && cd \"$PWD\" && "),
        &[0, 1],
    ),
    fault(
        "disk",
        "is full",
        |t| {
            // A disk of 64 kB without a free byte over the inputs: what is written goes there.
            t.on_disk(
                "mkdir ../disk ../work ../both && mount -t tmpfs -o size=64k tmpfs ../disk && \
                 mkdir ../disk/upper ../disk/work && \
                 mount -t overlay overlay -o lowerdir=.,upperdir=../disk/upper,workdir=../disk/work ../both && \
                 cd ../both && { head -c 64k /dev/zero > filler 2> ../said; true; } && ",
            )
        },
        &[0, 1],
    ),
    fault(
        "stream",
        "stdout is /dev/full",
        |t| t.with_stdout("/dev/full"),
        &[1],
    ),
    fault(
        "stream",
        "stderr is /dev/full",
        |t| t.with_stderr("/dev/full"),
        &[0],
    ),
    fault(
        "limit",
        "--threads 1000000",
        |t| t.with_words(&["--threads", "1000000"]),
        &[2],
    ),
    fault(
        "limit",
        "--max-memory 64M",
        |t| t.with_words(&["--max-memory", "64M"]),
        ANY,
    ),
    Fault {
        may_leave: true,
        ..fault(
            "limit",
            "ulimit -v 150000",
            |t| t.within("ulimit -v 150000; "),
            ANY,
        )
    },
    fault("limit", "ulimit -f 1", |t| t.within("ulimit -f 1; "), ANY),
    fault(
        "argument",
        "an option is NaN",
        |t| t.with_value(&["NaN"]),
        REFUSED,
    ),
    fault(
        "argument",
        "an option is a number of another size",
        |t| t.with_value(&["-1", "0", "1e308", "1e-300", "inf", "18446744073709551615"]),
        ANY,
    ),
];

/// The files that a case reads, one by the seed.
pub fn input(case: &Case, seed: u64) -> Option<&'static str> {
    let inputs = case.inputs();
    let number = hash(seed, &[0]) as usize % inputs.len().max(1);
    inputs.get(number).copied()
}

/// Everything below `from` once more at `to`.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let place = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &place),
            false => drop(fs::copy(entry.path(), place).unwrap()),
        }
    }
}
