//! No truth can leak into an estimate: the crate's sources name nothing that knows the scene, and the library does not
//! depend on what makes it.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::path::{Path, PathBuf};

/// Modules of the core crate that know the scene, or the camera better than its description does.
const ROOMS: [&str; 6] = ["scene", "lens", "em", "response", "render", "effects"];
/// Types of a sample's truth and of how it was made.
const TYPES: [&str; 5] = [
    "SampleMeta",
    "CocDisparity",
    "Ranges",
    "RenderStatistics",
    "check_dataset",
];

/// The crate's sources but for its tests and benches.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() && !["tests", "benches", "target"].contains(&name.as_str()) {
            sources(&path, found);
        } else if name.ends_with(".rs") && name != "tests.rs" {
            found.push(path);
        }
    }
}

/// Code without comments, white space, and the tests at the end of a file.
fn code(text: &str) -> String {
    let product = text.split("#[cfg(test)]").next().unwrap();
    let lines = product
        .lines()
        .filter(|l| !l.trim_start().starts_with("//"));
    lines
        .flat_map(str::chars)
        .filter(|c| !c.is_whitespace())
        .collect()
}

/// The names that follow `quadpixel::`, one level deep, in paths and in braces.
fn rooms_named(code: &str) -> Vec<String> {
    let mut rooms = Vec::new();
    for rest in code.split("quadpixel::").skip(1) {
        let group = rest.strip_prefix('{').map(|group| {
            let mut depth = 1;
            let end = group.find(|c| {
                depth += i32::from(c == '{') - i32::from(c == '}');
                depth == 0
            });
            &group[..end.unwrap()]
        });
        let word = |path: &str| {
            path.chars()
                .take_while(|c| c.is_alphanumeric() || *c == '_')
                .collect()
        };
        match group {
            // A comma inside of an inner brace names no module of the crate, but may be looked at all the same.
            Some(group) => rooms.extend(group.split(['{', ',', '}']).map(word)),
            None => rooms.push(word(rest)),
        }
    }
    rooms
}

#[test]
fn the_sources_name_no_scene_lens_pixel_or_truth() {
    let mut files = Vec::new();
    sources(Path::new(env!("CARGO_MANIFEST_DIR")), &mut files);
    assert!(files.len() > 30, "{} files", files.len());
    for file in files {
        let code = code(&std::fs::read_to_string(&file).unwrap());
        for room in rooms_named(&code) {
            assert!(
                !ROOMS.contains(&room.as_str()),
                "{}: {room}",
                file.display()
            );
        }
        for name in TYPES.iter().chain(&["quadpixel_generators"]) {
            assert!(!code.contains(name), "{}: {name}", file.display());
        }
    }
}

#[test]
fn the_guard_sees_paths_and_groups() {
    let seen = |text: &str| rooms_named(&code(text));
    assert_eq!(seen("use quadpixel::lens::Lens;"), ["lens"]);
    assert!(
        seen("use quadpixel::{\n    image::{Image, raster},\n    render::render,\n};")
            .contains(&"render".into())
    );
    assert!(seen("// quadpixel::scene\n#[cfg(test)]\nuse quadpixel::scene;").is_empty());
}

#[test]
fn the_library_does_not_depend_on_what_makes_samples() {
    let manifest =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"));
    let manifest: toml::Table = manifest.unwrap().parse().unwrap();
    let dependencies = manifest["dependencies"].as_table().unwrap();
    for name in [
        "quadpixel-generators",
        "quadpixel-laboratory",
        "quadpixel-cli",
        "clap",
    ] {
        assert!(!dependencies.contains_key(name), "{name}");
    }
}
