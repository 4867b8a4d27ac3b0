"""What matching by kernels says of packed pairs, with noise: match.py PAIRS.npz [PAIRS.npz ...] [--draws 1] [--seed 1]

Writes PAIRS.matched.npz beside each: `taken` (pairs, draws, 2, H, W) float16, captures as `batches.captured` draws them; `truth`
(pairs, draws, H, W) float16, their disparity, px; `matched` (pairs, draws, 2, H, W) float16: `qpalgo disparity --dense` of them, px, and the
logarithm of its standard deviation. A file that is there stays.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import quadpixel
import torch

from batches import LOG_SIGMA, Draw, captured, matched_file


def matched(both, disparity, draw, noise, crosstalk):
    """A capture of one pair, its truth, and what is found of it."""
    views, less = captured(torch.from_numpy(both)[None], noise, draw, crosstalk)
    left, right = views[0].numpy()
    found, sigma = quadpixel.dense_disparity(left, right)
    answers = np.stack([found, np.log(sigma).clip(*LOG_SIGMA)])
    return tuple(values.astype(np.float16) for values in (np.stack([left, right]), disparity * less.item(), answers))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", type=Path)
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=float, default=0.06, help="largest standard deviation of a view at white, a part of white")
    parser.add_argument("--crosstalk", type=float, default=0.0, help="largest part of a view's light in the other")
    args = parser.parse_args()
    for file in args.pairs:
        if matched_file(file).exists():
            continue
        arrays, found = np.load(file), {}
        begin = time.perf_counter()
        for size in (n.removeprefix("views_") for n in arrays.files if n.startswith("views_")):
            rows = []
            for index, (both, disparity) in enumerate(zip(arrays[f"views_{size}"], arrays[f"disparity_{size}"], strict=True)):
                draw = Draw(1, 1000 * args.seed + index, "cpu")
                draws = [matched(both, disparity, draw, args.noise, args.crosstalk) for _ in range(args.draws)]
                rows.append([np.stack(values) for values in zip(*draws, strict=True)])
            for kind, values in zip(("taken", "truth", "matched"), zip(*rows, strict=True), strict=True):
                found[f"{kind}_{size}"] = np.stack(values)
        aside = matched_file(file).with_suffix(".aside.npz")
        np.savez(aside, **found)
        aside.rename(matched_file(file))
        print(f"{time.perf_counter() - begin:.0f} s: {matched_file(file)}", flush=True)


if __name__ == "__main__":
    main()
