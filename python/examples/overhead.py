#!/usr/bin/env python3
"""What a call from Python costs over the command line: python python/examples/overhead.py [PAIRS]. Prints Markdown.

The default dataset's first sample is rendered and written by `qpgen render` and by `Configuration.render` and `Sample.write`, in turn. The CPU
seconds of each are compared, of the process for the program and of the call for Python, so that what else the machine does counts little.
"""

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

QPGEN = os.environ.get("QPGEN", "target/release/qpgen")
PAIRS = int(sys.argv[1]) if len(sys.argv) > 1 else 5


def cpu_s(who):
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def timed(work, who):
    began, used = time.perf_counter(), cpu_s(who)
    work()
    return time.perf_counter() - began, cpu_s(who) - used


begins = [timed(lambda: subprocess.run([sys.executable, "-c", code], check=True), resource.RUSAGE_CHILDREN)
          for code in ["pass", "import numpy", "import quadpixel"] for _ in range(7)]
bare, numpy_, ours = (min(wall for wall, _ in begins[7 * i : 7 * i + 7]) for i in range(3))

import quadpixel  # noqa: E402  (after its import was timed)

config, rows = quadpixel.Configuration(), []
with tempfile.TemporaryDirectory() as folder:
    recipe = os.path.join(folder, "recipe.json")
    with open(recipe, "w") as file:
        json.dump(config.recipe(0), file)
    config.render(0)
    for pair in range(PAIRS):
        names = [os.path.join(folder, f"{kind}-{pair}") for kind in ("program", "python")]
        program = [QPGEN, "--quiet", "render", recipe, "--out", names[0]]
        rows.append((timed(lambda: subprocess.run(program, check=True, stdout=subprocess.DEVNULL), resource.RUSAGE_CHILDREN),
                     timed(lambda: config.render(0).write(names[1]), resource.RUSAGE_SELF)))

print("| pair | qpgen render: wall, CPU, s | Python: wall, CPU, s | CPU ratio |\n|---|---|---|---|")
for i, (program, python) in enumerate(rows):
    print(f"| {i + 1} | {program[0]:.2f}, {program[1]:.2f} | {python[0]:.2f}, {python[1]:.2f} | {python[1] / program[1]:.3f} |")
ratio = statistics.median(python[1] / program[1] for program, python in rows)
print(f"\nMedian CPU ratio {ratio:.3f}. `import quadpixel`: {1e3 * (ours - bare):.0f} ms, of which NumPy {1e3 * (numpy_ - bare):.0f} ms (best of 7).")
