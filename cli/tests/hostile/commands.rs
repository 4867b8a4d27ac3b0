//! Every command, with inputs that are small and sound.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A command line whose words are relative to the folder of a trial.
pub struct Case {
    pub name: &'static str,
    pub words: &'static [&'static str],
    /// Files that it reads and that a stranger may have made.
    pub inputs: &'static [&'static str],
    pub out: Out,
}

/// What it writes, by its word on the command line.
#[derive(Clone, Copy, PartialEq)]
pub enum Out {
    Nothing,
    File(&'static str),
    Folder(&'static str),
}

const SAMPLE: &str = "data/samples/000000";
const META: &str = "data/samples/000000/meta.json";
const CAMERA: &str = "data/samples/000000/camera.json";
const RAW: &str = "data/samples/000000/raw.png";
const VIEWS: &str = "data/samples/000000/views.exr";
const DEPTH: &str = "data/samples/000000/depth.exr";
const DISPARITY: &str = "data/samples/000000/disparity.exr";
const TARGET: &str = "data/samples/000000/target.exr";
const MANIFEST: &str = "data/dataset.json";

/// One line per command; `accuracy` computes for minutes and reads nothing.
pub const CASES: [Case; 38] = [
    case(
        "dataset",
        &["qpgen", "dataset", "--config", "c.toml", "--out", "out"],
        &["c.toml"],
        Out::Folder("out"),
    ),
    case(
        "dataset --estimate",
        &[
            "qpgen",
            "dataset",
            "--config",
            "c.toml",
            "--out",
            "out",
            "--estimate",
        ],
        &["c.toml"],
        Out::Nothing,
    ),
    case(
        "dataset again",
        &["qpgen", "dataset", "--config", "c.toml", "--out", "data"],
        &["c.toml", MANIFEST],
        Out::Nothing,
    ),
    case(
        "dataset grown",
        &[
            "qpgen", "dataset", "--config", "c.toml", "--count", "2", "--out", "data",
        ],
        &["c.toml", MANIFEST],
        Out::Nothing,
    ),
    case(
        "merge",
        &["qpgen", "merge", "shards"],
        &[
            "shards/shard-1-of-2/run.json",
            "shards/shard-2-of-2/samples/000001/meta.json",
        ],
        Out::Nothing,
    ),
    case(
        "merge --from",
        &[
            "qpgen",
            "merge",
            "out",
            "--from",
            "shards/shard-1-of-2",
            "shards/shard-2-of-2",
        ],
        &[
            "shards/shard-1-of-2/run.json",
            "shards/shard-2-of-2/samples/000001/depth.exr",
        ],
        Out::Folder("out"),
    ),
    case(
        "preview",
        &["qpgen", "preview", "data"],
        &[META],
        Out::Nothing,
    ),
    case(
        "check",
        &["qpgen", "check", "data"],
        &[MANIFEST, META, RAW, VIEWS, DEPTH],
        Out::Nothing,
    ),
    case(
        "check --hashes",
        &["qpgen", "check", "data", "--hashes", "--json"],
        &[MANIFEST, META, VIEWS],
        Out::Nothing,
    ),
    case(
        "export dpdd",
        &[
            "qpgen", "export", "data", "--layout", "dpdd", "-o", "out", "--json",
        ],
        &[MANIFEST, META, VIEWS, TARGET],
        Out::Folder("out"),
    ),
    case(
        "export qpdnet",
        &["qpgen", "export", "data", "--layout", "qpdnet", "-o", "out"],
        &[MANIFEST, META, VIEWS],
        Out::Folder("out"),
    ),
    case(
        "export webdataset",
        &[
            "qpgen",
            "export",
            "data",
            "--layout",
            "webdataset",
            "-o",
            "out",
        ],
        &[MANIFEST, META, RAW],
        Out::Folder("out"),
    ),
    case(
        "render",
        &["qpgen", "render", "scene.toml", "--out", "out", "--json"],
        &["scene.toml"],
        Out::Folder("out"),
    ),
    case(
        "render again",
        &["qpgen", "render", META, "--out", "out"],
        &[META],
        Out::Folder("out"),
    ),
    case(
        "render --scene",
        &[
            "qpgen",
            "render",
            "--scene",
            "s.obj",
            "--size",
            "16x12",
            "--rays-per-pixel",
            "4",
            "--out",
            "out",
        ],
        &["s.obj"],
        Out::Folder("out"),
    ),
    case(
        "response",
        &[
            "qpgen",
            "response",
            "--pixel",
            "p.toml",
            "--model",
            "geometric",
            "--grid",
            "2",
            "-o",
            "t.npz",
            "--json",
        ],
        &["p.toml"],
        Out::File("t.npz"),
    ),
    case(
        "response --theta-deg",
        &[
            "qpgen",
            "response",
            "--pixel",
            "p.toml",
            "--model",
            "geometric",
            "--theta-deg",
            "0,10",
        ],
        &["p.toml"],
        Out::Nothing,
    ),
    case(
        "response --import",
        &[
            "qpgen", "response", "--pixel", "2.8um", "--import", "r.csv", "-o", "t.npz", "--json",
        ],
        &["r.csv"],
        Out::File("t.npz"),
    ),
    case(
        "psf",
        &[
            "qpgen",
            "psf",
            "scene.toml",
            "--depths-m",
            "1",
            "--fields",
            "2x2",
            "--rays",
            "256",
            "-o",
            "bank.npz",
        ],
        &["scene.toml"],
        Out::File("bank.npz"),
    ),
    case(
        "convert",
        &[
            "qpgen", "convert", "--image", "rgb.pfm", "--depth", "z.pfm", "--config", "c.toml",
            "--out", "out",
        ],
        &["rgb.pfm", "z.pfm", "c.toml"],
        Out::Folder("out"),
    ),
    case(
        "study rejection",
        &[
            "qpgen",
            "study",
            "rejection",
            "--pixel",
            "p.toml",
            "--theta-step-deg",
            "30",
            "--out",
            "out",
        ],
        &["p.toml"],
        Out::Folder("out"),
    ),
    case(
        "study microlens",
        &[
            "qpgen",
            "study",
            "microlens",
            "--theta-step-deg",
            "45",
            "--out",
            "out",
        ],
        &[],
        Out::Folder("out"),
    ),
    case(
        "validate",
        &[
            "qpgen",
            "validate",
            "--pixel",
            "p.toml",
            "--rays",
            "16",
            "--theta-max-deg",
            "10",
            "--out",
            "out",
        ],
        &["p.toml"],
        Out::Folder("out"),
    ),
    case(
        "lens list",
        &["qpgen", "lens", "list", "--json"],
        &[],
        Out::Nothing,
    ),
    case(
        "lens info",
        &["qpgen", "lens", "info", "l.json"],
        &["l.json"],
        Out::Nothing,
    ),
    case(
        "lens spots",
        &["qpgen", "lens", "spots", "l.json", "-o", "l.svg"],
        &["l.json"],
        Out::File("l.svg"),
    ),
    case(
        "lens layout",
        &["qpgen", "lens", "layout", "l.json", "-o", "l.svg"],
        &["l.json"],
        Out::File("l.svg"),
    ),
    case(
        "lens check",
        &["qpgen", "lens", "check", "l.json", "--json"],
        &["l.json"],
        Out::Nothing,
    ),
    case(
        "sai",
        &["qpalgo", "sai", SAMPLE, "-o", "out"],
        &[RAW],
        Out::Folder("out"),
    ),
    case(
        "sharpness",
        &["qpalgo", "sharpness", TARGET, "--json"],
        &[TARGET],
        Out::Nothing,
    ),
    case(
        "refocus",
        &[
            "qpalgo",
            "refocus",
            SAMPLE,
            "--disparity",
            "1",
            "-o",
            "near.exr",
            "--json",
        ],
        &[RAW],
        Out::File("near.exr"),
    ),
    case(
        "depth",
        &["qpalgo", "depth", SAMPLE, "-o", "out"],
        &[CAMERA, RAW],
        Out::Folder("out"),
    ),
    case(
        "score",
        &[
            "qpalgo",
            "score",
            DISPARITY,
            DISPARITY,
            "--estimate-channels",
            "A.dx",
            "--truth-channels",
            "A.dx",
            "--json",
        ],
        &[DISPARITY],
        Out::Nothing,
    ),
    case(
        "correct-aberrations --calibration",
        &[
            "qpalgo",
            "correct-aberrations",
            "--calibration",
            "noise",
            "-o",
            "new.json",
        ],
        &["noise/raw.png", "noise/meta.json"],
        Out::File("new.json"),
    ),
    case(
        "correct-aberrations --apply",
        &[
            "qpalgo",
            "correct-aberrations",
            "--apply",
            "k.json",
            "noise",
            "-o",
            "out",
        ],
        &["k.json", "noise/raw.png"],
        Out::Folder("out"),
    ),
    case(
        "table",
        &["qpalgo", "table", "t.toml", "-o", "out", "--json"],
        &["t.toml", "noise/raw.png"],
        Out::Folder("out"),
    ),
    case(
        "autofocus",
        &["qpalgo", "autofocus", "stack", "-o", "out"],
        &["stack/dataset.json", "stack/samples/000001/raw.png"],
        Out::Folder("out"),
    ),
    case(
        "disparity",
        &["qpalgo", "disparity", RAW, "a.png", "-o", "out"],
        &[RAW, "a.png"],
        Out::Folder("out"),
    ),
];

const fn case(
    name: &'static str,
    words: &'static [&'static str],
    inputs: &'static [&'static str],
    out: Out,
) -> Case {
    Case {
        name,
        words,
        inputs,
        out,
    }
}

pub fn program(name: &str) -> &'static str {
    match name {
        "qpgen" => env!("CARGO_BIN_EXE_qpgen"),
        _ => env!("CARGO_BIN_EXE_qpalgo"),
    }
}

/// Makes the sound inputs once, in `base`.
pub fn make_inputs(base: &Path) {
    let generator = crate::common::generator::Generator::with_values(
        base,
        &[
            ("count", "1"),
            ("sensor.width", "64"),
            ("sensor.height", "48"),
        ],
    );
    fs::rename(base.join("config.toml"), base.join("c.toml")).unwrap();
    let run = |words: &[&str]| {
        let (name, words) = match words {
            ["qpalgo", words @ ..] => ("qpalgo", words),
            words => ("qpgen", words),
        };
        let done = Command::new(program(name))
            .args(words)
            .current_dir(base)
            .output()
            .unwrap();
        assert!(done.status.success(), "{words:?}: {done:?}");
        done.stdout
    };
    drop(generator);
    run(&["dataset", "--config", "c.toml", "--out", "data"]);
    for shard in ["1/2", "2/2"] {
        run(&[
            "dataset", "--config", "c.toml", "--count", "2", "--shard", shard, "--out", "shards",
        ]);
    }
    fs::write(
        base.join("p.toml"),
        run(&["response", "--pixel", "1.6um", "--print-pixel"]),
    )
    .unwrap();
    let scene = String::from_utf8(run(&["render", "--print-scene"])).unwrap();
    let mut scene: toml::Table = scene.parse().unwrap();
    // No table to compute, and no letters to draw.
    scene["response"] = toml::Value::Table("model = \"geometric\"".parse().unwrap());
    scene["planes"][0]["chart"] = "constant".into();
    scene["sensor"]["width"] = 16.into();
    scene["sensor"]["height"] = 12.into();
    scene["render"]["rays_per_pixel"] = 4.into();
    fs::write(base.join("scene.toml"), toml::to_string(&scene).unwrap()).unwrap();
    let chart = "kind = \"noise\"\nexponent = 1.0\ncontrast = 0.2\ncutoff_texels = 40";
    scene["planes"][0]["chart"] = toml::Value::Table(chart.parse().unwrap());
    scene["planes"][0]["distance_mm"] = scene["lens"]["focus_mm"].clone();
    scene["sensor"]["width"] = 112.into();
    scene["sensor"]["height"] = 112.into();
    scene["render"]["rays_per_pixel"] = 64.into();
    fs::write(base.join("noise.toml"), toml::to_string(&scene).unwrap()).unwrap();
    run(&["render", "noise.toml", "--out", "noise"]);
    fs::write(base.join("s.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let lens = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../src/lens/library/lib_triplet_US2453260.json");
    fs::copy(lens, base.join("l.json")).unwrap();
    fs::copy(base.join(RAW), base.join("a.png")).unwrap();
    // A step of depth in a grey picture.
    let plane = |kind: &str, value: &dyn Fn(usize) -> f32, channels: usize| {
        let mut bytes = format!("{kind}\n48 32\n-1.0\n").into_bytes();
        let values = (0..48 * 32).flat_map(|k| vec![value(k); channels]);
        bytes.extend(values.flat_map(f32::to_le_bytes));
        bytes
    };
    let grey = |k: usize| 0.2 + 0.01 * (k % 7) as f32;
    let metres = |k: usize| if k % 48 < 24 { 0.7 } else { 0.75 };
    fs::write(base.join("rgb.pfm"), plane("PF", &grey, 3)).unwrap();
    fs::write(base.join("z.pfm"), plane("Pf", &metres, 1)).unwrap();
    run(&[
        "qpalgo",
        "correct-aberrations",
        "--calibration",
        "noise",
        "-o",
        "k.json",
    ]);
    let row =
        "[[row]]\nsetup = \"a\"\nposition = \"c\"\ncalibration = \"noise\"\ncapture = \"noise\"\n";
    fs::write(base.join("t.toml"), row).unwrap();
    let mut stack: toml::Table = fs::read_to_string(base.join("c.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let sweep = "steps = 3\nfocus_over_drawn = { min = 0.8, max = 1.5, scale = \"inverse\" }";
    stack.insert("sweep".into(), toml::Value::Table(sweep.parse().unwrap()));
    stack["count"] = 3.into();
    fs::write(base.join("stack.toml"), toml::to_string(&stack).unwrap()).unwrap();
    run(&["dataset", "--config", "stack.toml", "--out", "stack"]);
    let mut rows = String::from("theta_deg,phi_deg,subpixel,P\n");
    for theta in [0, 15, 30, 45, 60] {
        for phi in (0..360).step_by(if theta == 0 { 360 } else { 30 }) {
            for name in ["A", "B", "C", "D"] {
                rows.push_str(&format!("{theta},{phi},{name},0.2\n"));
            }
        }
    }
    fs::write(base.join("r.csv"), rows).unwrap();
}
