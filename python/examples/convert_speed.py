#!/usr/bin/env python3
"""What converting pictures with depth costs from Python: python python/examples/convert_speed.py [COUNT [ROUNDS]]. Prints Markdown. Needs PyTorch.

COUNT (6) pictures of 768 x 512 are converted, on two threads in all, by `qpgen convert` into a dataset, by a DataLoader of two workers, and by
`Camera.convert` in this process: in turn, ROUNDS (3) times. The program writes its samples; the two others do not. Of each, wall and CPU seconds
per picture: what else the machine does counts little in the latter.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import torch.utils.data

import quadpixel
from quadpixel.torch import OnTheFly

QPGEN = os.environ.get("QPGEN", "target/release/qpgen")
COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 6
ROUNDS = int(sys.argv[2]) if len(sys.argv) > 2 else 3
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


def cpu_s():
    """Of this process and of those that it began and that ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def seconds(work):
    began, used = time.perf_counter(), cpu_s()
    work()
    return (time.perf_counter() - began) / COUNT, (cpu_s() - used) / COUNT


def write(folder, pairs):
    for name, arrays in (("image", [light for light, _ in pairs]), ("depth", [depth for _, depth in pairs])):
        os.mkdir(os.path.join(folder, name))
        for i, array in enumerate(arrays):
            np.save(os.path.join(folder, name, f"{i:03}.npy"), array)


def main():
    pairs = [pair(seed) for seed in range(COUNT)]
    pictures = quadpixel.Pictures([light for light, _ in pairs], [depth for _, depth in pairs])
    camera = quadpixel.Camera(LENS, quadpixel.Pixel.builtin("2.8um"), focus_mm=1000 * FOCUS_M)
    camera.convert(pictures[0])  # makes the response's table
    quadpixel.set_threads(2)
    data = OnTheFly(pictures, camera, length=COUNT, threads=1)
    with tempfile.TemporaryDirectory() as folder:
        write(folder, pairs)
        command = [QPGEN, "--threads", "2", "convert", "--image", os.path.join(folder, "image"), "--depth", os.path.join(folder, "depth"),
                   "--lens", LENS, "--focus-m", str(FOCUS_M), "--out"]

        def program(number):
            subprocess.run([*command, os.path.join(folder, f"out{number}")], check=True, capture_output=True)

        def loader():
            for _ in torch.utils.data.DataLoader(data, batch_size=None, num_workers=2):
                pass

        def calls():
            for picture in pictures:
                camera.convert(picture)

        rounds = [(seconds(lambda: program(number)), seconds(loader), seconds(calls)) for number in range(ROUNDS)]
    print(f"{COUNT} pictures of {WIDTH} x {HEIGHT}, two threads; wall, CPU s per picture\n")
    print("| round | qpgen convert, written | DataLoader, 2 workers | Camera.convert |\n|---|---|---|---|")
    for number, ways in enumerate(rounds, 1):
        print(f"| {number} | " + " | ".join(f"{wall:.2f}, {cpu:.2f}" for wall, cpu in ways) + " |")
    for kind, name in enumerate(("wall", "CPU")):
        ratio = [statistics.median(ways[way][kind] / ways[0][kind] for ways in rounds) for way in (1, 2)]
        print(f"\nMedian {name} over that of the program: DataLoader {ratio[0]:.2f}, Camera.convert {ratio[1]:.2f}.")


if __name__ == "__main__":
    main()
