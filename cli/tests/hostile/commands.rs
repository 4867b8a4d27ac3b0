//! Every command.

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
    /// What it reads is changed, or what it writes is gone at its end.
    InPlace,
    File(&'static str),
    Folder(&'static str),
}

const SAMPLE: &str = "data/samples/000000";
const META: &str = "data/samples/000000/meta.json";
const CAMERA: &str = "data/samples/000000/camera.json";
pub const RAW: &str = "data/samples/000000/raw.png";
const VIEWS: &str = "data/samples/000000/views.exr";
const DEPTH: &str = "data/samples/000000/depth.exr";
const DISPARITY: &str = "data/samples/000000/disparity.exr";
const TARGET: &str = "data/samples/000000/target.exr";
const MANIFEST: &str = "data/dataset.json";

/// At least one line per command (`every_command_has_a_line`).
pub const CASES: [Case; 45] = [
    case(
        "accuracy",
        &[
            "qpgen", "accuracy", "rays", "--draft", "--out", "out", "--json",
        ],
        &[],
        Out::Folder("out"),
    ),
    case(
        "fit",
        &[
            "qpgen",
            "fit",
            "capture/capture.toml",
            "--all",
            "--draft",
            "--out",
            "out",
            "--prior",
            "pupil_mm=5.5,0",
            "--prior",
            "f_number=1.73,0",
            "--prior",
            "radius_um=1.19,0",
            "--prior",
            "spacer_um=0.5,0",
            "--prior",
            "silicon_um=3,0",
            "--prior",
            "lens_index=1.56,0",
        ],
        &[
            "capture/capture.toml",
            "capture/left.npy",
            "capture/right.png",
        ],
        Out::Folder("out"),
    ),
    case(
        "fit --print-capture",
        &["qpgen", "fit", "--print-capture"],
        &[],
        Out::Nothing,
    ),
    case(
        "render --keep-rays",
        &[
            "qpgen",
            "render",
            "scene.toml",
            "--out",
            "picture",
            "--keep-rays",
            "rays.npz",
        ],
        &["scene.toml"],
        Out::File("rays.npz"),
    ),
    case(
        "render --from-rays",
        &[
            "qpgen",
            "render",
            "scene.toml",
            "--from-rays",
            "kept.npz",
            "--out",
            "out",
        ],
        &["scene.toml", "kept.npz"],
        Out::Folder("out"),
    ),
    case(
        "dataset --shard",
        &[
            "qpgen", "dataset", "--config", "c.toml", "--count", "2", "--shard", "1/2", "--out",
            "out",
        ],
        &["c.toml"],
        Out::Folder("out"),
    ),
    case(
        "disparity --dense",
        &[
            "qpalgo",
            "disparity",
            "--dense",
            SAMPLE,
            "-o",
            "out",
            "--json",
        ],
        &[VIEWS],
        Out::Folder("out"),
    ),
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
        Out::InPlace,
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
        Out::InPlace,
    ),
    case(
        "merge",
        &["qpgen", "merge", "shards"],
        &[
            "shards/shard-1-of-2/run.json",
            "shards/shard-2-of-2/samples/000001/meta.json",
        ],
        Out::InPlace,
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
        &["noise/views.exr", "noise/meta.json"],
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
        &["k.json", "noise/views.exr"],
        Out::Folder("out"),
    ),
    case(
        "table",
        &["qpalgo", "table", "t.toml", "-o", "out", "--json"],
        &["t.toml", "noise/views.exr"],
        Out::Folder("out"),
    ),
    case(
        "autofocus",
        &["qpalgo", "autofocus", "stack", "-o", "out"],
        &["stack/dataset.json", "stack/samples/000001/views.exr"],
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
