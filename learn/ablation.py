"""Trains one network per pixel and seed, and tests each on real pictures: ablation.py CONFIGURATION.toml DATA_DIR [DATA_DIR ...] -o FOLDER

DATA_DIR as of scripts/benchmark-real. Each network is asked by `qpalgo disparity --network=FILE`, unchanged. Goes on where it stopped, also after
variants.py, which trains alone; writes table.md in FOLDER: mean and spread over the seeds of AI(1), AI(2), 1 - |rho|, and of the mean error on
validation pairs, px.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import quadpixel

from score import errors
from variants import HERE, options, runs, settings_of, trained

sys.path.insert(0, str(HERE.parent / "scripts"))
from benchmark.estimators import everywhere  # noqa: E402
from benchmark.scores import score  # noqa: E402
from benchmark.sets import scenes  # noqa: E402


def exported(weights):
    """The archive of a network that answers alone, not joined with matching."""
    archive = weights.with_name("network.zip")
    if not archive.exists():
        subprocess.run([sys.executable, HERE / "export.py", weights, "--alone", "-o", archive], check=True)
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

    rows = [errors(told, np.load(file), 0.02, np.random.default_rng(1))[1] for file in validation]
    found["validation"] = [float(np.mean(rows))]
    return found


def table(sets, results):
    """Markdown: mean and standard deviation over the seeds."""
    heads = [f"{c}: AI(1), AI(2), 1 − abs ρ" for c in sets] + ["validation, noise 2 %: EPE, px"]
    lines = [f"| pixel | {' | '.join(heads)} |\n", f"|{'---|' * (len(heads) + 1)}\n"]
    for name, kept in results.items():
        cells = []
        for column in [*sets, "validation"]:
            numbers = np.array([run[column] for run in kept])
            means = [f"{mean:.3f}" for mean in numbers.mean(axis=0)]
            # One seed has no spread.
            spread = [f" ± {s:.3f}" for s in numbers.std(axis=0, ddof=1)] if len(kept) > 1 else [""] * len(means)
            cells.append(", ".join(map("".join, zip(means, spread, strict=True))))
        lines.append(f"| {name} | {' | '.join(cells)} |\n")
    return "".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options(parser)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DATA_DIR")
    parser.add_argument("--validation", type=Path, action="append", help="pairs of pack.py; absent: learn/data/validation/validation.npz")
    args = parser.parse_args()
    settings = settings_of(args)
    validation = args.validation or [HERE / "data/validation/validation.npz"]
    sets = {folder.name: list(scenes(folder)) for folder in args.folders}
    results = {}
    for variant, seed, folder in runs(settings, args.out):
        kept = folder / "tested.json"
        if not kept.exists():
            numbers = tested(exported(trained(settings, variant, seed, folder)), sets, validation)
            kept.write_text(json.dumps(numbers), encoding="utf8")
        results.setdefault(variant["name"], []).append(json.loads(kept.read_text(encoding="utf8")))
        print(variant["name"], seed, results[variant["name"]][-1], flush=True)
    found = table(sets, results)
    (args.out / "table.md").write_text(found, encoding="utf8")
    print(found)


if __name__ == "__main__":
    main()
