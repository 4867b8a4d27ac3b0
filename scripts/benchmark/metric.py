"""Depth in metres by a camera's curve: pictures with a known depth, and planes at known distances."""

import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np

from .estimators import QPALGO
from .sets import FARTHEST_M, read, read_depth

ESTIMATORS = {"`qpalgo depth`": [], "`qpalgo depth --network`": ["--network"]}


def captures(folder):
    """Name, left, right and true depth in m (0 unknown) of planes in flat/MILLIMETRES/f4, and of captures as of DP119."""
    for left in sorted(Path(folder).glob("flat/*/f4/l.png")):
        distance = left.parents[1].name
        if distance.isdigit():
            size = read(left).shape[:2]
            yield f"plane at {int(distance)} mm", left, left.with_name("r.png"), np.full(size, int(distance) / 1000)
    for truth in sorted(Path(folder).glob("*/d.png")):
        left = truth.with_name("l.png")
        yield truth.parent.name, left, truth.with_name("r.png"), read_depth(truth, read(left).shape[:2])


def depth_of(left, right, curve, flags):
    """Depth in m (NaN where there is none), its sigma in m, and seconds."""
    with tempfile.TemporaryDirectory() as folder:
        command = [QPALGO, "--quiet", "depth", "--left", left, "--right", right, "--srgb", "--curve", curve, *flags]
        command += ["--format", "npy", "-o", folder]
        begin = time.perf_counter()
        run = subprocess.run([str(c) for c in command], capture_output=True, text=True)
        seconds = time.perf_counter() - begin
        if run.returncode:
            raise RuntimeError(f"{' '.join(map(str, command))}: {run.stderr}")
        # Confidence, sigma in m, disparity in px.
        sigma = np.load(Path(folder) / "confidence.npy")[..., 1]
        return np.load(Path(folder) / "depth.npy"), sigma, seconds


def errors(depth, sigma, truth):
    """MAE in m, AbsRel, δ1 and the parts within one and two sigma, at all pixels known to less than `FARTHEST_M`.

    Estimates beyond that are taken for it.
    """
    known = (truth > 0) & (truth < FARTHEST_M)
    found = np.minimum(np.where(np.isfinite(depth), depth, FARTHEST_M), FARTHEST_M)[known]
    true = truth[known]
    off = np.abs(found - true)
    within = [np.mean(off < k * sigma[known]) for k in (1, 2)]
    return [off.mean(), np.mean(off / true), np.mean(np.maximum(found / true, true / found) < 1.25), *within]


def table(folder, curve):
    """Rows of Markdown: every capture of the folder by every estimator."""
    lines = ["| capture | estimator | MAE, m | AbsRel | δ1 | within σ, 2 σ | time, s |\n", f"|{'---|' * 7}\n"]
    for name, left, right, truth in captures(folder):
        for estimator, flags in ESTIMATORS.items():
            depth, sigma, seconds = depth_of(left, right, curve, flags)
            mae, relative, near, one, two = errors(depth, sigma, truth)
            lines.append(f"| {name} | {estimator} | {mae:.3f} | {relative:.3f} | {near:.3f} | {one:.2f}, {two:.2f} | {seconds:.2f} |\n")
    return "".join(lines)
