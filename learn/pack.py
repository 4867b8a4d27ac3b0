"""Pairs of views with their truth, out of a dataset of converted pictures: pack.py DATASET -o FILE.npz

A sample gives a pair of left and right, and one of top and bottom with the axes exchanged, where its pixels have both. FILE holds
`views` (pairs, 2, 2, H, W) float16: left and right, green and grey, linear, evened, the 99th percentile of their mean 1;
`disparity` (pairs, H, W) float16: x_L - x_R, px; `weight` (pairs, H, W) uint8: 2 where the sample's truth is valid, 1 in the band along depth
steps, where the views contain made-up background and the truth is that of the pixel's own surface, 0 where nothing is known.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import quadpixel
from quadpixel.geometry import LUMINANCE, side_members, subpixel_counts

#: The views' brightness is compared under Gaussians of this part of the smaller side.
EVEN_PARTS = 8
#: Largest residual of the surface that gives the disparity along depth steps, px RMS.
FIT_RMS_PX = 0.05


def evened(left, right):
    """The right view at the left one's local brightness."""
    wide = min(left.shape) / EVEN_PARTS
    slow = [cv2.GaussianBlur(v, None, wide, borderType=cv2.BORDER_REPLICATE) for v in (left, right)]
    return right * (slow[0] / np.maximum(slow[1], 1e-6))


def everywhere(disparity, valid, depth):
    """Disparity at every pixel whose depth is known: where it is not valid, a polynomial of the place and of 1/depth, fitted where it is."""
    height, width = depth.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    known = np.isfinite(depth) & (depth > 0)
    near = np.where(known, 1 / np.where(known, depth, 1), 0)
    scale = near.max() or 1.0
    place = [np.ones_like(x), x, y, x * x, x * y, y * y]
    terms = np.stack([p * (near / scale) ** k for p in place for k in range(3)], axis=-1)
    solution, *_ = np.linalg.lstsq(terms[valid][::7], disparity[valid][::7], rcond=None)
    fitted = terms @ solution
    rms = np.sqrt(np.mean((fitted - disparity)[valid] ** 2))
    weight = np.where(valid, 2, np.where(known & (rms < FIT_RMS_PX), 1, 0)).astype(np.uint8)
    return np.where(valid, disparity, fitted), weight


def pairs(sample, depth):
    columns, rows = subpixel_counts(sample["meta"])
    for sides, axis, count in (("LR", 0, columns), ("TB", 1, rows)):
        if count < 2:
            continue
        halves = quadpixel.halves(sample["views"], sample["meta"], sides)
        members = [side_members(side, columns, rows) for side in sides]
        first, second = (sample["disparity"][m, ..., axis].mean(axis=0) for m in members)
        disparity, valid = first - second, sample["valid"] & np.isfinite(first - second)
        if valid.mean() < 0.3:
            continue
        disparity, weight = everywhere(np.where(valid, disparity, 0).astype(np.float64), valid, depth)
        planes = []
        for mix in ((0, 1, 0), LUMINANCE):
            left, right = ((v @ np.asarray(mix, np.float32)).clip(0) for v in halves)
            right = evened(left, right)
            white = max(np.quantile(0.5 * (left + right), 0.99), 1e-6)
            planes.append(np.stack([left, right]) / white)
        # (view, colour, y, x)
        views = np.stack(planes, axis=1)
        if axis == 1:
            views, disparity, weight = views.swapaxes(-1, -2), disparity.T, weight.T
        yield views.clip(0, 64).astype(np.float16), disparity.astype(np.float16), weight


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    args = parser.parse_args()
    kept = {}
    for sample in quadpixel.Dataset(args.dataset, items=("views", "disparity", "valid")):
        source = sample["meta"]["scene"]["parameters"]["rgbd"]["depth"]
        for views, disparity, weight in pairs(sample, np.load(source)):
            kept.setdefault(views.shape[-2:], []).append((views, disparity, weight))
    arrays = {}
    for (height, width), found in kept.items():
        for name, values in zip(("views", "disparity", "weight"), zip(*found, strict=True), strict=True):
            arrays[f"{name}_{height}x{width}"] = np.stack(values)
    np.savez(args.out, **arrays)
    print(f"{sum(len(v) for v in kept.values())} pairs: {args.out}")


if __name__ == "__main__":
    main()
