//! A dataset in the making as a process, shared among threads and machines. Small samples; larger counts by environment
//! variables.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::fs;
use std::process::Stdio;
use std::time::Duration;

use common::generator::{Generator, number_from};
use common::{files, qpgen, said};

const SAMPLES: usize = 5;

#[test]
fn any_number_of_threads_and_any_split_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), SAMPLES);
    generator.make("whole", &["--threads", "1"]);
    let whole = files(&folder.path().join("whole"));
    for threads in ["2", "3"] {
        generator.make("threads", &["--threads", threads]);
        assert!(
            files(&folder.path().join("threads")) == whole,
            "{threads} threads"
        );
        fs::remove_dir_all(folder.path().join("threads")).unwrap();
    }
    for split in [1, 2, 5] {
        let out = folder.path().join("split");
        for part in (1..=split).rev() {
            generator.make("split", &["--shard", &format!("{part}/{split}")]);
        }
        if split > 1 {
            let merged = qpgen(&["merge", out.to_str().unwrap()]);
            assert!(merged.status.success(), "{merged:?}");
        }
        assert!(files(&out) == whole, "{split} shards");
        fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_failed_shard_is_named_and_run_again_alone() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), SAMPLES);
    generator.make("whole", &[]);
    let out = folder.path().join("out");
    let text = out.to_str().unwrap();
    generator.make("out", &["--shard", "1/3"]);
    generator.make("out", &["--shard", "3/3"]);
    fs::remove_dir_all(out.join("shard-3-of-3/samples/000002")).unwrap();
    let before = files(&out);
    let merged = qpgen(&["merge", text]);
    let told = said(&merged);
    assert_eq!(merged.status.code(), Some(1), "{told}");
    assert!(
        told.contains("shard 2/3: 2 samples") && told.contains("shard 3/3: 1 samples"),
        "{told}"
    );
    assert!(files(&out) == before, "a refused merge changed something");

    // As a scheduler would run them: Slurm's numbers from 1, Kubernetes' from 0.
    let slurm = [
        ("SLURM_ARRAY_TASK_ID", "2"),
        ("SLURM_ARRAY_TASK_MIN", "1"),
        ("SLURM_ARRAY_TASK_COUNT", "3"),
    ];
    let kubernetes = [("JOB_COMPLETION_INDEX", "2"), ("QUADPIXEL_SHARDS", "3")];
    for variables in [slurm.as_slice(), &kubernetes] {
        let mut command = generator.command("out", &[]);
        let done = command.envs(variables.iter().copied()).output().unwrap();
        assert!(
            done.status.success() && said(&done).contains("environment"),
            "{done:?}"
        );
    }
    let merged = qpgen(&["merge", text]);
    assert!(merged.status.success(), "{merged:?}");
    let whole = files(&folder.path().join("whole"));
    assert!(files(&out) == whole);

    // Shards that lie elsewhere are copied, and stay.
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    generator.make("a", &["--shard", "1/2"]);
    generator.make("b", &["--shard", "2/2"]);
    let before = (files(&a), files(&b));
    let from = [a.join("shard-1-of-2"), b.join("shard-2-of-2")];
    let joined = folder.path().join("joined");
    let [from_a, from_b] = from.each_ref().map(|p| p.to_str().unwrap());
    let merged = qpgen(&["merge", joined.to_str().unwrap(), "--from", from_a, from_b]);
    assert!(merged.status.success(), "{merged:?}");
    assert!(files(&joined) == whole && (files(&a), files(&b)) == before);
}

#[test]
fn what_does_not_belong_together_is_refused_with_the_difference() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    generator.make("out", &["--shard", "1/2"]);
    let before = files(&folder.path().join("out"));
    let refused = |more: &[&str], what: &str| {
        let done = generator.command("out", more).output().unwrap();
        assert_eq!(done.status.code(), Some(2), "{more:?}: {done:?}");
        assert!(said(&done).contains(what), "{more:?}: {}", said(&done));
    };
    refused(
        &["--shard", "2/2", "--seed", "9"],
        "seed: 5 there, 9 asked for",
    );
    refused(
        &["--shard", "1/2", "--seed", "9"],
        "seed: 5 there, 9 asked for",
    );
    refused(&["--shard", "2/3"], "same number of shards");
    refused(&[], "holds shards");
    refused(&["--shard", "3/2"], "3/2");
    assert!(files(&folder.path().join("out")) == before);
    generator.make("whole", &[]);
    let done = generator
        .command("whole", &["--seed", "9"])
        .output()
        .unwrap();
    assert!(
        said(&done).contains("seed: 5 there, 9 asked for"),
        "{done:?}"
    );
}

#[test]
fn two_runs_do_not_write_to_one_folder() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), SAMPLES);
    let mut first = generator
        .command("out", &["--count", "10000"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    while !folder.path().join("out/samples/000000").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let second = generator
        .command("out", &["--count", "10000"])
        .output()
        .unwrap();
    first.kill().unwrap();
    first.wait().unwrap();
    assert_eq!(second.status.code(), Some(1), "{second:?}");
    assert!(said(&second).contains("another run"), "{second:?}");
}

/// QUADPIXEL_MEMORY_SAMPLES: how many (30; the full test has 200). Bound before the run: what a sample of this size
/// holds (its images, 0.4 MB at the least) must not stay. The least of the first and of the last third lie about two
/// thirds of the samples apart: they may differ by an eighth of that, 1 MB of 30 samples.
///
/// glibc keeps freed blocks in its heaps, so that 19 to 37 MB are resident by turns. What the process itself holds is
/// seen where freed blocks from 64 KiB on go back at once.
#[test]
#[cfg(target_os = "linux")]
fn memory_stays_flat() {
    let folder = tempfile::tempdir().unwrap();
    let count = number_from("QUADPIXEL_MEMORY_SAMPLES", 30);
    let generator = Generator::new(folder.path(), count);
    let mut child = generator
        .command("out", &["--threads", "1", "--json"])
        .env("MALLOC_MMAP_THRESHOLD_", "65536")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    let mut resident_mb = Vec::new();
    for line in lines {
        let line: serde_json::Value = serde_json::from_str(&line.unwrap()).unwrap();
        if line["event"] != "sample" {
            continue;
        }
        let Ok(text) = fs::read_to_string(&status) else {
            break; // the run has just ended
        };
        let field = text.lines().find_map(|l| l.strip_prefix("VmRSS:"));
        let kb = field.and_then(|f| f.split_whitespace().next()?.parse::<f64>().ok());
        resident_mb.extend(kb.map(|kb| kb / 1024.0));
    }
    assert!(child.wait().unwrap().success());
    assert!(resident_mb.len() > count * 9 / 10, "{resident_mb:?}");
    let least = |part: &[f64]| part.iter().copied().fold(f64::INFINITY, f64::min);
    let (third, seen) = (count / 3, resident_mb.len());
    let [early, late] = [&resident_mb[..third], &resident_mb[seen - third..]].map(least);
    println!("{count} samples: {early:.1} MB in the first third, {late:.1} MB in the last");
    let allowed_mb = 0.4 * (2 * third) as f64 / 8.0;
    assert!(late < early + allowed_mb, "{resident_mb:?}");
}

#[test]
fn lines_for_programs_are_json_and_quiet_is_quiet_and_nothing_is_coloured() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 2);
    let json = generator.command("json", &["--json"]).output().unwrap();
    let done: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(done["samples"], 2);
    let lines: Vec<serde_json::Value> = said(&json)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let lines: Vec<_> = lines.iter().filter(|l| l["event"] == "sample").collect();
    assert_eq!(lines.len(), 2);
    assert_eq!(
        (&lines[1]["event"], &lines[1]["done"], &lines[1]["of"]),
        (&"sample".into(), &2.into(), &2.into())
    );
    // An error too.
    let refused = generator
        .command("json", &["--json", "--seed", "9"])
        .output()
        .unwrap();
    let line: serde_json::Value = serde_json::from_str(said(&refused).trim()).unwrap();
    assert_eq!(
        (&line["level"], &line["exit_code"]),
        (&"error".into(), &2.into())
    );

    let quiet = generator.command("quiet", &["--quiet"]).output().unwrap();
    assert!(
        quiet.status.success() && quiet.stderr.is_empty(),
        "{quiet:?}"
    );
    let loud = generator
        .command("loud", &["--log", "debug"])
        .output()
        .unwrap();
    assert!(said(&loud).contains("rays "), "{loud:?}");
    for output in [&json, &refused, &loud] {
        assert!(!output.stderr.contains(&0x1b) && !output.stdout.contains(&0x1b));
    }
}

#[test]
fn pages_are_rebuilt_to_the_same_bytes_and_during_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), 3);
    generator.make("out", &[]);
    let out = folder.path().join("out");
    let whole = files(&out);
    assert!(whole.contains_key("README.md") && whole.keys().any(|name| name.starts_with("plots/")));
    for name in ["index.html", "README.md"] {
        fs::remove_file(out.join(name)).unwrap();
    }
    fs::remove_dir_all(out.join("plots")).unwrap();
    let done = qpgen(&["preview", out.to_str().unwrap()]);
    assert!(done.status.success(), "{done:?}");
    assert!(files(&out) == whole);
    // Damage to a sample is not covered up.
    let meta = out.join("samples/000001/meta.json");
    let text = fs::read_to_string(&meta).unwrap();
    fs::write(&meta, text.replace("\"ev\": 0.0", "\"ev\": 0.5")).unwrap();
    assert_ne!(fs::read_to_string(&meta).unwrap(), text);
    assert!(qpgen(&["preview", out.to_str().unwrap()]).status.success());
    assert_eq!(
        qpgen(&["check", out.to_str().unwrap()]).status.code(),
        Some(1)
    );
    // A run in progress.
    generator.make("part", &["--shard", "1/2"]);
    let part = folder.path().join("part/shard-1-of-2");
    let done = qpgen(&["preview", part.to_str().unwrap()]);
    assert!(
        done.status.success() && part.join("index.html").is_file(),
        "{done:?}"
    );
    assert!(!part.join("dataset.json").exists());
}
