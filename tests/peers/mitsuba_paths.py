"""Our pictures against Mitsuba 3's, pixel by pixel.

    scripts/peers

installs Mitsuba, has our pictures made by `tests/peers/paths.rs` and runs this with their folder and the number of Mitsuba's passes.

For every pixel and channel z = (ours - theirs) / sqrt(var_ours + var_theirs), both variances estimated from independent
samples. If both renderers compute the same light, z has mean 0 and mean square 1. Stated before any run:

- no pixel's two-sided p-value is below alpha = 0.01 after the correction for their number (Sidak), among pixels whose
  brightest sample does not dominate (at least 0.2 % of the mean's relative error, both sides noisy);
- the mean of z over the picture is below 5 standard errors (channels of a pixel are correlated: a third of the values count).

Pixels without variance (a lamp seen directly) must agree to 1e-4.
"""

import sys
from math import erfc, sqrt

import mitsuba as mi
import numpy as np

folder = sys.argv[1]
mi.set_variant("scalar_rgb")
SIDE, SPP = 96, 4
PASSES = int(sys.argv[2]) if len(sys.argv) > 2 else 64

rgb = lambda c: {"type": "rgb", "value": c}
diffuse = lambda c: {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(c)}}
metal = lambda roughness: {"type": "twosided", "bsdf": {
    "type": "roughconductor", "material": "none", "distribution": "ggx", "alpha": roughness**2}}
mirror = {"type": "twosided", "bsdf": {"type": "conductor", "material": "none"}}
glass = lambda ior: {"type": "dielectric", "int_ior": ior, "ext_ior": 1.0}

BOX = [
    diffuse([0.73, 0.73, 0.73]), diffuse([0.63, 0.065, 0.05]), diffuse([0.14, 0.45, 0.091]),
    diffuse([0.0, 0.0, 0.0]), glass(1.5), metal(0.4),
]
OPEN = [diffuse([0.5, 0.4, 0.3]), metal(0.2), mirror, glass(1.6)]


def panorama(width=512, height=256):
    """The panorama of `tests/peers/paths.rs` where Mitsuba has its texels: columns from -z at (x + 1/2)/W, rows at y/(H - 1)."""
    u = (((np.arange(width) + 0.5) / width + 0.5) % 1.0)[None, :]
    v = (np.arange(height) / (height - 1))[:, None]
    lobe = np.exp(-((u - 0.7) ** 2 + (v - 0.3) ** 2) / 0.01)
    sky = 0.3 + 0.2 * np.cos(np.pi * v) + 0 * u
    image = np.stack([sky + 3 * lobe, sky + 2 * lobe, 1.3 * sky + lobe], axis=2)
    return {"type": "envmap", "bitmap": mi.Bitmap(image.astype(np.float32))}


def scene(name, half_width, lens):
    to_world = mi.ScalarTransform4f().look_at([0, 0, 0], [0, 0, -1], [0, 1, 0])
    sensor = {
        "type": "thinlens" if lens else "perspective",
        "fov": float(np.degrees(2 * np.arctan(half_width))), "fov_axis": "x",
        "near_clip": 1.0, "far_clip": 1e5, "to_world": to_world,
        "film": {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"},
                 "component_format": "float32"},
        "sampler": {"type": "independent"},
    }
    if lens:
        sensor |= {"aperture_radius": 15.0, "focus_distance": lens}
    # Seven bounces: eight segments.
    d = {"type": "scene", "integrator": {"type": "path", "max_depth": 8, "rr_depth": 100}, "sensor": sensor}
    for i, bsdf in enumerate(BOX if name == "box" else OPEN):
        d[f"m{i}"] = {"type": "ply", "filename": f"{folder}/{name}/{i}.ply", "face_normals": True, "bsdf": bsdf}
    if name == "box":
        d["m3"]["emitter"] = {"type": "area", "radiance": rgb([15.0, 12.0, 8.0])}
    else:
        d["sky"] = panorama()
        d["sun"] = {"type": "directional", "direction": [-0.5, -1.0, -0.3], "irradiance": rgb([2.0, 1.8, 1.5])}
        # Intensity per mm squared, where ours is per m squared.
        d["point"] = {"type": "point", "position": [-100, 150, -650], "intensity": rgb([1e4, 2e4, 3e4])}
    return mi.load_dict(d)


failed = False
for name, half_width, focus in [("box", 0.28, 720.0), ("open", 0.35, 700.0)]:
    for kind, lens in [("pinhole", None), ("thin", focus)]:
        s = scene(name, half_width, lens)
        theirs = np.stack([np.array(mi.render(s, spp=SPP, seed=k), dtype=np.float64)[:, :, :3] for k in range(PASSES)])
        mean, var = theirs.mean(0), theirs.var(0, ddof=1) / PASSES
        ours = np.array(mi.Bitmap(f"{folder}/{name}_{kind}.exr"), dtype=np.float64)[:, :, :3]
        our_var = np.array(mi.Bitmap(f"{folder}/{name}_{kind}_variance.exr"), dtype=np.float64)[:, :, :3]
        still = (var < 1e-12) & (our_var < 1e-12)
        off = np.abs(ours - mean)[still] / np.maximum(mean[still], 1e-3)
        noisy = (var > 0) & (our_var > 0)
        z = ((ours - mean) / np.sqrt(np.maximum(var + our_var, 1e-300)))[noisy]
        tail = 1 - (1 - 0.01) ** (1 / z.size)
        worst = erfc(np.abs(z).max() / sqrt(2))
        bias = z.mean() / sqrt(3 / z.size)
        ok = worst > tail and abs(bias) < 5 and (off.size == 0 or off.max() < 1e-4)
        failed |= not ok
        print(f"{name:5} {kind:8} {z.size} values: mean {ours.mean():.5f} / {mean.mean():.5f}, "
              f"mean z {z.mean():+.4f} ({bias:+.2f} standard errors), mean z^2 {np.mean(z * z):.3f}, "
              f"largest |z| {np.abs(z).max():.2f} (p {worst:.1e}, allowed {tail:.1e}), "
              f"still pixels off {off.max() if off.size else 0:.1e}: {'agrees' if ok else 'DIFFERS'}")
sys.exit(failed)
