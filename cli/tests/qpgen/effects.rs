//! `--effects` and `--estimate` of `qpgen`, as processes.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

use crate::common;

use std::path::Path;
use std::process::Command;

use common::small::{SMALL, dataset, refused_config};
use common::{done, files, json, qpgen, refused, render};
use quadpixel_datasets::Effect;
use serde_json::Value;

fn meta(folder: &Path, sample: u32) -> Value {
    let path = folder.join(format!("samples/{sample:06}/meta.json"));
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

fn simulated(meta: &Value) -> Vec<&str> {
    let all = meta["effects"]["simulated"].as_array().unwrap();
    all.iter().filter_map(Value::as_str).collect()
}

/// What a phone lens in front of a quad pixel calls for is everything but these: `auto` gives the bytes of their list,
/// but for the configuration's own words.
#[test]
fn a_scene_that_needs_all_but_ghosts_gets_the_same_pictures_by_auto_as_by_their_list() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "auto", SMALL, &[]);
    // Cards of charts make no ghosts that are seen, and a table per wavelength takes longer than `auto` may take.
    let all = Effect::SELECTABLE.map(Effect::name);
    let others = ["lens-reflections", "response-spectrum"];
    let all = all.iter().filter(|name| !others.contains(name));
    let all = all.copied().collect::<Vec<_>>().join(",");
    dataset(folder.path(), "all", SMALL, &["--effects", &all]);
    let [auto, all] = ["auto", "all"].map(|n| files(&folder.path().join(n)));
    let picture = |name: &str| name.ends_with(".exr") || name.ends_with(".png");
    let mut compared = 0;
    for (name, bytes) in auto.iter().filter(|(name, _)| picture(name)) {
        assert_eq!(bytes, &all[name], "{name}");
        compared += 1;
    }
    assert!(compared >= 16, "{compared}");
    let out = folder.path().join("auto");
    assert_eq!(
        meta(&out, 0)["effects"]["simulated"],
        meta(&folder.path().join("all"), 0)["effects"]["simulated"]
    );
    // The usual choice is not written down, so that configurations of before keep their hashes.
    assert!(
        meta(&out, 0)["scene"]["parameters"]
            .get("effects")
            .is_none()
    );
}

/// Without effects: told one by one, with the estimate, in the log and in meta.json; the sample is made again from it
/// to the last byte.
#[test]
fn what_is_left_out_is_told_with_its_estimate_and_made_again_from_meta_json() {
    let folder = tempfile::tempdir().unwrap();
    let output = dataset(
        folder.path(),
        "none",
        SMALL,
        &["--effects", "none", "--count", "1"],
    );
    let log = String::from_utf8(output.stderr).unwrap();
    for effect in ["cra-variation", "dispersion", "aberrations", "vignetting"] {
        assert!(
            log.contains(&format!("{effect}: left out: not asked for (")),
            "{effect}: {log}"
        );
    }
    let out = folder.path().join("none");
    let meta = meta(&out, 0);
    let left_out = meta["effects"]["left_out"].as_array().unwrap();
    for name in ["aberrations", "vignetting", "dispersion", "cra-variation"] {
        assert!(!simulated(&meta).contains(&name), "{name}");
        let of = left_out.iter().filter(|l| l["effect"] == name);
        let [entry] = of.collect::<Vec<_>>()[..] else {
            panic!("{name}: {left_out:?}")
        };
        assert_eq!(entry["reason"], "not-chosen");
        let text = entry["text"].as_str().unwrap();
        assert!(text.ends_with("not among the effects asked for"), "{entry}");
        let signal = &entry["estimated_errors"][0]["signal-percent"];
        assert!(signal.as_f64().is_some(), "{entry}");
    }
    assert!(simulated(&meta).contains(&"occlusion"));
    done(&["check", out.to_str().unwrap()]);
    let again = folder.path().join("again");
    let path = out.join("samples/000000/meta.json");
    render(&path, &again);
    let [first, second] = [files(&out.join("samples/000000")), files(&again)];
    for (name, bytes) in first.iter().filter(|(name, _)| *name != "meta.json") {
        assert_eq!(bytes, &second[name], "{name}");
    }
    let twin: Value = serde_json::from_slice(&second["meta.json"]).unwrap();
    assert_eq!(meta["effects"], twin["effects"]);
}

#[test]
fn noise_that_is_not_asked_for_is_left_out_with_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{SMALL}\n[readout]\nphotons_um2 = 1000\n");
    dataset(folder.path(), "noisy", &text, &["--count", "1"]);
    let some = ["--count", "1", "--effects", "aberrations,dispersion"];
    dataset(folder.path(), "clean", &text, &some);
    let [noisy, clean] = ["noisy", "clean"].map(|n| folder.path().join(n));
    assert!(noisy.join("samples/000000/noisy.png").is_file());
    assert!(!clean.join("samples/000000/noisy.png").exists());
    done(&["check", clean.to_str().unwrap()]);
    let meta = meta(&clean, 0);
    let left_out = meta["effects"]["left_out"].as_array().unwrap().clone();
    let noise = left_out.iter().find(|l| l["effect"] == "noise").unwrap();
    // 1000 photons a µm² of a sub-pixel of 1 µm²: 3.2 % of shot noise, with read noise and PRNU more.
    let percent = noise["estimated_errors"][0]["signal-percent"]
        .as_f64()
        .unwrap();
    assert!((3.1..6.0).contains(&percent), "{noise}");
}

#[test]
fn unknown_effects_and_tolerances_without_meaning_are_refused() {
    for (more, word) in [
        (["--effects", "glare"], "glare"),
        (["--tolerance", "-1"], "signal_percent"),
        (["--tolerance-px", "nan"], "--tolerance-px"),
    ] {
        let mut arguments = vec!["dataset", "--out", "/nowhere/at-all"];
        arguments.extend(more);
        refused(&qpgen(&arguments), word);
    }
    let folder = tempfile::tempdir().unwrap();
    let text = format!("effects = [\"glare\"]\n{SMALL}");
    refused_config(folder.path(), &text, "glare");
}

/// Bytes and noise within 30 %; time within a factor of 3, as test machines are shared. `QUADPIXEL_ESTIMATE=1`: a
/// larger dataset, and 30 % for the time too.
#[test]
fn an_estimate_is_what_happens_then() {
    let full = std::env::var_os("QUADPIXEL_ESTIMATE").is_some();
    let (side, rays, count) = if full { (192, 128, 8) } else { (128, 64, 4) };
    let text = SMALL
        .replace("width = 40", &format!("width = {side}"))
        .replace("height = 32", &format!("height = {side}"))
        .replace("rays_per_pixel = 16", &format!("rays_per_pixel = {rays}"))
        .replace("texture_px = 64", "texture_px = 512")
        .replace("count = 2", &format!("count = {count}"));
    let folder = tempfile::tempdir().unwrap();
    let output = dataset(folder.path(), "data", &text, &["--estimate", "--json"]);
    let expected: Value = serde_json::from_slice(&output.stdout).unwrap();
    // Nothing is left of the trial.
    let left = std::fs::read_dir(folder.path()).unwrap();
    assert_eq!(left.count(), 1, "the configuration alone");
    let output = dataset(folder.path(), "data", &text, &["--json"]);
    let made: Value = serde_json::from_slice(&output.stdout).unwrap();
    let out = folder.path().join("data");
    let bytes: usize = files(&out.join("samples")).values().map(Vec::len).sum();
    let spreads = (0..count).map(|i| {
        let spread = &meta(&out, i)["statistics"]["rms_error_over_mean"];
        spread.as_f64().unwrap()
    });
    let spread = spreads.sum::<f64>() / f64::from(count);
    let ratio = |name: &str, is: f64| expected[name].as_f64().unwrap() / is;
    let ratios = [
        ratio("disk_bytes", bytes as f64),
        ratio("relative_spread", spread),
        ratio("seconds", made["seconds"].as_f64().unwrap()),
    ];
    println!(
        "estimated over made: bytes {:.2}, spread {:.2}, seconds {:.2}",
        ratios[0], ratios[1], ratios[2]
    );
    assert!(
        ratios[..2].iter().all(|r| (0.7..1.3).contains(r)),
        "{ratios:?}"
    );
    let (low, high) = if full { (0.7, 1.3) } else { (1.0 / 3.0, 3.0) };
    assert!((low..high).contains(&ratios[2]), "{ratios:?}");
}

/// A table of all lens shifts is reckoned from few directions and not made. `QUADPIXEL_ESTIMATE=1`: it is made then,
/// and took what was said.
#[test]
fn an_estimate_reckons_the_table_of_all_lens_shifts() {
    let folder = tempfile::tempdir().unwrap();
    let text = SMALL.replace("pitch_um = 2.0", "pitch_um = 1.6").replace(
        "model = \"geometric\"",
        "model = \"wave\"\npixels = [\"1.6um\"]\nshifts = 4",
    );
    let config = folder.path().join("config.toml");
    std::fs::write(&config, text).unwrap();
    let cache = folder.path().join("cache");
    let run = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
        command.args(["dataset", "--json", "--config"]).arg(&config);
        command.arg("--out").arg(folder.path().join("data"));
        command.args(more).env("QUADPIXEL_CACHE", &cache);
        json(&command.output().unwrap())
    };
    let expected = run(&["--estimate"]);
    let of_tables = expected["response_seconds"].as_f64().unwrap();
    let all = expected["seconds"].as_f64().unwrap();
    assert!(0.1 < of_tables && of_tables < all, "{of_tables} of {all} s");
    // What leaving colour out does is kept, which takes seconds to find; no table is.
    let kept = std::fs::read_dir(&cache).map_or(Vec::new(), |files| {
        files.map(|file| file.unwrap().file_name()).collect()
    });
    assert_eq!(kept, ["colour-errors.jsonl"]);
    if std::env::var_os("QUADPIXEL_ESTIMATE").is_none() {
        return;
    }
    let made = run(&[])["seconds"].as_f64().unwrap();
    println!("estimated {all:.1} s ({of_tables:.1} s of tables), made in {made:.1} s");
    assert!((0.7..1.3).contains(&(all / made)), "{all} {made}");
    let again = run(&["--estimate"]);
    assert_eq!(again["response_seconds"].as_f64(), Some(0.0));
}
