"""What matching by kernels says of packed pairs, with noise: match.py PAIRS.npz [PAIRS.npz ...] [--draws 2] [--seed 1]

Writes PAIRS.matched.npz beside each: `capture` (pairs, draws, 3) float32, what `batches.drawn_capture` drew; `matched` (pairs, draws, 2, H, W) float16:
`qpalgo disparity --dense` of that capture, px, and the logarithm of its standard deviation. Batches repeat the capture, noise and all.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import quadpixel

from batches import LOG_SIGMA, drawn_capture, matched_file, taken


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+", type=Path)
    parser.add_argument("--draws", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--noise", type=float, default=0.06, help="largest standard deviation of a view at white, a part of white")
    args = parser.parse_args()
    for file in args.pairs:
        arrays, found = np.load(file), {}
        begin = time.perf_counter()
        for name in (n for n in arrays.files if n.startswith("views_")):
            captures, answers = [], []
            for index, both in enumerate(arrays[name]):
                for draw in range(args.draws):
                    capture = drawn_capture(np.random.default_rng([args.seed, index, draw]), args.noise)
                    left, right = taken(both, capture, [index, draw])
                    disparity, sigma = quadpixel.dense_disparity(left, right)
                    captures.append(capture)
                    answers.append(np.stack([disparity, np.log(sigma).clip(*LOG_SIGMA)]).astype(np.float16))
            size = name.removeprefix("views_")
            found[f"capture_{size}"] = np.stack(captures).reshape(-1, args.draws, 3)
            found[f"matched_{size}"] = np.stack(answers).reshape(-1, args.draws, *answers[0].shape)
        np.savez(matched_file(file), **found)
        print(f"{time.perf_counter() - begin:.0f} s: {matched_file(file)}", flush=True)


if __name__ == "__main__":
    main()
