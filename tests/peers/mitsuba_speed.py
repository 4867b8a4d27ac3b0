"""Paths per second of Mitsuba 3 on the scene of `cargo bench --bench paths`, which `cargo run --release --example peer_paths -- FOLDER`
writes to FOLDER/speed (`scripts/peers --speed` runs both).

    python mitsuba_speed.py FOLDER/speed [variant]      (default scalar_rgb)

`llvm_ad_rgb` needs libLLVM: `apt-get install libllvm19` on Debian 12, and DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1.

One thread; time on the processor. Same camera, materials, lamp and path length as the bench: `max_depth` 5, no Russian roulette.
"""

import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np

folder = sys.argv[1]
variant = sys.argv[2] if len(sys.argv) > 2 else "scalar_rgb"
mi.set_variant(variant)
dr.set_thread_count(1)
SIDE = 256

rgb = lambda c: {"type": "rgb", "value": c}
diffuse = lambda c: {"type": "diffuse", "reflectance": rgb(c)}
bsdfs = [
    diffuse([0.7] * 3),
    diffuse([0.6, 0.1, 0.1]),
    diffuse([0.1, 0.5, 0.1]),
    {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": 0.25},
    diffuse([0.0] * 3),
]
scene = {
    "type": "scene",
    "integrator": {"type": "path", "max_depth": 5, "rr_depth": 100},
    "sensor": {
        "type": "perspective",
        "fov": float(np.degrees(2 * np.arctan(0.5))),
        "fov_axis": "x",
        "near_clip": 1.0,
        "far_clip": 1e5,
        "to_world": mi.ScalarTransform4f().look_at([0, 0, 0], [0, 0, -1], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent"},
    },
}
for index, bsdf in enumerate(bsdfs):
    # The bench's surfaces reflect on both sides.
    shape = {
        "type": "ply",
        "filename": f"{folder}/{index}.ply",
        "face_normals": True,
        "bsdf": {"type": "twosided", "bsdf": bsdf},
    }
    if index == 4:
        shape["emitter"] = {"type": "area", "radiance": rgb([12.0] * 3)}
    scene[f"shape{index}"] = shape
scene = mi.load_dict(scene)
mi.render(scene, spp=1)
speeds = []
for seed in range(5):
    began = time.process_time()
    image = np.array(mi.render(scene, spp=4, seed=seed))
    speeds.append(4 * SIDE * SIDE / (time.process_time() - began) * 1e-6)
speeds.sort()
print(f"Mitsuba {mi.__version__} {variant}, one thread: {speeds[2]:.3f} M paths/s "
      f"(median of 5; {speeds[0]:.3f} to {speeds[4]:.3f}), mean radiance {image.mean():.4f}")
