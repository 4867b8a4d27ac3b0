#!/usr/bin/env python3
"""Renders the samples of a configuration on Ray: python python/examples/on_ray.py CONFIG.toml OUT [COUNT]. Needs `pip install "ray[data]"`.

Each sample is a folder of OUT, with the bytes that `qpgen dataset --config CONFIG.toml` gives it on one machine; a sample that is there is not
rendered again, so that a run that was stopped goes on. On a cluster OUT lies on a disk that all see; response tables that take long are made first
(`qpgen response`), in a folder that all see too (QUADPIXEL_CACHE).
"""

import os
import sys

import ray


class Rendering:
    """One per worker: its response tables are loaded once."""

    def __init__(self, config, out):
        import quadpixel

        # Ray gives a worker one core, and as many workers as there are cores.
        quadpixel.set_threads(1)
        self.config, self.out = quadpixel.Configuration.open(config), out

    def __call__(self, row):
        folder = os.path.join(self.out, f"{row['id']:06}")
        fresh = not os.path.exists(os.path.join(folder, "meta.json"))
        if fresh:
            self.config.render(int(row["id"])).write(folder)
        return {"folder": folder, "rendered": fresh}


def render(config, out, count, workers):
    """Renders the first `count` samples; gives their folders."""
    os.makedirs(out, exist_ok=True)
    seeds = ray.data.range(count, override_num_blocks=count)
    done = seeds.map(Rendering, fn_constructor_args=(os.path.abspath(config), os.path.abspath(out)), concurrency=workers)
    return sorted(row["folder"] for row in done.iter_rows())


if __name__ == "__main__":
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    import quadpixel

    ray.init(ignore_reinit_error=True, logging_level="warning")
    count = int(sys.argv[3]) if len(sys.argv) == 4 else len(quadpixel.Configuration.open(sys.argv[1]))
    workers = max(1, int(ray.cluster_resources().get("CPU", 1)))
    for folder in render(sys.argv[1], sys.argv[2], count, workers):
        print(folder)
