"""Errors on pairs with truth: score.py PAIRS.npz [PAIRS.npz ...] [--network FILE.zip] [--noise 0.02]

Of matching by kernels and of the network, as the program has them: mean error (EPE), parts of the pixels that are off by more than half
a pixel, and within one and two sigma. Over all pixels whose truth is known, and over those away from depth steps.
"""

import argparse
import time

import numpy as np
import quadpixel


def errors(estimate, arrays, noise, rng):
    rows = []
    for name in sorted(n for n in arrays.files if n.startswith("views_")):
        size = name.removeprefix("views_")
        views, truths, weights = (arrays[f"{kind}_{size}"] for kind in ("views", "disparity", "weight"))
        for pair, truth, weight in zip(views, truths, weights, strict=True):
            left, right = pair[:, 0].astype(np.float32)
            left, right = (v + noise * np.sqrt(v + 0.01) * rng.standard_normal(v.shape, dtype=np.float32) for v in (left, right))
            begin = time.perf_counter()
            found, sigma = estimate(left.astype(np.float32), right.astype(np.float32))
            seconds = time.perf_counter() - begin
            off = np.abs(found - truth.astype(np.float64))
            row = [seconds]
            for where in (weight > 0, weight > 1):
                row += [off[where].mean(), (off[where] > 0.5).mean(), *((off < k * sigma)[where].mean() for k in (1, 2))]
            rows.append(row)
    return np.mean(rows, axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pairs", nargs="+")
    parser.add_argument("--network", default=True, help="an archive of export.py; absent: the program's own")
    parser.add_argument("--noise", type=float, default=0.0, help="standard deviation of a view at white, a part of white")
    args = parser.parse_args()
    print("| pairs | estimator | EPE, px | bad-0.5, % | within σ, 2 σ, % | the same away from steps | time, s |\n|---|---|---|---|---|---|---|")
    for file in args.pairs:
        estimators = {
            "kernels": quadpixel.dense_disparity,
            "network": lambda left, right: quadpixel.dense_disparity(left, right, network=args.network),
        }
        for name, estimate in estimators.items():
            m = errors(estimate, np.load(file), args.noise, np.random.default_rng(1))
            cells = [f"{m[i]:.3f} | {100 * m[i + 1]:.1f} | {100 * m[i + 2]:.0f}, {100 * m[i + 3]:.0f}" for i in (1, 5)]
            print(f"| {file} | {name} | {cells[0]} | {cells[1].replace(' | ', '; ')} | {m[0]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
