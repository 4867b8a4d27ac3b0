"""Trains one network per pixel and seed: variants.py CONFIGURATION.toml -o FOLDER [--jobs 4] [--seconds 500]

What ablation.py does first, by itself, for a machine that has a GPU and nothing to test with. A network lies in FOLDER/NAME-SEED/weights.pt;
those that are there stay, and one that was stopped goes on. Seed after seed, so that what was stopped has one of each.
"""

import argparse
import json
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent


def options(parser):
    """Those that ablation.py has, too."""
    parser.add_argument("configuration", type=Path)
    parser.add_argument("--steps", type=int, help="in the place of the configuration's")
    parser.add_argument("--side-px", type=int, help="of a crop, in the place of the configuration's")
    parser.add_argument("-o", "--out", type=Path, required=True)


def settings_of(args):
    settings = tomllib.loads(args.configuration.read_text(encoding="utf8"))
    return settings | {key: value for key in ("steps", "side_px") if (value := getattr(args, key)) is not None}


def runs(settings, out):
    """(variant, seed, folder) of each network, seed after seed."""
    for seed in settings["seeds"]:
        for variant in settings["variant"]:
            name = variant["name"].replace(",", "").replace(" ", "-")
            yield variant, seed, out / f"{name}-{seed}"


def trained(settings, variant, seed, folder, *more):
    """Weights of a network, trained if they are not there; `more`: options of train.py."""
    weights = folder / "weights.pt"
    if not weights.exists():
        folder.mkdir(parents=True, exist_ok=True)
        common = {k: settings[k] for k in ("side_px", "batch", "rate", "steps", "shape")}
        run = {**common, "seed": seed, **{k: variant[k] for k in ("pairs", "noise", "crosstalk")}}
        (folder / "run.toml").write_text("".join(f"{k} = {json.dumps(v)}\n" for k, v in run.items()), encoding="utf8")
        with (folder / "log.txt").open("a") as log:
            command = [sys.executable, HERE / "train.py", folder / "run.toml", "-o", folder, *more]
            subprocess.run(command, check=True, stdout=log, stderr=log)
    return weights


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options(parser)
    parser.add_argument("--data", type=Path, default=HERE / "data", help="folder of make-data")
    parser.add_argument("--jobs", type=int, default=1, help="networks trained at a time")
    parser.add_argument("--seconds", type=float, help="no training is begun after them")
    args = parser.parse_args()
    settings, begin, failed = settings_of(args), time.perf_counter(), []

    def one(run):
        variant, seed, folder = run
        if (folder / "weights.pt").exists() or (args.seconds and time.perf_counter() - begin > args.seconds):
            return
        try:
            trained(settings, variant, seed, folder, "--data", args.data)
            print(f"{folder.name}: {time.perf_counter() - begin:.0f} s", flush=True)
        except subprocess.CalledProcessError as error:
            failed.append(folder)
            print(f"error: {error}: see {folder / 'log.txt'}", file=sys.stderr, flush=True)

    with ThreadPoolExecutor(args.jobs) as pool:
        list(pool.map(one, runs(settings, args.out)))
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
