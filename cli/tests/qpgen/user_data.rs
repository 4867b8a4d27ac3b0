//! What others put where we write: it stays, to the byte, and the command says so; what is whole stays whole.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![cfg(unix)]

use crate::common;

use std::fs;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use common::generator::{Generator, number_from, send};
use common::{files, qpgen, refused, said};

/// Files of ours in a dataset, and one of others in each of its folders of pages.
const PLACES: [&str; 6] = [
    "README.md",
    "index.html",
    "plots/focus.svg",
    "plots/mine.svg",
    "splits/train.txt",
    "splits/mine.txt",
];

fn make_folder_and_write(path: &Path, bytes: &[u8]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn whole(out: &Path) {
    let check = qpgen(&["check", out.to_str().unwrap()]);
    assert!(check.status.success(), "{check:?}");
}

#[test]
fn pages_of_others_stay_and_force_replaces_them() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 1);
    let out = folder.path().join("out");
    let text = out.to_str().unwrap();
    generator.make("out", &[]);
    let made = files(&out);
    for place in PLACES {
        make_folder_and_write(&out.join(place), b"mine");
        let before = files(&out);
        let again = generator.command("out", &[]).output().unwrap();
        let grown = generator
            .command("out", &["--count", "2"])
            .output()
            .unwrap();
        let mut tried = vec![grown];
        // A file that we do not write in this folder is in nobody's way until the lists are tidied.
        if place != "splits/train.txt" && place != "splits/mine.txt" {
            tried.push(qpgen(&["preview", text]));
        }
        tried.push(again);
        for done in &tried {
            refused(done, place);
            assert!(said(done).contains("--force"), "{}", said(done));
        }
        assert!(files(&out) == before, "{place}");
        generator.make("out", &["--force"]);
        assert!(files(&out) == made, "{place}");
    }
}

#[test]
fn a_finished_dataset_is_only_read_by_the_same_command() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    generator.make("out", &[]);
    let out = folder.path().join("out");
    let times = |root: &Path| {
        let mut times = Vec::new();
        let mut folders = vec![root.to_path_buf()];
        while let Some(folder) = folders.pop() {
            times.push((
                folder.clone(),
                folder.metadata().unwrap().modified().unwrap(),
            ));
            for entry in fs::read_dir(&folder).unwrap() {
                let entry = entry.unwrap();
                let data = entry.metadata().unwrap();
                match data.is_dir() {
                    true => folders.push(entry.path()),
                    false => times.push((entry.path(), data.modified().unwrap())),
                }
            }
        }
        times.sort();
        times
    };
    let before = times(&out);
    generator.make("out", &[]);
    assert!(qpgen(&["preview", out.to_str().unwrap()]).status.success());
    assert!(times(&out) == before, "something was written");
}

/// QUADPIXEL_KILLS: how often (10).
#[test]
fn killed_in_a_preview_or_a_second_run_a_whole_dataset_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    generator.make("out", &[]);
    let out = folder.path().join("out");
    let made = files(&out);
    for kill in 0..number_from("QUADPIXEL_KILLS", 10) {
        // As an earlier version wrote it: its page has another content, and is ours by its hash.
        let mut manifest: quadpixel_datasets::DatasetManifest =
            serde_json::from_slice(&made["dataset.json"]).unwrap();
        for page in ["index.html", "README.md", "plots/focus.svg"] {
            fs::write(out.join(page), b"earlier").unwrap();
            let entry = manifest.files.iter_mut().find(|e| e.path == page).unwrap();
            *entry = quadpixel_datasets::FileEntry::new(page, b"earlier");
        }
        fs::write(
            out.join("dataset.json"),
            serde_json::to_vec_pretty(&manifest).unwrap(),
        )
        .unwrap();
        whole(&out);
        let mut command = match kill % 2 {
            0 => {
                let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
                command.arg("preview").arg(&out);
                command
            }
            _ => generator.command("out", &[]),
        };
        let mut child = command
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let instant = quadpixel::sampling::uniform(11, &[kill as u64]);
        std::thread::sleep(Duration::from_secs_f64(0.06 * instant));
        child.kill().unwrap();
        child.wait().unwrap();
        whole(&out);
        assert!(qpgen(&["preview", out.to_str().unwrap()]).status.success());
        assert!(files(&out) == made, "kill {kill}");
    }
}

/// QUADPIXEL_PREVIEWS: how many runs with previews beside them (2).
#[test]
fn previews_beside_a_run_disturb_neither() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 4);
    generator.make("whole", &[]);
    let whole = files(&folder.path().join("whole"));
    let out = folder.path().join("out");
    let (mut previews, mut failed) = (0, Vec::new());
    for _ in 0..number_from("QUADPIXEL_PREVIEWS", 2) {
        let mut run = generator
            .command("out", &[])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        while !out.join("run.json").exists() {
            std::thread::sleep(Duration::from_millis(1));
        }
        while run.try_wait().unwrap().is_none() {
            let preview = qpgen(&["preview", out.to_str().unwrap()]);
            previews += 1;
            if !preview.status.success() {
                failed.push(said(&preview));
            }
        }
        let run = run.wait_with_output().unwrap();
        assert!(run.status.success(), "{}", said(&run));
        assert!(files(&out) == whole, "{:?}", files(&out).keys());
        fs::remove_dir_all(&out).unwrap();
    }
    assert!(
        failed.is_empty(),
        "{} of {previews} previews: {failed:?}",
        failed.len()
    );
}

#[test]
fn a_merge_takes_nothing_of_others_with_the_shards() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    generator.make("whole", &[]);
    let out = folder.path().join("out");
    let text = out.to_str().unwrap();
    for shard in ["1/2", "2/2"] {
        generator.make("out", &["--shard", shard]);
    }
    assert!(
        qpgen(&["preview", out.join("shard-1-of-2").to_str().unwrap()])
            .status
            .success()
    );
    for place in ["shard-2-of-2/notes.txt", "shard-1-of-2/samples/mine/a.txt"] {
        make_folder_and_write(&out.join(place), b"mine");
        let before = files(&out);
        let named = place.split("/a.txt").next().unwrap();
        refused(&qpgen(&["merge", text]), named);
        assert!(files(&out) == before, "{place}");
        match place.ends_with("a.txt") {
            true => fs::remove_dir_all(out.join(named)).unwrap(),
            false => fs::remove_file(out.join(place)).unwrap(),
        }
    }
    // What a link leads to is not copied.
    let elsewhere = folder.path().join("secret");
    fs::write(&elsewhere, b"secret").unwrap();
    let sample = out.join("shard-1-of-2/samples/000000");
    let kept = fs::read(sample.join("depth.exr")).unwrap();
    fs::remove_file(sample.join("depth.exr")).unwrap();
    symlink(&elsewhere, sample.join("depth.exr")).unwrap();
    let from = ["shard-1-of-2", "shard-2-of-2"].map(|name| out.join(name).display().to_string());
    let joined = folder.path().join("joined");
    let merged = qpgen(&[
        "merge",
        joined.to_str().unwrap(),
        "--from",
        &from[0],
        &from[1],
    ]);
    refused(&merged, "depth.exr");
    fs::remove_file(sample.join("depth.exr")).unwrap();
    fs::write(sample.join("depth.exr"), kept).unwrap();
    // A number of shards that no dataset has is no reason to count to it.
    let run = out.join("shard-2-of-2/run.json");
    let record = fs::read_to_string(&run).unwrap();
    fs::write(
        &run,
        record.replace("\"2/2\"", "\"2/18446744073709551615\""),
    )
    .unwrap();
    refused(&qpgen(&["merge", text]), "more shards");
    fs::write(&run, record).unwrap();
    assert!(qpgen(&["merge", text]).status.success());
    assert!(files(&out) == files(&folder.path().join("whole")));
    // Merged already, as after a kill in the last check.
    let again = qpgen(&["merge", text]);
    assert!(again.status.success(), "{again:?}");
}

#[test]
fn devices_and_pipes_stay_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let [pipe, null] = ["pipe", "null"].map(|name| folder.path().join(name));
    let made = Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    symlink("/dev/null", &null).unwrap();
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read_to_string(pipe).unwrap()
    });
    let layout = |path: &Path| qpgen(&["lens", "layout", "-o", path.to_str().unwrap()]);
    assert!(layout(&pipe).status.success());
    assert!(reader.join().unwrap().contains("</svg>"));
    assert!(pipe.symlink_metadata().unwrap().file_type().is_fifo());
    assert!(layout(&null).status.success());
    assert!(null.symlink_metadata().unwrap().is_symlink());
    let printed = layout(Path::new("/dev/stdout"));
    assert!(printed.status.success());
    assert!(String::from_utf8_lossy(&printed.stdout).contains("</svg>"));
}

#[test]
fn a_signal_ends_an_export_and_an_estimate_and_nothing_half_made_stays() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 12);
    generator.make("data", &[]);
    let data = folder.path().join("data");
    let export = |out: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        command
            .arg("export")
            .arg(&data)
            .args(["--layout", "dpdd", "--threads", "1", "-o"])
            .arg(out);
        command
    };
    let estimate = |out: &Path| {
        let mut command = generator.command("unused", &["--estimate"]);
        command
            .args(["--threads", "1"])
            .current_dir(out.parent().unwrap());
        command
    };
    for name in ["e", "unused"] {
        for _ in 0..3 {
            let out = folder.path().join(name);
            let mut command = match name {
                "e" => export(&out),
                _ => estimate(&out),
            };
            let mut child = command
                .stdout(Stdio::null())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            let begun = || {
                let entries = fs::read_dir(folder.path()).unwrap().flatten();
                let mut names = entries.map(|e| e.file_name().to_string_lossy().into_owned());
                names.any(|n| {
                    n.starts_with(&format!("{name}.tmp-"))
                        || n.starts_with(&format!("{name}-estimate-"))
                })
            };
            while !begun() && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_micros(200));
            }
            send(&child, "INT");
            let done = child.wait_with_output().unwrap();
            if done.status.code() == Some(1) {
                assert!(
                    said(&done).contains("stopped by a signal"),
                    "{}",
                    said(&done)
                );
                assert!(!out.exists());
            } else {
                assert!(done.status.success(), "{:?} {}", done.status, said(&done));
                let _ = fs::remove_dir_all(&out);
            }
            assert!(!begun(), "{name}: something half made stays");
        }
    }
}
