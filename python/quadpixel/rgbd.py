"""Pictures with depth: what a camera converts to the views of its sub-pixels."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, Mapping, Optional, Sequence, Tuple

import numpy as np

from . import _native
from ._arrays import Floats

#: a file, or an array (also of torch or JAX, on the CPU)
Source = Any

_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_WORDS = ("encoding", "kind", "unit", "hole", "nearest_m", "baseline_m", "disparity_offset_px", "intrinsics", "hfov_deg")


@dataclass(frozen=True)
class Picture:
    """A picture and its depth, each a file or an array, and what their numbers mean.

    image  (H, W, 3), (H, W, 4), whose alpha is dropped, or (H, W); whole numbers are sRGB, floats linear, 1 = white. Or a PNG, JPEG, TIFF, EXR,
           PFM or NPY file
    depth  (H, W), or a PNG, TIFF, EXR, PFM or NPY file: z in m from the first lens vertex, if no word says another thing

    meaning  words of `qpgen convert`: ``kind`` ("z", "ray", "inverse", "disparity"), ``unit`` (metres per number, or "m", "cm", "mm"; whole numbers need
             one), ``encoding`` ("srgb", "linear"), ``hole`` (a number that marks holes), ``nearest_m``, ``baseline_m``, ``disparity_offset_px``,
             ``hfov_deg`` or ``intrinsics`` (dict of fx_px, fy_px, cx_px, cy_px). With files, a sidecar says what is absent.

    Holes are: NaN, 0 and below of z and ray; NaN, infinity and below 0 of inverse depth; NaN, infinity, 0 and below of disparity. They take the
    farthest depth beside them, and ``valid`` says no there.

    >>> Picture(np.ones((8, 12, 3), dtype=np.float32), np.full((8, 12), 700, dtype=np.uint16), unit="mm").size
    (12, 8)
    """

    image: Source
    depth: Source
    meaning: Mapping[str, Any] = field(default_factory=dict)

    def __init__(self, image: Source, depth: Source, **meaning: Any):
        given = dict(meaning)
        unknown = [name for name in given if name not in _WORDS]
        if unknown:
            raise ValueError(f"meaning: {unknown[0]!r}; allowed: {', '.join(_WORDS)}")
        unit = given.get("unit")
        if isinstance(unit, str):
            if unit not in _UNITS:
                raise ValueError(f"unit is {unit!r}; allowed: m, cm, mm, or metres per number")
            given["unit"] = _UNITS[unit]
        if _is_file(image) != _is_file(depth):
            raise ValueError("image and depth: one is a file and the other is not; allowed: two files or two arrays")
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "depth", depth)
        object.__setattr__(self, "meaning", {name: value for name, value in given.items() if value is not None})

    @property
    def is_file(self) -> bool:
        """Whether it is in files."""
        return _is_file(self.image)

    def described(self) -> Tuple[Dict[str, Any], int, int]:
        """Of files: the ``rgbd`` of a recipe, columns and rows. OSError where a file is missing, ValueError where it is none."""
        for path in (self.image, self.depth):
            with open(path, "rb"):
                pass
        recipe, width, height = _native.picture(os.fspath(self.image), os.fspath(self.depth), json.dumps(self.meaning))
        return json.loads(recipe), width, height

    @property
    def size(self) -> Tuple[int, int]:
        """Columns and rows."""
        if self.is_file:
            return self.described()[1:]
        height, width = np.shape(self.image)[:2]
        return width, height

    def arrays(self) -> Tuple[Floats, Floats, Tuple[Optional[float], Optional[float]]]:
        """Of arrays: picture and depth as float32, and the largest number of each that is of whole numbers."""
        light, light_scale = _numbers(self.image, "image", (2, 3))
        depth, depth_scale = _numbers(self.depth, "depth", (2,))
        return light, depth, (light_scale, depth_scale)


def _is_file(source: Source) -> bool:
    return isinstance(source, (str, os.PathLike))


def _numbers(value: Any, name: str, dimensions: Tuple[int, ...]) -> Tuple[Floats, Optional[float]]:
    """Numbers as they are, as float32, and the largest that their type holds, for whole numbers. ValueError for what is no picture."""
    if not hasattr(value, "__array__") and hasattr(value, "__dlpack__"):
        value = np.from_dlpack(value)
    array = np.asarray(value)
    if array.dtype.kind not in "fui" or array.dtype.itemsize > 8:
        raise ValueError(f"{name}: dtype is {array.dtype}; allowed: floats and whole numbers")
    if array.ndim not in dimensions or array.size == 0 or (array.ndim == 3 and array.shape[2] not in (3, 4)):
        allowed = "(H, W)" if dimensions == (2,) else "(H, W), (H, W, 3) or (H, W, 4)"
        raise ValueError(f"{name}: shape is {array.shape}; allowed: {allowed}, at least one pixel")
    scale = None if array.dtype.kind == "f" else float(np.iinfo(array.dtype).max)
    return np.ascontiguousarray(array, dtype=np.float32), scale


class Pictures:
    """Pictures with depth by number, taken in turn: a source of `quadpixel.torch.OnTheFly`.

    images   files or arrays, as many as ``depths``; a sequence that makes them when asked is fine
    depths   their depths
    meaning  as of `Picture`, of all

    >>> pictures = Pictures([np.ones((8, 12, 3), dtype=np.float32)], [np.full((8, 12), 0.7, dtype=np.float32)])
    >>> len(pictures), pictures[5].size
    (1, (12, 8))
    """

    def __init__(self, images: Sequence[Source], depths: Sequence[Source], **meaning: Any):
        if len(images) != len(depths):
            raise ValueError(f"images and depths: {len(images)} and {len(depths)}; allowed: as many")
        if len(images) == 0:
            raise ValueError("images is empty; allowed: at least one")
        self._images, self._depths, self._meaning = images, depths, meaning
        self[0]

    @classmethod
    def open(cls, images: "str | os.PathLike[str]", depths: "str | os.PathLike[str]", **meaning: Any) -> "Pictures":
        """Files of two folders, by the same stems. ValueError where a stem is in one of them only."""
        by_stem = [{os.path.splitext(name)[0]: os.path.join(os.fspath(folder), name) for name in sorted(os.listdir(folder))
                    if not name.startswith(".") and not name.endswith(".json")} for folder in (images, depths)]
        alone = sorted(set(by_stem[0]) ^ set(by_stem[1]))
        if alone or not by_stem[0]:
            raise ValueError(f"{os.fspath(images)} and {os.fspath(depths)}: {alone[0] if alone else 'no file'!r}; allowed: the same stems in both")
        return cls(list(by_stem[0].values()), [by_stem[1][stem] for stem in by_stem[0]], **meaning)

    def __len__(self) -> int:
        return len(self._images)

    def __getitem__(self, number: int) -> Picture:
        """Picture ``number`` modulo their count."""
        if number < 0:
            raise IndexError(f"{number}; allowed: from 0")
        place = number % len(self)
        return Picture(self._images[place], self._depths[place], **self._meaning)

    def __iter__(self) -> Iterator[Picture]:
        return (self[i] for i in range(len(self)))


__all__ = ["Picture", "Pictures", "Source"]
