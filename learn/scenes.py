"""Pictures with depth out of samples of qpgen: scenes.py DATASET [DATASET ...] -o FOLDER [--plain SEED]

Writes FOLDER/rgb/NAME.npy (linear, float32) and FOLDER/depth/NAME.npy (z, m; NaN where unknown): the all-in-focus
target of each sample and its depth, scaled alike in brightness, as `[scene.rgbd]` takes them. With --plain the texture of
most surfaces is made weaker, by a factor drawn for each, down to 1/200: rooms are full of plain surfaces, and charts are not.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np
import quadpixel

#: Relative step of the depth from pixel to pixel that ends a surface.
STEP = 0.03
#: Smallest surface that is made plain, px.
LEAST_PX = 60
#: Part of the surfaces that are made plain.
PLAIN_PART = 0.65
#: Shading is what is slower than this, px.
SLOW_PX = 10.0


def surfaces(depth):
    """A label for each pixel; 0 along steps and where no depth is known."""
    log = np.log(np.where(np.isfinite(depth), depth, 1e3))
    steps = np.zeros(depth.shape, bool)
    steps[:, 1:] |= np.abs(np.diff(log, axis=1)) > STEP
    steps[1:] |= np.abs(np.diff(log, axis=0)) > STEP
    return cv2.connectedComponents((~steps).astype(np.uint8), connectivity=4)[1]


def plain(picture, depth, rng):
    """The picture with weaker texture on some surfaces: their shading stays."""
    labels = surfaces(depth)
    made = picture.copy()
    for label in range(1, labels.max() + 1):
        contrast = 10 ** rng.uniform(-2.3, -0.2) if rng.random() < PLAIN_PART else 1.0
        y, x = np.nonzero(labels == label)
        if contrast == 1.0 or len(y) < LEAST_PX:
            continue
        reach = int(3 * SLOW_PX)
        box = (slice(max(y.min() - reach, 0), y.max() + reach + 1), slice(max(x.min() - reach, 0), x.max() + reach + 1))
        mask = (labels[box] == label).astype(np.float32)
        weight = cv2.GaussianBlur(mask, None, SLOW_PX)[..., None]
        slow = cv2.GaussianBlur(picture[box] * mask[..., None], None, SLOW_PX) / np.maximum(weight, 1e-6)
        weaker = slow + contrast * (picture[box] - slow)
        made[box] = np.where(mask[..., None] > 0, weaker, made[box])
    return made.clip(0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("datasets", nargs="+", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--plain", type=int, metavar="SEED")
    args = parser.parse_args()
    for name in ("rgb", "depth"):
        (args.out / name).mkdir(parents=True, exist_ok=True)
    count = 0
    for root in args.datasets:
        for index, sample in enumerate(quadpixel.Dataset(root, items=("target", "depth", "valid"))):
            known = sample["valid"] & np.isfinite(sample["depth"])
            if known.mean() < 0.8:
                continue
            target = np.nan_to_num(sample["target"]).clip(0)
            # Lamps and glints many times the white are cut: they would make a 99th percentile of nothing else.
            white = np.quantile(target.max(axis=-1), 0.98)
            target = np.minimum(target / white, 4.0).astype(np.float32)
            depth = np.where(known, sample["depth"], np.nan).astype(np.float32)
            if args.plain is not None:
                target = plain(target, depth, np.random.default_rng([args.plain, index]))
            name = f"{root.name}-{sample['id']}.npy"
            np.save(args.out / "rgb" / name, target)
            np.save(args.out / "depth" / name, depth)
            count += 1
    print(f"{count} pictures with depth: {args.out}")


if __name__ == "__main__":
    main()
