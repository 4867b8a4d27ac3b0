"""Scores estimators of disparity on real dual-pixel pictures: scripts/benchmark-real DATA_DIR [DATA_DIR ...] [--curve FILE] [--out FILE]

Writes FILE (absent: docs/benchmark.md). Needs cargo, and Python 3 with numpy and opencv-python-headless. A minute per
scene. The layouts that are known stand in scripts/benchmark/sets.py. No estimator sees the truth; it is read beside the views and used
after the maps are made.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

import cv2
import numpy as np

from . import metric
from .estimators import ESTIMATORS
from .scores import score
from .sets import FARTHEST_M, UnknownLayout, scenes

ROOT = Path(__file__).resolve().parents[2]

HEAD = """# Disparity on real dual-pixel pictures

Written by `scripts/benchmark-real DATA_DIR ...`. AI(1), AI(2): affine-invariant errors, min over a, b of (mean |truth − (a estimate + b)|^p)^(1/p);
ρ: Spearman's rank correlation; over all pixels with a truth. What an estimator does not claim takes the nearest claim. MAE, AbsRel, δ1 (part of the
pixels within a factor of 1.25): of depth, and "within σ": after the fit of AI(1), which takes errors of scale and zero out, as σ leaves them out where
no camera is known. OpenCV's run on one thread on 8-bit square roots, evened by the white sheet where there is one; their time is without reading and
writing, that of `qpalgo` with them. The constants of `--dense` were chosen on pixel4's scenes 002, 006, 011 and 014 and on samples of `qpgen dataset`:
other captures decide. The network saw pictures of this project only; pixel4's white sheet and kernels, not its scenes, made one of its training cameras.
"""


def table(found):
    rows = {name: [] for name in ESTIMATORS}
    for scene in found:
        for name, estimate in ESTIMATORS.items():
            disparity, sigma, claimed, seconds = estimate(scene)
            if scene.truth is None:
                numbers = [claimed.mean(), *[np.nan] * 16, seconds]
            else:
                every = np.ones_like(claimed)
                parts = [score(disparity, sigma, scene.truth, where, scene.is_inverse_depth) for where in (every, claimed)]
                numbers = [claimed.mean(), *parts[0], *parts[1], seconds]
            rows[name].append(numbers)
            print(scene.name, name, np.round(numbers, 3), file=sys.stderr, flush=True)
    heads = ["estimator", "AI(1)", "AI(2)", "1 − abs ρ", "MAE, m; AbsRel; δ1", "claimed", "AI(1), AI(2), 1 − abs ρ there", "within σ, 2 σ there", "time, s"]
    lines = [f"| {' | '.join(heads)} |\n", f"|{'---|' * len(heads)}\n"]
    for name, numbers in rows.items():
        with np.errstate(all="ignore"):
            m = np.array([np.nan if np.isnan(c).all() else np.nanmean(c) for c in np.array(numbers, float).T])

        def shown(places, join, digits=3):
            return "–" if np.isnan(m[places]).all() else join.join(f"{v:.{digits}f}" for v in m[places])

        cells = [name, *(shown([i], "") for i in (1, 2, 3)), shown([4, 5, 6], "; "), shown([0], "", 2)]
        cells += [shown([9, 10, 11], ", "), shown([15, 16], ", ", 2), shown([17], "", 2)]
        lines.append(f"| {' | '.join(cells)} |\n")
    return "".join(lines)


def main():
    parser = argparse.ArgumentParser(prog="scripts/benchmark-real", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, metavar="DATA_DIR")
    parser.add_argument("--curve", type=Path, help="curve file of the camera of a folder as of DP119 (qpgen curve, qpalgo calibrate-depth): depth in m, too")
    parser.add_argument("--out", type=Path, default=ROOT / "docs/benchmark.md")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    try:
        source = json.loads(args.curve.read_text(encoding="utf8"))["source"] if args.curve else None
    except (OSError, ValueError, KeyError, TypeError) as error:
        sys.exit(f"scripts/benchmark-real: {args.curve}: no curve file: {error!r}")
    sets = []
    try:
        for folder in args.folders:
            sets.append((folder, list(scenes(folder))))
    except (UnknownLayout, OSError) as error:
        sys.exit(f"scripts/benchmark-real: {error}")
    subprocess.run(["cargo", "build", "--release", "--workspace", "--bins"], cwd=ROOT, check=True)
    text = HEAD + f"\nMeasured on {time.strftime('%Y-%m-%d')}, with {os.cpu_count()} processor cores.\n"
    for folder, found in sets:
        kind = "1/depth, 1/m" if found[0].is_inverse_depth else "affine in disparity"
        kind = "none" if all(scene.truth is None for scene in found) else kind
        names = ", ".join(scene.name for scene in found)
        text += f"\n## {folder.name}: {names}\n\nTruth: {kind}. Means over {len(found)} scenes.\n\n{table(found)}"
        if args.curve is not None and found[0].is_inverse_depth:
            text += f"\nDepth in m by {args.curve.name} ({source}). Depths beyond {FARTHEST_M:g} m are taken for that; planes that\n"
            text += f"the curve was calibrated on are fits, not predictions.\n\n{metric.table(folder, args.curve)}"
    aside = args.out.with_suffix(".aside")
    aside.write_text(text, encoding="utf8")
    aside.rename(args.out)
    print(args.out)


main()
