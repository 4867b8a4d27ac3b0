"""Samples for the eye: a figure by Matplotlib, or a recording for the Rerun viewer. Each is an extra."""

from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats
from .geometry import subpixel_counts, subpixel_names

#: maps that `show` draws: key, title, whether it has a sign
_MAPS = (
    ("depth", "depth, m", False),
    ("left_right", "x_L - x_R, px", True),
    ("coc", "circle of confusion, px", True),
    ("occlusion", "occlusion", False),
)


def picture(linear: Floats, white: Optional[float] = None) -> Floats:
    """A linear picture as sRGB from 0 to 1; ``white``: the value that becomes 1 (None: the brightest but one in a hundred).

    >>> picture(np.array([0.0, 0.5, 1.0], dtype=np.float32), white=1.0).round(3)
    array([0.   , 0.735, 1.   ], dtype=float32)
    """
    light = np.clip(linear / (white or max(float(np.quantile(linear, 0.99)), 1e-12)), 0.0, 1.0)
    srgb: Floats = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-12) ** (1 / 2.4) - 0.055).astype(np.float32)
    return srgb


def show(sample: Mapping[str, Any], columns: int = 4) -> Any:
    """A Matplotlib figure of a sample: the sum, the views, the target and the maps that it has, NaN in grey.

    sample   of `Camera.render`, or of a `Dataset` with at least the item ``views``
    columns  pictures in a row
    """
    import matplotlib.pyplot as plt

    panels = _panels(sample)
    rows = -(-len(panels) // columns)
    figure, axes = plt.subplots(rows, columns, figsize=(3.2 * columns, 2.6 * rows), squeeze=False, constrained_layout=True)
    for axis in axes.flat:
        axis.set_axis_off()
    for axis, (title, values, options) in zip(axes.flat, panels):
        drawn = axis.imshow(values, interpolation="nearest", **options)
        axis.set_title(title, fontsize=9)
        if options:
            drawn.cmap.set_bad("0.6")
            figure.colorbar(drawn, ax=axis, shrink=0.8)
    return figure


def _panels(sample: Mapping[str, Any]) -> List[Tuple[str, Floats, Dict[str, Any]]]:
    views = sample["views"]
    white = max(float(np.quantile(sample["sum"], 0.99)), 1e-12)
    panels: List[Tuple[str, Floats, Dict[str, Any]]] = [("sum", picture(sample["sum"], white), {})]
    names = subpixel_names(*subpixel_counts(sample["meta"]))
    panels += [(f"view {name}", picture(view, white / len(views)), {}) for name, view in zip(names, views)]
    if "target" in sample:
        panels.append(("all in focus", picture(sample["target"], white), {}))
    for key, title, signed in _MAPS:
        if key not in sample:
            continue
        values = np.where(np.isfinite(sample[key]), sample[key], np.nan).astype(np.float32)
        most = float(np.nanmax(np.abs(values))) if np.isfinite(values).any() else 1.0
        # From blue over white to red, as in the contact sheets of datasets.
        options: Dict[str, Any] = {"cmap": "RdBu_r", "vmin": -most, "vmax": most} if signed else {"cmap": "viridis"}
        if key == "occlusion":
            options.update(vmin=0.0, vmax=1.0)
        panels.append((title, values, options))
    return panels


def points(sample: Mapping[str, Any]) -> Tuple[Floats, NDArray[np.uint8]]:
    """The surface that a sample shows: places (N, 3) float32, m, X right, Y down, Z into the scene, from the pinhole; and colours (N, 3)."""
    pinhole = sample["camera"]["intrinsics"]
    depth = sample["depth"] + pinhole["pinhole_behind_vertex_m"]
    y, x = np.mgrid[: depth.shape[0], : depth.shape[1]]
    place = np.stack([(x - pinhole["cx_px"]) / pinhole["fx_px"], (y - pinhole["cy_px"]) / pinhole["fy_px"], np.ones_like(depth)], axis=-1)
    known = np.isfinite(depth)
    colours = (picture(sample["target"]) * 255.0 + 0.5).astype(np.uint8)
    return (place * depth[..., None])[known].astype(np.float32), colours[known]


def to_rerun(sample: Mapping[str, Any], path: "str | os.PathLike[str]", maps: Sequence[str] = ("left_right", "coc", "occlusion")) -> None:
    """Writes a recording (``.rrd``) for the Rerun viewer: views, depth, camera, points of the surface, and maps.

    sample  with the items views, target and depth
    path    new file
    """
    import rerun

    pinhole = sample["camera"]["intrinsics"]
    height, width = sample["depth"].shape
    recording = rerun.RecordingStream("quadpixel")
    recording.save(os.fspath(path))
    recording.log("camera", rerun.Pinhole(focal_length=[pinhole["fx_px"], pinhole["fy_px"]],
                                          principal_point=[pinhole["cx_px"], pinhole["cy_px"]], resolution=[width, height]))
    bytes_of = lambda linear, white=None: (picture(linear, white) * 255.0 + 0.5).astype(np.uint8)
    white = max(float(np.quantile(sample["sum"], 0.99)), 1e-12)
    recording.log("camera/target", rerun.Image(bytes_of(sample["target"])))
    recording.log("camera/depth", rerun.DepthImage(np.nan_to_num(sample["depth"], posinf=0.0), meter=1.0))
    names = subpixel_names(*subpixel_counts(sample["meta"]))
    for name, view in zip(names, sample["views"]):
        recording.log(f"views/{name}", rerun.Image(bytes_of(view, white / len(names))))
    for name in maps:
        if name in sample:
            recording.log(f"maps/{name}", rerun.Tensor(sample[name], dim_names=["row", "column"]))
    places, colours = points(sample)
    recording.log("surface", rerun.Points3D(places, colors=colours))
    recording.flush()
