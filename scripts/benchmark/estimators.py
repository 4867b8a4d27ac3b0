"""Estimators of disparity: a scene in; disparity, its sigma or None, where it is claimed, and seconds out."""

import json
import subprocess
import tempfile
import time
from pathlib import Path

import cv2
import numpy as np

QPALGO = Path(__file__).resolve().parents[2] / "target/release/qpalgo"


def qpalgo(*arguments):
    with tempfile.TemporaryDirectory() as folder:
        command = [QPALGO, "--quiet", "disparity", *map(str, arguments), "--format", "npy", "--json", "-o", folder]
        begin = time.perf_counter()
        run = subprocess.run(command, capture_output=True, text=True)
        seconds = time.perf_counter() - begin
        if run.returncode:
            raise RuntimeError(f"{' '.join(map(str, command))}: {run.stderr}")
        return np.load(Path(folder) / "disparity.npy"), json.loads(run.stdout), seconds


def everywhere(flag):
    def estimate(scene):
        numbers, _, seconds = qpalgo(flag, scene.left, scene.right, *scene.flags)
        return numbers[..., 0], numbers[..., 1], np.ones(numbers.shape[:2], bool), seconds

    return estimate


def blocks(*more):
    """The block matcher's claims; what it does not claim is that of the nearest claim."""

    def estimate(scene):
        numbers, summary, seconds = qpalgo(scene.left, scene.right, "--one-dimensional", "horizontal", *scene.flags, *more)
        names = [channel["channel"] for channel in summary["channels"]]
        node = numbers[names.index("G") if "G" in names else 0]
        valid = node[..., 3] == 0
        height, width = scene.size
        first, stride = summary["grid"]["first_px"], summary["grid"]["stride_px"]

        def at(n, count):
            return np.clip(np.round((np.arange(n) - first) / stride).astype(int), 0, count - 1)

        rows, columns = at(height, node.shape[0])[:, None], at(width, node.shape[1])[None]
        if not valid.any():
            return np.zeros((height, width)), np.full((height, width), np.inf), np.zeros((height, width), bool), seconds
        _, labels = cv2.distanceTransformWithLabels((~valid).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
        claims = np.zeros(labels.max() + 1, int)
        claims[labels[valid]] = np.flatnonzero(valid)
        nearest = claims[labels]
        disparity, sigma = (node[..., c].ravel()[nearest][rows, columns] for c in (0, 2))
        return disparity, sigma, valid[rows, columns], seconds

    return estimate


def codes(pair):
    """8-bit codes of the square roots."""
    roots = [np.sqrt(view) for view in pair]
    bright = max(max(np.percentile(root, 99.9) for root in roots), 1e-9)
    return [np.clip(root / bright * 255, 0, 255).astype(np.uint8) for root in roots]


def of_opencv(flow, reduction):
    """An optical flow or a stereo matcher at a part of the resolution."""

    def estimate(scene):
        height, width = scene.size
        size = (width // reduction, height // reduction)
        pair = [cv2.resize(view, size, interpolation=cv2.INTER_AREA) for view in codes(scene.pair)]
        begin = time.perf_counter()
        found = flow(*pair)
        seconds = time.perf_counter() - begin
        full = cv2.resize(found.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
        return -reduction * full, None, np.ones((height, width), bool), seconds

    return estimate


def dis(a, b):
    return cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM).calc(a, b, None)[..., 0]


def sgbm(a, b):
    found = cv2.StereoSGBM_create(-16, 32, 5, 8 * 25, 32 * 25).compute(a, b).astype(np.float32) / 16
    found[found < -16] = np.median(found)
    return -found


def farneback(a, b):
    return cv2.calcOpticalFlowFarneback(a, b, None, 0.5, 5, 21, 5, 7, 1.5, 0)[..., 0]


ESTIMATORS = {
    "`qpalgo disparity`, defaults": blocks(),
    "`qpalgo disparity --window 31 --search 12`": blocks("--window", 31, "--search", 12),
    "`qpalgo disparity --dense`": everywhere("--dense"),
    "`qpalgo disparity --network`": everywhere("--network"),
    "OpenCV DIS, full": of_opencv(dis, 1),
    "OpenCV DIS, a quarter": of_opencv(dis, 4),
    "OpenCV SGBM, a quarter": of_opencv(sgbm, 4),
    "OpenCV Farneback, a quarter": of_opencv(farneback, 4),
}
