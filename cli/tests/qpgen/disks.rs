//! Disks that are full, read-only or gone, and names that would lead elsewhere: exit code 1 or 2, and what is written
//! stays valid.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![cfg(unix)]

use crate::common;

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use common::generator::{Generator, number_from};
use common::{files, qpgen, said};

/// Runs a shell command as root, if this is root; false where it cannot be done.
fn as_root(command: &str) -> bool {
    let done = Command::new("sh")
        .args(["-c", command])
        .stderr(Stdio::null())
        .status();
    done.is_ok_and(|status| status.success())
}

/// A file system of its own in memory; unmounted when dropped.
struct Mount<'a>(&'a Path);

impl<'a> Mount<'a> {
    /// `None` where nobody lets us mount.
    fn new(path: &'a Path, kilobytes: usize) -> Option<Self> {
        fs::create_dir_all(path).unwrap();
        let command = format!(
            "mount -t tmpfs -o size={kilobytes}k tmpfs {}",
            path.display()
        );
        as_root(&command).then_some(Self(path))
    }

    fn again(&self, options: &str) {
        assert!(as_root(&format!(
            "mount -o remount,{options} {}",
            self.0.display()
        )));
    }
}

impl Drop for Mount<'_> {
    fn drop(&mut self) {
        as_root(&format!("umount -l {}", self.0.display()));
    }
}

fn failed(done: &Output, what: &str) {
    let text = said(done);
    assert_eq!(done.status.code(), Some(1), "{text}");
    assert!(text.contains(what) && !text.contains("panicked"), "{text}");
}

/// Nothing but whole samples, which are those of `whole`.
fn valid_so_far(out: &Path, whole: &Path) -> usize {
    let whole = files(&whole.join("samples"));
    let there = files(&out.join("samples"));
    for (name, bytes) in &there {
        assert!(whole.get(name) == Some(bytes), "{name}");
    }
    assert_eq!(there.len() % 13, 0, "{:?}", there.keys());
    there.len() / 13
}

#[test]
fn a_full_disk_keeps_whole_samples_and_the_run_goes_on_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 5);
    generator.make("whole", &[]);
    let whole = folder.path().join("whole");
    let small = folder.path().join("small");
    let Some(disk) = Mount::new(&small, 1000) else {
        println!("skipped: no right to mount; a limit on the size of files stands in below");
        return;
    };
    failed(
        &generator.command("small/out", &[]).output().unwrap(),
        "No space left",
    );
    let done = valid_so_far(&small.join("out"), &whole);
    assert!((1..5).contains(&done), "{done}");
    // Still no room: no worse.
    failed(
        &generator.command("small/out", &[]).output().unwrap(),
        "No space left",
    );
    assert_eq!(valid_so_far(&small.join("out"), &whole), done);
    disk.again("size=20000k");
    generator.make("small/out", &[]);
    assert!(files(&small.join("out")) == files(&whole));

    // Read-only from now on: a grown dataset is refused, the old one stays.
    disk.again("ro");
    failed(
        &generator
            .command("small/out", &["--count", "6"])
            .output()
            .unwrap(),
        "Read-only",
    );
    assert!(files(&small.join("out")) == files(&whole));
    let check = qpgen(&["check", small.join("out").to_str().unwrap()]);
    assert!(check.status.success(), "{check:?}");
}

#[test]
fn a_limit_on_the_size_of_files_is_a_failure_and_leaves_nothing_half_made() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    // Blocks of 512 bytes; the signal that comes with the limit is ignored, so that writing fails as on a full disk.
    let mut shell = Command::new("sh");
    let command = "trap '' XFSZ; ulimit -f 60; exec \"$0\" \"$@\"";
    let dataset = generator.command("out", &[]);
    shell
        .args(["-c", command])
        .arg(dataset.get_program())
        .args(dataset.get_args());
    failed(&shell.output().unwrap(), "File too large");
    assert_eq!(files(&folder.path().join("out/samples")).len(), 0);
    generator.make("out", &[]);
    let check = qpgen(&["check", folder.path().join("out").to_str().unwrap()]);
    assert!(check.status.success(), "{check:?}");
}

#[test]
fn a_folder_that_goes_away_ends_the_run_and_nothing_is_written_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 10_000);
    let point = folder.path().join("point");
    // Unmounted where we may, else moved away: under the same name there is then another folder.
    let mount = Mount::new(&point, 50_000);
    fs::create_dir_all(point.join("out")).unwrap();
    let mut run = generator
        .command("point/out", &[])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !point.join("out/samples/000000").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    if mount.is_some() {
        drop(mount);
    } else {
        fs::rename(point.join("out"), folder.path().join("moved")).unwrap();
    }
    let status = run.wait().unwrap();
    let text = std::io::read_to_string(run.stderr.take().unwrap()).unwrap();
    assert_eq!(status.code(), Some(1), "{text}");
    assert!(text.contains("point/out"), "{text}");
    assert_eq!(files(&point).len(), 0, "something was written in its place");
}

#[test]
fn links_in_the_folder_of_a_dataset_do_not_lead_out_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    let elsewhere = folder.path().join("elsewhere");
    fs::create_dir(&elsewhere).unwrap();
    fs::write(elsewhere.join("precious"), b"x").unwrap();
    generator.make("whole", &[]);
    let whole = files(&folder.path().join("whole"));
    let out = folder.path().join("out");
    // Folders, samples and files that this program writes, each a link in its turn.
    for (name, refused) in [
        ("samples", true),
        ("samples/000001", true),
        ("samples/.tmp-000001", false),
        ("splits", true),
        ("plots", true),
        ("dataset.json", false),
        ("index.html", true),
        ("run.json", true),
    ] {
        generator.make("out", &["--count", "1"]);
        let place = out.join(name);
        match place.symlink_metadata() {
            Ok(data) if data.is_dir() => fs::rename(&place, elsewhere.join("stolen")).unwrap(),
            Ok(_) => fs::remove_file(&place).unwrap(),
            Err(_) => {}
        }
        let target = match name {
            "dataset.json" | "index.html" | "run.json" => elsewhere.join("precious"),
            _ => elsewhere.clone(),
        };
        symlink(&target, &place).unwrap();
        let before = files(&elsewhere);
        let done = generator.command("out", &[]).output().unwrap();
        assert!(files(&elsewhere) == before, "{name} led elsewhere");
        // What is there of a finished dataset is read to see whether it is the same: a link in its place is no dataset.
        let code = done.status.code();
        if refused || name == "dataset.json" {
            assert!(matches!(code, Some(1 | 2)), "{name}: {}", said(&done));
        } else {
            assert_eq!(code, Some(0), "{name}: {}", said(&done));
            assert!(files(&out) == whole, "{name}");
        }
        fs::remove_dir_all(&out).unwrap();
        let _ = fs::remove_dir_all(elsewhere.join("stolen"));
    }
}

#[test]
fn names_in_configurations_and_pixels_write_nothing_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let work = root.join("a/b");
    fs::create_dir_all(&work).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        let cache = root.join("cache");
        command
            .args(arguments)
            .current_dir(&work)
            .env("QUADPIXEL_CACHE", cache)
            .output()
            .unwrap()
    };
    // A pixel whose name is a path.
    let pixel = qpgen(&["response", "--pixel", "1.6um", "--print-pixel"]).stdout;
    let pixel = String::from_utf8(pixel).unwrap();
    let name = pixel.lines().find(|line| line.starts_with("name")).unwrap();
    for evil in ["../../evil", "/tmp/quadpixel-evil", "..", ""] {
        fs::write(
            work.join("p.toml"),
            pixel.replace(name, &format!("name = {evil:?}")),
        )
        .unwrap();
        let before = files(root).len();
        let done = run(&[
            "response",
            "--pixel",
            "p.toml",
            "--model",
            "geometric",
            "--grid",
            "2",
        ]);
        let after = files(root);
        let outside: Vec<&String> = after
            .keys()
            .filter(|name| !name.starts_with("a/b/") && !name.starts_with("cache/"))
            .collect();
        assert!(outside.is_empty(), "{evil:?}: {outside:?}");
        assert!(
            done.status.code() == Some(2) || after.len() > before,
            "{evil:?}: {done:?}"
        );
    }
    assert!(!Path::new("/tmp/quadpixel-evil-geometric.npz").exists());
    // Charts, lenses and pixels that lead out are files to read, which are not there.
    let wave = ("response.model", r#""wave""#);
    for (place, evil, more) in [
        ("scene.charts", r#"["noise", "../../evil.png"]"#, None),
        ("lens.names", r#"["../../evil.json"]"#, None),
        ("response.pixels", r#"["../../evil.toml"]"#, Some(wave)),
    ] {
        let values = [("count", "2"), (place, evil)].into_iter().chain(more);
        let generator = Generator::with_values(root, &values.collect::<Vec<_>>());
        let done = generator.command("a/b/out", &[]).output().unwrap();
        assert_eq!(done.status.code(), Some(2), "{evil}: {done:?}");
        let after = files(root);
        let known = |name: &String| {
            name == "config.toml" || name.starts_with("a/b/") || name.starts_with("cache/")
        };
        assert!(after.keys().all(known), "{evil}: {:?}", after.keys());
        let _ = fs::remove_dir_all(work.join("out"));
    }
}

/// QUADPIXEL_FLIPS: how many bytes (40), spread over the files of a sample so that each file has some.
#[test]
fn a_changed_byte_anywhere_in_a_sample_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 1);
    generator.make("out", &[]);
    let out = folder.path().join("out");
    let sample = files(&out.join("samples/000000"));
    let flips = number_from("QUADPIXEL_FLIPS", 40);
    let names: Vec<&String> = sample.keys().collect();
    for flip in 0..flips {
        let name = names[flip % names.len()];
        let sound = &sample[name];
        let place = quadpixel::sampling::uniform(3, &[flip as u64]) * sound.len() as f64;
        let mut broken = sound.clone();
        broken[place as usize] ^= 1 << (flip % 8);
        let path = out.join("samples/000000").join(name);
        fs::write(&path, &broken).unwrap();
        let report = quadpixel_datasets::check_dataset(&out, &mut |_| {});
        let found = report
            .findings
            .iter()
            .any(|f| f.path.ends_with(name.as_str()));
        assert!(found, "{name}, byte {place}: {:?}", report.findings);
        fs::write(&path, sound).unwrap();
    }
    let report = quadpixel_datasets::check_dataset(&out, &mut |_| {});
    assert_eq!(report.findings, []);
}
