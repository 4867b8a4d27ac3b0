#!/usr/bin/env python3
"""What converting pictures with depth costs from Python: python python/examples/convert_speed.py [COUNT]. Prints Markdown. Needs PyTorch.

COUNT (12) pictures of 768 x 512 are converted by `qpgen convert` into a dataset, by `Camera.convert` in this process, and by a DataLoader of two
workers, all on two threads in all. Programs write their samples; the two others do not.
"""

import os
import subprocess
import sys
import tempfile
import time

import numpy as np
import torch.utils.data

import quadpixel
from quadpixel.torch import OnTheFly

QPGEN = os.environ.get("QPGEN", "target/release/qpgen")
COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 12
WIDTH, HEIGHT = 768, 512
LENS, FOCUS_M = "wide_US20120327520A1_emb3", 0.8


def pair(seed):
    """Noise on a wall, with discs of other depths before it."""
    generator = np.random.default_rng(seed)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    depth = np.full((HEIGHT, WIDTH), 2.0, dtype=np.float32)
    for _ in range(12):
        cx, cy, radius, near = generator.uniform([0, 0, 20, 0.4], [WIDTH, HEIGHT, 90, 1.8])
        inside = (x - cx) ** 2 + (y - cy) ** 2 < radius**2
        depth[inside] = np.minimum(depth[inside], near)
    return generator.integers(0, 256, (HEIGHT, WIDTH, 3), dtype=np.uint8), depth


def seconds(work):
    began = time.perf_counter()
    work()
    return (time.perf_counter() - began) / COUNT


def main():
    pairs = [pair(seed) for seed in range(COUNT)]
    pictures = quadpixel.Pictures([light for light, _ in pairs], [depth for _, depth in pairs])
    camera = quadpixel.Camera(LENS, quadpixel.Pixel.builtin("2.8um"), focus_mm=1000 * FOCUS_M)
    camera.convert(pictures[0])  # makes the response's table
    quadpixel.set_threads(2)
    rows = [("Camera.convert", seconds(lambda: [camera.convert(picture) for picture in pictures]))]
    data = OnTheFly(pictures, camera, length=COUNT, threads=1)
    loader = torch.utils.data.DataLoader(data, batch_size=None, num_workers=2)
    rows.append(("DataLoader, 2 workers", seconds(lambda: [None for _ in loader])))
    with tempfile.TemporaryDirectory() as folder:
        for name, arrays in (("image", [light for light, _ in pairs]), ("depth", [depth for _, depth in pairs])):
            os.mkdir(os.path.join(folder, name))
            for i, array in enumerate(arrays):
                np.save(os.path.join(folder, name, f"{i:03}.npy"), array)
        command = [QPGEN, "--threads", "2", "convert", "--image", os.path.join(folder, "image"), "--depth", os.path.join(folder, "depth"),
                   "--lens", LENS, "--focus-m", str(FOCUS_M), "--out", os.path.join(folder, "out")]
        rows.append(("qpgen convert, written", seconds(lambda: subprocess.run(command, check=True, capture_output=True))))
    print(f"{COUNT} pictures of {WIDTH} x {HEIGHT}, two threads\n\n| way | s per picture |\n|---|---|")
    for name, taken in rows:
        print(f"| {name} | {taken:.2f} |")


if __name__ == "__main__":
    main()
