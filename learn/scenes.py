"""Pictures with depth out of samples of qpgen: scenes.py DATASET [DATASET ...] -o FOLDER [--plain SEED]

Writes FOLDER/rgb/NAME.npy (linear, float32) and FOLDER/depth/NAME.npy (z, m; NaN where unknown): the all-in-focus
target of each sample and its depth, scaled alike in brightness, as `[scene.rgbd]` takes them. With --plain some surfaces get a weaker
texture, by a factor drawn for each, down to 1/200, and some nothing but marks, where the texture was brightest or darkest:
rooms are full of both, and charts are not.
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
#: Parts of the surfaces that are made plain with marks, and plain.
MARKED_PART, PLAIN_PART = 0.4, 0.35
#: Shading is what is slower than this, px.
SLOW_PX = 10.0


def surfaces(depth, objects):
    """A label for each pixel; 0 along steps, edges of objects (None: not known), and where no depth is known."""
    log = np.log(np.where(np.isfinite(depth), depth, 1e3))
    edges = np.zeros(depth.shape, bool)
    for axis, behind in ((0, np.s_[1:]), (1, np.s_[:, 1:])):
        edges[behind] |= np.abs(np.diff(log, axis=axis)) > STEP
        if objects is not None:
            edges[behind] |= np.diff(objects.astype(np.int32), axis=axis) != 0
    return cv2.connectedComponents((~edges).astype(np.uint8), connectivity=4)[1]


def marks(texture, inside, rng):
    """1 where ink is: a part of a surface where its texture is brightest, or darkest, drawn with its width."""
    width, part = rng.uniform(0.8, 3.0), rng.uniform(0.75, 0.97)
    sign = -1 if rng.random() < 0.5 else 1
    smooth = sign * cv2.GaussianBlur(texture * inside, None, width)
    return cv2.GaussianBlur((smooth > np.quantile(smooth[inside > 0], part)).astype(np.float32), None, 0.6)


def plain(picture, labels, rng):
    """The picture with less on some surfaces: their shading stays."""
    made = picture.copy()
    for label in range(1, labels.max() + 1):
        kind, contrast = rng.random(), 10 ** rng.uniform(-2.3, -0.2)
        y, x = np.nonzero(labels == label)
        if kind > MARKED_PART + PLAIN_PART or len(y) < LEAST_PX:
            continue
        reach = int(3 * SLOW_PX)
        box = (slice(max(y.min() - reach, 0), y.max() + reach + 1), slice(max(x.min() - reach, 0), x.max() + reach + 1))
        inside = (labels[box] == label).astype(np.float32)
        weight = cv2.GaussianBlur(inside, None, SLOW_PX)[..., None]
        slow = cv2.GaussianBlur(picture[box] * inside[..., None], None, SLOW_PX) / np.maximum(weight, 1e-6)
        texture = picture[box] - slow
        if kind < MARKED_PART:
            ink = rng.uniform(0.2, 0.8) * (1 if rng.random() < 0.3 else -1)
            less = (slow + min(contrast, 0.1) * texture) * (1 + ink * marks(texture.mean(axis=-1), inside, rng)[..., None])
        else:
            less = slow + contrast * texture
        made[box] = np.where(inside[..., None] > 0, less, made[box])
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
        # Worlds know the object at each pixel.
        more = ("objects",) if any(root.glob("samples/*/objects.png")) else ()
        for index, sample in enumerate(quadpixel.Dataset(root, items=("target", "depth", "valid", *more))):
            known = sample["valid"] & np.isfinite(sample["depth"])
            if known.mean() < 0.8:
                continue
            target = np.nan_to_num(sample["target"]).clip(0)
            # Lamps and glints many times the white are cut: they would make a 99th percentile of nothing else.
            white = np.quantile(target.max(axis=-1), 0.98)
            target = np.minimum(target / white, 4.0).astype(np.float32)
            depth = np.where(known, sample["depth"], np.nan).astype(np.float32)
            if args.plain is not None:
                labels = surfaces(depth, sample.get("objects"))
                target = plain(target, labels, np.random.default_rng([args.plain, index]))
            name = f"{root.name}-{sample['id']}.npy"
            np.save(args.out / "rgb" / name, target)
            np.save(args.out / "depth" / name, depth)
            count += 1
    print(f"{count} pictures with depth: {args.out}")


if __name__ == "__main__":
    main()
