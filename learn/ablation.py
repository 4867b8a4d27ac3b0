"""Trains one network per pixel and seed, and tests each on real pictures: ablation.py CONFIGURATION.toml DATA_DIR [DATA_DIR ...] -o FOLDER

DATA_DIR as of scripts/benchmark-real. Each network is asked by `qpalgo disparity --network=FILE`, unchanged. Goes on where it stopped; writes
table.md in FOLDER: mean and spread over the seeds of AI(1), AI(2), 1 - |rho|, and of the mean error on validation pairs.
"""

import argparse
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import quadpixel

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "scripts"))
from benchmark.estimators import everywhere  # noqa: E402
from benchmark.scores import score  # noqa: E402
from benchmark.sets import scenes  # noqa: E402

from score import errors  # noqa: E402


def trained(settings, variant, seed, folder):
    """The archive of a network, trained if it is not there."""
    archive = folder / "network.zip"
    if not archive.exists():
        folder.mkdir(parents=True, exist_ok=True)
        common = {k: settings[k] for k in ("side_px", "batch", "rate", "steps", "shape")}
        run = {**common, "seed": seed, "pairs": variant["pairs"], "noise": variant["noise"]}
        (folder / "run.toml").write_text("".join(f"{k} = {json.dumps(v)}\n" for k, v in run.items()))
        subprocess.run([sys.executable, HERE / "train.py", folder / "run.toml", "-o", folder], check=True)
        subprocess.run([sys.executable, HERE / "export.py", folder / "weights.pt", "--alone", "-o", archive], check=True)
    return archive


def tested(archive, sets, validation):
    """Means over the scenes of each folder, and the error on the validation pairs in px."""
    estimate = everywhere(f"--network={archive}")
    found = {}
    for folder, inside in sets.items():
        rows = []
        for scene in inside:
            disparity, sigma, claimed, _ = estimate(scene)
            rows.append(score(disparity, sigma, scene.truth, np.ones_like(claimed))[:3])
        found[folder] = np.mean(rows, axis=0).tolist()

    def told(left, right):
        return quadpixel.dense_disparity(left, right, network=str(archive))

    found["validation"] = [errors(told, np.load(validation), 0.02, np.random.default_rng(1))[1]]
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("configuration", type=Path)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DATA_DIR")
    parser.add_argument("--steps", type=int, help="in the place of the configuration's")
    parser.add_argument("--side-px", type=int, help="of a crop, in the place of the configuration's")
    parser.add_argument("--validation", type=Path, default=HERE / "data/validation/validation.npz")
    parser.add_argument("-o", "--out", type=Path, required=True)
    args = parser.parse_args()
    settings = tomllib.loads(args.configuration.read_text())
    settings |= {key: value for key in ("steps", "side_px") if (value := getattr(args, key)) is not None}
    sets = {folder.name: list(scenes(folder)) for folder in args.folders}
    results = {}
    # Seed after seed, so that what was stopped has one number of each.
    for seed in settings["seeds"]:
        for variant in settings["variant"]:
            folder = args.out / f"{variant['name'].replace(' ', '-')}-{seed}"
            kept = folder / "tested.json"
            if not kept.exists():
                numbers = tested(trained(settings, variant, seed, folder), sets, args.validation)
                kept.write_text(json.dumps(numbers))
            results.setdefault(variant["name"], []).append(json.loads(kept.read_text()))
            print(variant["name"], seed, results[variant["name"]][-1], flush=True)
    columns = [*sets, "validation"]
    heads = [f"{c}: AI(1), AI(2), 1 − abs ρ" for c in sets] + ["validation, noise 2 %: EPE, px"]
    lines = [f"| pixel | {' | '.join(heads)} |\n", f"|{'---|' * (len(heads) + 1)}\n"]
    for name, runs in results.items():
        cells = []
        for column in columns:
            numbers = np.array([run[column] for run in runs])
            means = [f"{mean:.3f}" for mean in numbers.mean(axis=0)]
            # One seed has no spread.
            spread = [f" ± {half:.3f}" for half in np.ptp(numbers, axis=0) / 2] if len(runs) > 1 else [""] * len(means)
            cells.append(", ".join(map("".join, zip(means, spread, strict=True))))
        lines.append(f"| {name} | {' | '.join(cells)} |\n")
    (args.out / "table.md").write_text("".join(lines), encoding="utf8")
    print("".join(lines))


if __name__ == "__main__":
    main()
