//! Command lines of `qpgen`.

use super::{Case, Out, case};

pub const CASES: [Case; 41] = [
    case(
        "accuracy",
        "qpgen accuracy rays --draft --out out --json",
        "",
        Out::Folder("out"),
    ),
    case(
        "fit",
        "qpgen fit capture/capture.toml --all --draft --out out --prior pupil_mm=5.5,0 --prior f_number=1.73,0 \
         --prior radius_um=1.19,0 --prior spacer_um=0.5,0 --prior silicon_um=3,0 --prior lens_index=1.56,0 \
         --prior isolation_split_um=0,0 --prior isolation_border_um=0,0",
        "capture/capture.toml capture/left.npy capture/right.png",
        Out::Folder("out"),
    ),
    case(
        "fit --print-capture",
        "qpgen fit --print-capture",
        "",
        Out::Nothing,
    ),
    case(
        "render --keep-rays",
        "qpgen render scene.toml --out picture --keep-rays rays.npz",
        "scene.toml",
        Out::File("rays.npz"),
    ),
    case(
        "render --from-rays",
        "qpgen render scene.toml --from-rays kept.npz --out out",
        "scene.toml kept.npz",
        Out::Folder("out"),
    ),
    case(
        "dataset --shard",
        "qpgen dataset --config c.toml --count 2 --shard 1/2 --out out",
        "c.toml",
        Out::Folder("out"),
    ),
    case(
        "dataset",
        "qpgen dataset --config c.toml --out out",
        "c.toml",
        Out::Folder("out"),
    ),
    case(
        "dataset --estimate",
        "qpgen dataset --config c.toml --out out --estimate",
        "c.toml",
        Out::InPlace,
    ),
    case(
        "dataset again",
        "qpgen dataset --config c.toml --out data",
        "c.toml data/dataset.json",
        Out::Nothing,
    ),
    case(
        "dataset grown",
        "qpgen dataset --config c.toml --count 2 --out data",
        "c.toml data/dataset.json",
        Out::InPlace,
    ),
    case(
        "merge",
        "qpgen merge shards",
        "shards/shard-1-of-2/run.json shards/shard-2-of-2/samples/000001/meta.json",
        Out::InPlace,
    ),
    case(
        "merge --from",
        "qpgen merge out --from shards/shard-1-of-2 shards/shard-2-of-2",
        "shards/shard-1-of-2/run.json shards/shard-2-of-2/samples/000001/depth.exr",
        Out::Folder("out"),
    ),
    case(
        "preview",
        "qpgen preview data",
        "data/samples/000000/meta.json",
        Out::Nothing,
    ),
    case(
        "check",
        "qpgen check data",
        "data/dataset.json data/samples/000000/meta.json data/samples/000000/raw.png data/samples/000000/views.exr \
         data/samples/000000/depth.exr",
        Out::Nothing,
    ),
    case(
        "check --hashes",
        "qpgen check data --hashes --json",
        "data/dataset.json data/samples/000000/meta.json data/samples/000000/views.exr",
        Out::Nothing,
    ),
    case(
        "export dpdd",
        "qpgen export data --layout dpdd -o out --json",
        "data/dataset.json data/samples/000000/meta.json data/samples/000000/views.exr \
         data/samples/000000/target.exr",
        Out::Folder("out"),
    ),
    case(
        "export qpdnet",
        "qpgen export data --layout qpdnet -o out",
        "data/dataset.json data/samples/000000/meta.json data/samples/000000/views.exr",
        Out::Folder("out"),
    ),
    case(
        "export webdataset",
        "qpgen export data --layout webdataset -o out",
        "data/dataset.json data/samples/000000/meta.json data/samples/000000/raw.png",
        Out::Folder("out"),
    ),
    case(
        "render",
        "qpgen render scene.toml --out out --json",
        "scene.toml",
        Out::Folder("out"),
    ),
    case(
        "render again",
        "qpgen render data/samples/000000/meta.json --out out",
        "data/samples/000000/meta.json",
        Out::Folder("out"),
    ),
    case(
        "render --scene",
        "qpgen render --scene s.obj --size 16x12 --rays-per-pixel 4 --out out",
        "s.obj",
        Out::Folder("out"),
    ),
    case(
        "response",
        "qpgen response --pixel p.toml --model geometric --grid 2 -o t.npz --json",
        "p.toml",
        Out::File("t.npz"),
    ),
    case(
        "response --theta-deg",
        "qpgen response --pixel p.toml --model geometric --theta-deg 0,10",
        "p.toml",
        Out::Nothing,
    ),
    case(
        "response --import",
        "qpgen response --pixel 2.8um --import r.csv -o t.npz --json",
        "r.csv",
        Out::File("t.npz"),
    ),
    case(
        "psf",
        "qpgen psf scene.toml --depths-m 1 --fields 2x2 --rays 256 -o bank.npz",
        "scene.toml",
        Out::File("bank.npz"),
    ),
    case(
        "curve",
        "qpgen curve noise.toml --distances 5 --fields 2x1 -o c.json --json",
        "noise.toml",
        Out::File("c.json"),
    ),
    case(
        "convert",
        "qpgen convert --image rgb.pfm --depth z.pfm --config c.toml --lens wide_US20120327520A1_emb3 --focus-m 0.72 \
         --out out",
        "rgb.pfm z.pfm c.toml",
        Out::Folder("out"),
    ),
    case(
        "dataset of pictures with depth",
        "qpgen dataset --config rgbd.toml --out out",
        "rgbd.toml rgb.pfm z.pfm",
        Out::Folder("out"),
    ),
    case(
        "study coherent",
        "qpgen study coherent --model rcwa --preset draft --pixel small.toml --out out",
        "small.toml",
        Out::Folder("out"),
    ),
    case(
        "study pitch",
        "qpgen study pitch --model geometric --theta-step-deg 45 --out out",
        "",
        Out::Folder("out"),
    ),
    case(
        "study wavelength",
        "qpgen study wavelength --model geometric --theta-step-deg 45 --out out --json",
        "",
        Out::Folder("out"),
    ),
    case(
        "study filter",
        "qpgen study filter --model geometric --theta-step-deg 45 --out out",
        "",
        Out::Folder("out"),
    ),
    case(
        "study rejection",
        "qpgen study rejection --pixel p.toml --theta-step-deg 30 --out out",
        "p.toml",
        Out::Folder("out"),
    ),
    case(
        "study microlens",
        "qpgen study microlens --theta-step-deg 45 --out out",
        "",
        Out::Folder("out"),
    ),
    case(
        "validate",
        "qpgen validate --pixel p.toml --rays 16 --theta-max-deg 10 --out out",
        "p.toml",
        Out::Folder("out"),
    ),
    case("lens list", "qpgen lens list --json", "", Out::Nothing),
    case(
        "lens info",
        "qpgen lens info l.json",
        "l.json",
        Out::Nothing,
    ),
    case(
        "lens spots",
        "qpgen lens spots l.json -o l.svg",
        "l.json",
        Out::File("l.svg"),
    ),
    case(
        "lens layout",
        "qpgen lens layout l.json -o l.svg",
        "l.json",
        Out::File("l.svg"),
    ),
    case(
        "lens import",
        "qpgen lens import lenses -o out --json",
        "",
        Out::Folder("out"),
    ),
    case(
        "lens check",
        "qpgen lens check l.json --json",
        "l.json",
        Out::Nothing,
    ),
];
