//! A dataset in the making that is killed or told to stop.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::common::generator::{Generator, number_from, send};
use crate::common::{files, qpgen};

const SAMPLES: usize = 5;

/// The same seed of "random" instants every time.
fn unit(seed: u64, n: u64) -> f64 {
    quadpixel::sampling::uniform(seed, &[n])
}

/// Samples under their final names are those of `whole`, to the byte.
fn no_wrong_sample(out: &Path, whole: &BTreeMap<String, Vec<u8>>, place: &str) {
    if !out.join("samples").is_dir() {
        return;
    }
    for (name, bytes) in files(&out.join("samples")) {
        if !name.starts_with(".tmp-") {
            assert!(
                whole.get(&format!("samples/{name}")) == Some(&bytes),
                "{place}: {name}"
            );
        }
    }
}

/// QUADPIXEL_KILLS: how often (10; the full test has 50).
#[test]
fn killed_at_any_instant_it_goes_on_to_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), SAMPLES);
    let began = Instant::now();
    generator.make("whole", &[]);
    let seconds = began.elapsed().as_secs_f64();
    let whole = files(&folder.path().join("whole"));
    let out = folder.path().join("killed");
    let (mut killed, mut completed) = (0, 0);
    for attempt in 0.. {
        let mut child = generator
            .command("killed", &[])
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // Within the time of two fifths of a run: most runs are killed several times.
        std::thread::sleep(Duration::from_secs_f64(0.4 * seconds * unit(7, attempt)));
        let ended = child.try_wait().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        no_wrong_sample(&out, &whole, &format!("kill {attempt}"));
        if ended.is_some_and(|status| status.success()) {
            assert!(files(&out) == whole, "after {killed} kills");
            fs::remove_dir_all(&out).unwrap();
            completed += 1;
            if killed >= number_from("QUADPIXEL_KILLS", 10) {
                break;
            }
        } else {
            killed += 1;
            if out.exists() && !files(&out).keys().eq(whole.keys()) {
                assert_eq!(
                    qpgen(&["check", out.to_str().unwrap()]).status.code(),
                    Some(1)
                );
            }
        }
        // Towards the end every run is let come to its own.
        if killed >= number_from("QUADPIXEL_KILLS", 10) {
            generator.make("killed", &[]);
            assert!(files(&out) == whole, "after {killed} kills");
            break;
        }
    }
    println!(
        "{killed} kills, {completed} runs that came to their end between them; a run takes {seconds:.2} s"
    );
}

#[test]
#[cfg(unix)]
fn a_signal_ends_it_after_the_sample_in_hand_and_nothing_half_made_stays() {
    let folder = tempfile::tempdir().unwrap();
    let generator = Generator::new(folder.path(), SAMPLES);
    for signal in ["INT", "TERM"] {
        let name = format!("stopped-{signal}");
        let out = folder.path().join(&name);
        // Many more samples than can be made in that time.
        let mut child = generator
            .command(&name, &["--count", "10000"])
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        while !out.join("samples/000001").exists() {
            std::thread::sleep(Duration::from_millis(2));
        }
        send(&child, signal);
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(1), "{signal}");
        let text = std::io::read_to_string(child.stderr.take().unwrap()).unwrap();
        assert!(
            text.contains("stopped by a signal") && text.contains("goes on"),
            "{text}"
        );
        let left: Vec<String> = files(&out).into_keys().collect();
        assert!(left.iter().all(|name| !name.contains(".tmp-")), "{left:?}");
        no_wrong_sample(&out, &whole_of(&generator, folder.path(), &out), signal);
    }
}

/// A dataset of as many samples as `out` holds.
fn whole_of(generator: &Generator, folder: &Path, out: &Path) -> BTreeMap<String, Vec<u8>> {
    let count = fs::read_dir(out.join("samples")).unwrap().count();
    generator.make("as-many", &["--count", &count.to_string()]);
    let whole = files(&folder.join("as-many"));
    fs::remove_dir_all(folder.join("as-many")).unwrap();
    whole
}
