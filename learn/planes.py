"""What networks say of planes behind measured kernels: planes.py CALIBRATION NETWORK.zip [NETWORK.zip ...]

CALIBRATION is a folder with blur_kernels_left.npy and blur_kernels_right.npy (fields, side, side), 8 x 6 fields row by row. Dead leaves are
blurred by the kernels of 16 fields around the middle, reduced to a quarter and an eighth, with 1 % of noise, both signs. Prints for each
network and reduction the median over the planes of its median disparity over that of the kernels' centroids.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import quadpixel

FIELDS = [row * 8 + column for row in (1, 2, 3, 4) for column in (2, 3, 4, 5)]
REDUCED = (4, 8)
#: Side of a picture of leaves, what is cut off on each side, and the smallest and largest leaf, px.
SIDE, CUT, LEAVES = 1536, 128, (6, 300)


def dead_leaves(seed):
    """Disks over disks, their radii by 1/r^3 (A. Lee et al., IJCV 41, 35 (2001))."""
    rng, picture = np.random.default_rng(seed), np.zeros((SIDE, SIDE), np.float32)
    for _ in range(6000):
        radius = int(LEAVES[0] / np.sqrt(1 - rng.random() * (1 - (LEAVES[0] / LEAVES[1]) ** 2)))
        cv2.circle(picture, tuple(int(v) for v in rng.integers(0, SIDE, 2)), radius, float(0.05 + 0.95 * rng.random()), -1)
    return cv2.GaussianBlur(picture, None, 1.0)


def planes(calibration):
    """(views, disparity in px, reduction) of each plane."""
    kernels = [np.load(calibration / f"blur_kernels_{side}.npy").astype(np.float64) for side in ("left", "right")]
    pictures, rng = [dead_leaves(seed) for seed in range(4)], np.random.default_rng(3)
    for number, field in enumerate(FIELDS):
        pair = [k[field] / k[field].sum() for k in kernels]
        centroids = [(k.sum(axis=0) * np.arange(k.shape[1])).sum() for k in pair]
        # filter2D correlates.
        blurred = [cv2.filter2D(pictures[number % 4], -1, np.flip(k).astype(np.float32), borderType=cv2.BORDER_REFLECT) for k in pair]
        for times in REDUCED:
            inner = (v[CUT:-CUT, CUT:-CUT] for v in blurred)
            views = [cv2.resize(v, None, fx=1 / times, fy=1 / times, interpolation=cv2.INTER_AREA) for v in inner]
            views = [(v + 0.01 * np.sqrt(v + 0.01) * rng.standard_normal(v.shape)).astype(np.float32).clip(0) for v in views]
            for sign in (1, -1):
                yield views[::sign], sign * (centroids[0] - centroids[1]) / times, times


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("calibration", type=Path)
    parser.add_argument("networks", nargs="+", metavar="NETWORK.zip")
    args = parser.parse_args()
    made = list(planes(args.calibration))
    for network in args.networks:
        told = [np.median(quadpixel.dense_disparity(*views, network=network)[0]) / disparity for views, disparity, _ in made]
        medians = [np.median([t for t, (_, _, times) in zip(told, made, strict=True) if times == wanted]) for wanted in REDUCED]
        print(network, *(f"{m:.3f}" for m in medians), flush=True)


if __name__ == "__main__":
    main()
