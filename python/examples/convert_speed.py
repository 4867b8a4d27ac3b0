#!/usr/bin/env python3
"""What converting pictures with depth costs from Python: python python/examples/convert_speed.py [COUNT [ROUNDS [SIZE [PIXEL [SUBPIXELS]]]]].
Prints Markdown.

COUNT (6) pictures of SIZE (768x512) are converted for a PIXEL (2.8um) with SUBPIXELS (2x2), on two threads in all, by `qpgen convert` into a dataset,
by a DataLoader of two workers (where there is PyTorch), and by `Camera.convert` in this process, of one camera and of a new one for each picture with a
focus of its own: in turn, ROUNDS (3) times. The program writes its samples; the others do not. Of each, wall and CPU seconds per picture: what else the
machine does counts little in the latter.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

import quadpixel

try:
    import torch.utils.data

    from quadpixel.torch import OnTheFly
except ImportError:
    torch = None

QPGEN = os.environ.get("QPGEN", "target/release/qpgen")
given = dict(enumerate(sys.argv))
COUNT, ROUNDS = int(given.get(1, 6)), int(given.get(2, 3))
WIDTH, HEIGHT = map(int, given.get(3, "768x512").split("x"))
PIXEL, SUBPIXELS = given.get(4, "2.8um"), given.get(5, "2x2")
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


def configured(folder):
    """The default configuration with the pixel, the window and the lens of here."""
    text = subprocess.run([QPGEN, "dataset", "--print-config"], check=True, capture_output=True, text=True).stdout
    here = {"subpixels": f'"{SUBPIXELS}"', "window": '{ at = "centre" }', "pixels": f'["{PIXEL}"]'}
    lines = [f"{name} = {here[name]}" if (name := line.split(" = ")[0]) in here else line for line in text.splitlines()]
    path = os.path.join(folder, "configuration.toml")
    with open(path, "w") as file:
        file.write("\n".join(lines))
    return path


def main():
    pairs = [pair(seed) for seed in range(COUNT)]
    pictures = quadpixel.Pictures([light for light, _ in pairs], [depth for _, depth in pairs])

    def camera(focus_m):
        return quadpixel.Camera(LENS, quadpixel.Pixel.builtin(PIXEL, subpixels=SUBPIXELS), focus_mm=1000 * focus_m)

    one = camera(FOCUS_M)
    one.convert(pictures[0])  # makes the response's table
    quadpixel.set_threads(2)
    with tempfile.TemporaryDirectory() as folder:
        write(folder, pairs)
        command = [QPGEN, "--threads", "2", "convert", "--config", configured(folder), "--image", os.path.join(folder, "image"), "--depth",
                   os.path.join(folder, "depth"), "--lens", LENS, "--focus-m", str(FOCUS_M), "--out"]

        def program(number):
            subprocess.run([*command, os.path.join(folder, f"out{number}")], check=True, capture_output=True)

        def loader():
            data = OnTheFly(pictures, one, length=COUNT, threads=1)
            for _ in torch.utils.data.DataLoader(data, batch_size=None, num_workers=2):
                pass

        def calls():
            for picture in pictures:
                one.convert(picture)

        def cameras(number):
            for k, picture in enumerate(pictures):
                camera(FOCUS_M + 0.01 * (1 + k + COUNT * number)).convert(picture)

        ways = {"qpgen convert, written": program, "Camera.convert": lambda _: calls(), "the same, a camera each": cameras}
        if torch:
            ways["DataLoader, 2 workers"] = lambda _: loader()
        rounds = [[seconds(lambda: way(number)) for way in ways.values()] for number in range(ROUNDS)]
    print(f"{COUNT} pictures of {WIDTH} x {HEIGHT}, pixel {PIXEL} ({SUBPIXELS}), two threads; wall, CPU s per picture\n")
    print("| round | " + " | ".join(ways) + " |\n|---" + "|---" * len(ways) + "|")
    for number, times in enumerate(rounds, 1):
        print(f"| {number} | " + " | ".join(f"{wall:.2f}, {cpu:.2f}" for wall, cpu in times) + " |")
    median = [[statistics.median(times[way][kind] for times in rounds) for kind in (0, 1)] for way in range(len(ways))]
    print("| median | " + " | ".join(f"{wall:.2f}, {cpu:.2f}" for wall, cpu in median) + " |")


if __name__ == "__main__":
    main()
