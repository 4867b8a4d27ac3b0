//! Command lines of `qpalgo`.

use super::{Case, Out, case};

pub const CASES: [Case; 12] = [
    case(
        "disparity --dense",
        "qpalgo disparity --dense data/samples/000000 -o out --json",
        "data/samples/000000/raw.png",
        Out::Folder("out"),
    ),
    case(
        "sai",
        "qpalgo sai data/samples/000000 -o out",
        "data/samples/000000/raw.png",
        Out::Folder("out"),
    ),
    case(
        "sharpness",
        "qpalgo sharpness data/samples/000000/target.exr --json",
        "data/samples/000000/target.exr",
        Out::Nothing,
    ),
    case(
        "refocus",
        "qpalgo refocus data/samples/000000 --disparity 1 -o near.exr --json",
        "data/samples/000000/raw.png",
        Out::File("near.exr"),
    ),
    case(
        "depth",
        "qpalgo depth data/samples/000000 -o out",
        "data/samples/000000/camera.json data/samples/000000/raw.png",
        Out::Folder("out"),
    ),
    case(
        "calibrate-depth",
        "qpalgo calibrate-depth 0.75=noise 0.8625=far --curve curve.json -o mine.json --json",
        "noise/raw.png far/raw.png curve.json",
        Out::File("mine.json"),
    ),
    case(
        "score",
        "qpalgo score data/samples/000000/disparity.exr data/samples/000000/disparity.exr \
         --estimate-channels A.dx --truth-channels A.dx --json",
        "data/samples/000000/disparity.exr",
        Out::Nothing,
    ),
    case(
        "correct-aberrations --calibration",
        "qpalgo correct-aberrations --calibration noise -o new.json",
        "noise/raw.png",
        Out::File("new.json"),
    ),
    case(
        "correct-aberrations --apply",
        "qpalgo correct-aberrations --apply k.json noise -o out",
        "k.json noise/raw.png",
        Out::Folder("out"),
    ),
    case(
        "table",
        "qpalgo table t.toml -o out --json",
        "t.toml noise/raw.png",
        Out::Folder("out"),
    ),
    case(
        "autofocus",
        "qpalgo autofocus stack -o out",
        "stack/dataset.json stack/samples/000001/raw.png",
        Out::Folder("out"),
    ),
    case(
        "disparity",
        "qpalgo disparity data/samples/000000/raw.png a.png -o out",
        "data/samples/000000/raw.png a.png",
        Out::Folder("out"),
    ),
];
