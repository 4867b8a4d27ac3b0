//! Worlds from numbers and from files: what is in view, same numbers same world, and their way through dataset and
//! render.

// because tests fail by panicking
#![allow(clippy::unwrap_used)]

use crate::common;

use std::fs;
use std::path::Path;

use common::{assert_same_sample, done, qpgen, refused, render, said};
use quadpixel::render::Camera;
use quadpixel::render::truth::SightRays;
use quadpixel::scene::world::World;
use quadpixel_generators::assemble::{Responses, camera, scene};
use quadpixel_generators::config::{DEFAULT_TOML, DatasetConfig, WorldConfig};
use quadpixel_generators::recipe::Recipe;
use quadpixel_generators::scenes::{Drawn, WorldKind};

fn recipe(kind: WorldKind, seed: u64, window: &str) -> Recipe {
    let kind = kind.name();
    let text = format!(
        r#"
        [lens]
        name = "wide_US20120327520A1_emb3"
        focus_mm = 600
        {window}
        subpixels = "2x2"
        width = 40
        height = 30
        [response]
        model = "geometric"
        [world.source.generated]
        kind = "{kind}"
        seed = {seed}
        near_mm = 350
        far_mm = 1500
        objects = 8
        thin = 0.3
        clear = 0.2
        glints = 5
        [render]
        rays_per_pixel = 4
        seed = 1
        "#
    );
    toml::from_str(&text).unwrap()
}

const WIDE: &str = "[sensor]\npitch_um = 90.0";
const NARROW: &str =
    "[sensor]\npitch_um = 8.0\nwindow = { at = \"position\", x_mm = 0.9, y_mm = -0.6 }";

fn camera_of(recipe: &Recipe) -> Camera {
    let response = Responses::new().get(recipe, &|_, _| ()).unwrap();
    camera(recipe, &response).unwrap()
}

fn drawn(recipe: &Recipe) -> Drawn {
    match &recipe.world.as_ref().unwrap().source {
        quadpixel_generators::scenes::WorldSource::Generated(drawn) => *drawn,
        quadpixel_generators::scenes::WorldSource::File(_) => panic!("generated"),
    }
}

#[test]
fn every_kind_fills_the_view_over_the_depths_asked_for() {
    for kind in WorldKind::ALL {
        for (seed, window) in [(1, WIDE), (2, NARROW)] {
            let recipe = recipe(kind, seed, window);
            let camera = camera_of(&recipe);
            let truth =
                SightRays::chief_rays(&camera).geometry(&camera, &scene(&recipe, &camera).unwrap());
            let depths = truth.depth_mm.data();
            let name = kind.name();
            assert!(
                depths.iter().all(|d| d.is_finite()),
                "{name} {window}: sky in view"
            );
            let (low, high) = depths
                .iter()
                .fold((f32::MAX, 0.0f32), |(l, h), &d| (l.min(d), h.max(d)));
            // Objects have a depth of their own, tilted backdrops more at their borders.
            assert!(low > 200.0 && low < 700.0, "{name}: nearest {low}");
            assert!(high > 1000.0 && high < 3000.0, "{name}: farthest {high}");
            let mut objects = truth.surfaces.clone();
            objects.sort_unstable();
            objects.dedup();
            assert!(objects.len() >= 5, "{name}: {objects:?}");
        }
    }
}

#[test]
fn the_same_numbers_make_the_same_clean_world() {
    for kind in WorldKind::ALL {
        let recipe = recipe(kind, 7, WIDE);
        let camera = camera_of(&recipe);
        let drawn = Drawn {
            objects: 4,
            ..drawn(&recipe)
        };
        let world = drawn.build(&camera).unwrap();
        let again = drawn.build(&camera).unwrap();
        assert_eq!(world.meshes.len(), again.meshes.len());
        for (a, b) in world.meshes.iter().zip(&again.meshes) {
            assert_eq!(
                (&a.positions_mm, &a.triangles, &a.uvs),
                (&b.positions_mm, &b.triangles, &b.uvs)
            );
        }
        assert_eq!(world.materials, again.materials);
        let other = Drawn { seed: 8, ..drawn }.build(&camera).unwrap();
        assert_ne!(world.materials, other.materials);
        let checked = World::new(world).unwrap();
        assert_eq!(checked.warnings(), Default::default(), "{}", kind.name());
    }
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let recipe = recipe(WorldKind::Room, 1, WIDE);
    let (camera, good) = (camera_of(&recipe), drawn(&recipe));
    for (field, bad) in [
        (
            "near_mm",
            Drawn {
                near_mm: f64::NAN,
                ..good
            },
        ),
        (
            "far_mm",
            Drawn {
                far_mm: 351.0,
                ..good
            },
        ),
        ("thin + clear", Drawn { thin: 0.9, ..good }),
        (
            "objects",
            Drawn {
                objects: 401,
                ..good
            },
        ),
    ] {
        let error = bad.build(&camera).unwrap_err().to_string();
        assert!(error.contains(field), "{error}");
    }
}

#[test]
fn charts_stay_the_default_and_their_configuration_is_unchanged() {
    let config = DatasetConfig::from_toml(DEFAULT_TOML, "default").unwrap();
    assert!(config.scene.world.is_none());
    let json = serde_json::to_value(&config).unwrap();
    assert!(
        json["scene"].get("world").is_none(),
        "its hash would change"
    );
    // The commented section is one that can be used.
    let (charts, world) = DEFAULT_TOML.split_once("# [scene.world]").unwrap();
    let used: String = world
        .lines()
        .map(|l| format!("{}\n", l.trim_start_matches("# ")))
        .collect();
    let config =
        DatasetConfig::from_toml(&format!("{charts}[scene.world]{used}"), "worlds").unwrap();
    let world = config.scene.world.unwrap();
    assert_eq!(world.kinds, WorldKind::ALL);
    // What is absent is as it stands there.
    let file = world.file.clone();
    assert_eq!(
        world,
        WorldConfig {
            file,
            ..WorldConfig::default()
        }
    );
}

/// A small dataset without its `[scene.world]`.
const SMALL: &str = r#"
        count = 3
        seed = 5
        rays_per_pixel = 2
        exposure_ev = 0
        [lens]
        names = ["wide_US20120327520A1_emb3"]
        focus_mm = 500
        [sensor]
        subpixels = "2x1"
        width = 20
        height = 16
        window = { at = "centre" }
        microlens_shift = { rule = "chief-ray" }
        pitch_um = 60
        [response]
        model = "geometric"
        [scene]
        charts = ["noise"]
        background_over_focus = 1
        tilt_deg = 0
        cards = 0
        card_over_focus = 1
        card_size = 0.5
        texture_px = 16
"#;

#[test]
fn a_dataset_of_worlds_checks_and_each_sample_can_be_rendered_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let world = r#"
        [scene.world]
        kinds = ["room", "table-top", "flying-shapes"]
        near_over_focus = { min = 0.5, max = 0.8 }
        far_over_focus = { min = 2, max = 3 }
        objects = 4
        thin = 0.2
        clear = 0.2
        glints = 3
        difficulty = { min = 0, max = 1 }
    "#;
    fs::write(at("a.toml"), format!("{SMALL}{world}")).unwrap();
    done(&["dataset", "--config", &at("a.toml"), "--out", &at("set")]);
    done(&["check", &at("set")]);
    let sample = folder.path().join("set/samples/000001");
    assert!(sample.join("objects.png").is_file() && sample.join("normal.exr").is_file());
    let meta = sample.join("meta.json").display().to_string();
    done(&["--threads", "1", "render", &meta, "--out", &at("again")]);
    assert_same_sample(&sample, &folder.path().join("again"));
}

/// A tetrahedron on a side of 0.2 m.
const OBJ: &str =
    "v -0.1 0 0\nv 0.1 0 0\nv 0 0.2 0\nv 0 0.1 0.1\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 1 2\n";

#[test]
fn a_dataset_of_a_scene_file_turns_and_moves_it_and_records_its_hash() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    fs::write(at("a.obj"), OBJ).unwrap();
    let text = format!(
        "{SMALL}\n[scene.world.file]\nnames = [{:?}]\ndistance_over_focus = {{ min = 0.8, max = 1.4 }}\n\
         size_over_focus = {{ min = 0.2, max = 0.4 }}\nyaw_deg = {{ min = -60, max = 60 }}\npitch_deg = 20\n",
        at("a.obj")
    );
    fs::write(at("a.toml"), &text).unwrap();
    let make = |out: &str| qpgen(&["dataset", "--config", &at("a.toml"), "--out", &at(out)]);
    let made = make("set");
    assert!(made.status.success(), "{made:?}");
    done(&["check", &at("set")]);
    let hash = blake3::hash(OBJ.as_bytes()).to_hex().to_string();
    let mut turns = Vec::new();
    for sample in ["000000", "000001", "000002"] {
        let folder = folder.path().join("set/samples").join(sample);
        let meta: serde_json::Value =
            serde_json::from_slice(&fs::read(folder.join("meta.json")).unwrap()).unwrap();
        let file = &meta["scene"]["parameters"]["world"]["source"]["file"];
        assert_eq!(file["blake3"], hash.as_str());
        assert!((400.0..700.0).contains(&file["distance_mm"].as_f64().unwrap()));
        assert!((100.0..200.0).contains(&file["size_mm"].as_f64().unwrap()));
        assert_eq!(file["pitch_deg"], 20.0);
        turns.push(file["yaw_deg"].as_f64().unwrap());
    }
    assert!(turns[0] != turns[1] && turns[1] != turns[2], "{turns:?}");
    // A sample is made again from what it says; not from another file.
    let sample = folder.path().join("set/samples/000001");
    let (meta, again) = (sample.join("meta.json"), folder.path().join("again"));
    render(&meta, &again);
    assert_same_sample(&sample, &again);
    fs::write(at("a.obj"), OBJ.replace("0.2", "0.3")).unwrap();
    let meta = meta.to_str().unwrap();
    refused(&qpgen(&["render", meta, "--out", &at("other")]), "BLAKE3");
    assert_eq!(make("set").status.code(), Some(2));
}

#[test]
fn a_scene_file_has_a_first_look_and_its_rays_serve_other_pixels() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    fs::write(at("a.obj"), OBJ).unwrap();
    let (obj, out, rays) = (at("a.obj"), at("out"), at("rays.npz"));
    let small = [
        "--size",
        "24x20",
        "--pitch-um",
        "60",
        "--rays-per-pixel",
        "8",
    ];
    let common = [
        "render",
        "--scene",
        obj.as_str(),
        "--size-mm",
        "200",
        "--focus-mm",
        "700",
        // What each pixel calls for may differ.
        "--effects",
        "aberrations,vignetting,global-illumination,occlusion,dispersion,cra-variation",
    ];
    let run = |more: &[&str]| qpgen(&[&common[..], &small[..], more].concat());
    let whole = |more: &[&str]| done(&[&common[..], &small[..], more].concat());
    let output = run(&["--out", &out, "--keep-rays", &rays, "--exposure-ev", "-1"]);
    let text = said(&output);
    assert!(
        output.status.success()
            && text.contains("out-first.jpg")
            && text.contains("triangles without an area"),
        "{text}"
    );
    assert!(folder.path().join("out-first.jpg").is_file());
    // A 4×4 pixel from the kept rays, and anew.
    let other = ["--subpixels", "4x4", "--exposure-ev", "0.5"];
    let from_rays = ["--out", &at("kept"), "--from-rays", &rays];
    whole(&[&other[..], &from_rays].concat());
    whole(&[&other[..], &["--out", &at("anew")]].concat());
    // The spread is measured while rays are traced, so meta.json knows it of the second only.
    assert_same_sample(&folder.path().join("anew"), &folder.path().join("kept"));
    for (what, more) in [
        (
            "rays of another recipe",
            vec!["--from-rays", &rays, "--seed", "2"],
        ),
        ("--size", vec!["--size", "0x4"]),
        ("camera", vec!["--scene-camera", "eye"]),
        ("distance_mm", vec!["--distance-mm", "0"]),
    ] {
        let out = at(&format!("bad {what}"));
        let output = if what == "--size" {
            qpgen(&[&common[..], &more[..], &["--out", &out]].concat())
        } else {
            run(&[&more[..], &["--out", &out]].concat())
        };
        refused(&output, what);
        assert!(!Path::new(&out).exists());
    }
    // A file that has changed is not the one that the recipe was made with.
    let meta = folder.path().join("out/meta.json").display().to_string();
    fs::write(&obj, format!("{OBJ}v 0 0 0\n")).unwrap();
    refused(
        &qpgen(&["render", &meta, "--out", &at("changed")]),
        "BLAKE3",
    );
}
