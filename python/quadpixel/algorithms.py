"""The algorithms of `qpalgo`: on pictures, never on truth."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import Floats, floats

#: why a match is not to be trusted, by the number in `Matches.verdict`
VERDICTS = (
    "valid",
    "textureless",
    "low_correlation",
    "ambiguous",
    "search_edge",
    "outside",
    "uncertain",
    "inconsistent",
    "not_converged",
)


def set_threads(count: int) -> None:
    """Sets how many threads the calls of this process run on, and of those forked from it; 0: one per core. No result depends on it.

    >>> set_threads(0)
    """
    if count < 0:
        raise ValueError(f"threads is {count}; allowed: from 0")
    _native.set_threads(count)


def views(raw: Any, subpixels: str = "2x2") -> Floats:
    """The views of a sub-pixel mosaic.

    raw        (n*H, m*W, C) or (n*H, m*W) float32, linear
    subpixels  columns x rows
    returns    (m*n, H, W, C) float32, in stored order

    >>> views(np.arange(16, dtype=np.float32).reshape(4, 4))[:, 0, 0, 0]
    array([0., 1., 4., 5.], dtype=float32)
    """
    return _native.views(floats(raw, "raw", (2, 3)), subpixels)


@dataclass(frozen=True)
class Matches:
    """Shifts at nodes, of `disparity`: arrays (rows, columns, C), NaN where the verdict is not 0."""

    #: shift to the right, px
    dx: Floats
    #: shift down, px
    dy: Floats
    #: standard deviation along the worse axis, px
    sigma: Floats
    #: 0: valid; else a number of `VERDICTS`
    verdict: NDArray[np.uint8]
    #: columns (x) and rows (y) of the nodes in the reference, px
    x: NDArray[np.int64]
    y: NDArray[np.int64]


def disparity(view: Any, reference: Any, *, window: int = 21, search: int = 4, stride: int = 4, axis: str = "both") -> Matches:
    """How far each part of a view is shifted against a reference, by block matching, as `qpalgo disparity`.

    view, reference  (H, W) or (H, W, C) float32, linear, of one size
    window, search   side of the window (odd, 5 to 31) and largest shift looked for, px
    stride           distance of the nodes, px
    axis             "both", "horizontal" or "vertical"

    The shift is where a point appears in ``view`` minus where it appears in ``reference``: of the left and the right half it is x_L - x_R,
    positive for points nearer than the focus.

    >>> y, x = np.mgrid[:48, :64].astype(np.float32)
    >>> picture = lambda x: np.sin(0.7 * x + 0.2 * y) + np.cos(0.3 * x - 0.6 * y)
    >>> found = disparity(picture(x - 0.6), picture(x))
    >>> found.dx.shape, round(float(np.nanmedian(found.dx)), 2)
    ((5, 9, 1), 0.6)
    """
    view, reference = floats(view, "view", (2, 3)), floats(reference, "reference", (2, 3))
    if view.shape != reference.shape:
        raise ValueError(f"reference: shape is {reference.shape}; allowed: that of the view, {view.shape}")
    numbers, first = _native.disparity(view, reference, _lengths(window, search, stride), axis)
    rows, columns = numbers.shape[:2]
    dx, dy, sigma, verdict = (np.ascontiguousarray(numbers[..., i]) for i in range(4))
    place = lambda count: first + stride * np.arange(count, dtype=np.int64)
    return Matches(dx, dy, sigma, verdict.astype(np.uint8), place(columns), place(rows))


def _lengths(window: int, search: int, stride: int) -> Tuple[int, int, int]:
    for name, value in (("window", window), ("search", search), ("stride", stride)):
        if value < 0:
            raise ValueError(f"{name} {value}: allowed is a positive number of px")
    return window, search, stride


def _network(network: Union[bool, str, "os.PathLike[str]"]) -> Optional[str]:
    if isinstance(network, bool):
        return "" if network else None
    path = os.fspath(network)
    if not path:
        raise ValueError("network '': allowed is True, False or a file that learn/export.py wrote")
    return path


def dense_disparity(
    left: Any, right: Any, ratio: Any = None, *, picture: Any = None, network: Union[bool, str, "os.PathLike[str]"] = False
) -> Tuple[Floats, Floats]:
    """x_L - x_R at every pixel and its standard deviation, px, as `qpalgo disparity --dense`: expects the halves' two different blurs.

    left, right  (H, W) float32, linear, black at 0: one channel of two opposite halves of the pupil, at least 16 px a side
    ratio        of disparity to the blur's diameter: a number, or an array (H, W) as of `disparity_ratio`; None: 1/4
    picture      whose edges count, (H, W) or (H, W, C), linear: both halves' sum in colour, as the program takes; None: the mean of left and right
    network      True: as the trained network and matching tell it together (`--network`); a path: with another network
    returns      two arrays (H, W) float32; without a ratio the shift's scale and zero are free, and its deviation leaves them out

    >>> y, x = np.mgrid[:32, :48].astype(np.float32)
    >>> picture = 1.5 + np.sin(0.7 * x + 0.2 * y)
    >>> shift, sigma = dense_disparity(picture, picture)
    >>> shift.shape, bool(np.abs(shift).max() < 0.5)
    ((32, 48), True)
    """
    everywhere = None if ratio is None or np.ndim(ratio) > 0 else float(ratio)
    ratios = floats(ratio, "ratio", (2,)) if np.ndim(ratio) > 0 else None
    pair = (floats(left, "left", (2,)), floats(right, "right", (2,)))
    edges = None if picture is None else floats(picture, "picture", (2, 3))
    return _native.dense(*pair, everywhere, ratios, edges, _network(network))


def depth(
    views: Any,
    camera: Mapping[str, Any],
    *,
    kappa: Optional[float] = None,
    sparse: bool = False,
    network: Union[bool, str, "os.PathLike[str]"] = False,
    window: int = 21,
    search: int = 4,
    stride: int = 2,
) -> Tuple[Floats, Dict[str, Floats]]:
    """Metric depth from the shifts of opposite halves, as `qpalgo depth`.

    views    (m*n, H, W, C) float32, linear, in stored order; at least two columns or two rows
    camera   ``camera.json`` of a sample: what the camera knows of itself
    kappa    ratio of disparity to circle of confusion of a lens without aberrations; None: the camera's own curves
    sparse   only where windows match surely, NaN elsewhere; False: at every pixel whose disparity is one of the camera
    network  True: by matching and the trained network together (`--network`); a path: with another network
    window, search, stride  of the windows, px: with ``sparse``
    returns  depth (H, W), m from the first lens vertex; and a dict of (H, W) maps: confidence (0 to 1), sigma (m), disparity (px)

    >>> from quadpixel import Camera, Pixel, Scene, card
    >>> camera = Camera("wide_US20120327520A1_emb3", Pixel.ideal(4.0), focus_mm=500.0, width=64, height=48)
    >>> sample = camera.render(Scene.cards(card("noise", 400.0, texture_px=128)), rays_per_pixel=16)
    >>> metres, maps = depth(sample["views"], sample["camera"])
    >>> metres.shape, sorted(maps)
    ((48, 64), ['confidence', 'disparity', 'sigma'])
    """
    if sparse and network is not False:
        raise ValueError("sparse and network: allowed is one of them")
    windows = _lengths(window, search, stride) if sparse else None
    metres, beside = _native.depth(floats(views, "views", (3, 4)), json.dumps(camera), kappa, windows, _network(network))
    names = ("confidence", "sigma", "disparity")
    return metres, {name: np.ascontiguousarray(beside[..., i]) for i, name in enumerate(names)}


def calibrate(
    views: Any,
    camera: Mapping[str, Any],
    *,
    window: int = 31,
    search: int = 4,
    degree: int = 2,
    align: str = "centroid",
    smoothing: Optional[float] = None,
) -> Dict[str, Any]:
    """A calibration of the lens's aberration from a flat, textured chart in focus, as `qpalgo correct-aberrations --calibration`.

    views, camera  of the chart, as of `depth`
    window, search  of the matching, px; degree of the smooth field
    align           "centroid" or "texture"
    smoothing       for centroids, sigma of a Gaussian, px; None: what the views ask for
    returns         the words of the calibration file, for `correct_aberrations`
    """
    text = _native.calibrate(floats(views, "views", (3, 4)), json.dumps(camera), _lengths(window, search, degree), align, smoothing)
    calibration: Dict[str, Any] = json.loads(text)
    return calibration


def correct_aberrations(
    views: Any, camera: Mapping[str, Any], calibration: Mapping[str, Any]
) -> Tuple[Floats, Floats, NDArray[np.bool_]]:
    """Views without the aberration of a calibration, as `qpalgo correct-aberrations --apply`.

    views, camera  of a capture of the same camera, as of `depth`
    calibration    of `calibrate`, or a calibration file's words
    returns        views (m*n, H, W, C) float32, their sum (H, W, C) float32, and where all of them have it, (H, W) bool
    """
    return _native.correct(floats(views, "views", (3, 4)), json.dumps(camera), json.dumps(calibration))


def sharpness(picture: Any, preset: str = "wee-abstract") -> List[Dict[str, float]]:
    """Three measures of each channel of a picture, as `qpalgo sharpness`: de (with its count de_count), wee, gradient.

    picture  (H, W) or (H, W, C) float32, 0 to 1
    preset   "wee-abstract" or "table-2"

    >>> flat, = sharpness(np.full((16, 16), 0.5, dtype=np.float32))
    >>> flat["gradient"], flat["de_count"]
    (0.0, 1)
    """
    measured = _native.sharpness(floats(picture, "picture", (2, 3)), preset)
    return [{"de": de, "de_count": count, "wee": wee, "gradient": gradient} for de, count, wee, gradient in measured]


def refocus(
    views: Any, disparity: float, *, subpixels: str = "2x2", weights: Optional[Sequence[float]] = None, lobes: int = 4
) -> Tuple[Floats, NDArray[np.bool_]]:
    """The sum of the views, each shifted so that points of a disparity are sharp, as `qpalgo refocus`.

    views      (m*n, H, W, C) float32, linear, in stored order
    disparity  x_L - x_R of the points to be sharp, px
    weights    one per view, 0 or more; None: equal
    lobes      of the Lanczos kernel, 3 or 4
    returns    the picture (H, W, C) float32, and where all views have it, (H, W) bool

    >>> picture, valid = refocus(np.ones((4, 16, 16, 3), dtype=np.float32), 0.5)
    >>> float(picture[8, 8, 0]), valid.dtype
    (4.0, dtype('bool'))
    """
    given = None if weights is None else [float(weight) for weight in weights]
    return _native.refocus(floats(views, "views", (3, 4)), subpixels, float(disparity), given, lobes)
