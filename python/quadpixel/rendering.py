"""Samples, and what renders them."""

from __future__ import annotations

import json
import os
from typing import Any, Callable, Dict, Mapping, Optional, Sequence, Tuple

from . import _native
from ._arrays import Floats
from .geometry import left_right
from .rgbd import Picture

#: hears of progress: called with rays done and rays of all, in the calling thread; what it raises stops the work
Progress = Callable[[int, int], object]


class Sample(Dict[str, Any]):
    """A rendered sample: a dict of the arrays of `decode`, in full precision, with ``id``, ``meta`` and ``camera``.

    ``meta`` is ``meta.json`` but its ``contents``, the hashes of files. `write` makes the files.
    """

    _rendered: Optional[_native.Rendered]

    def __init__(self, rendered: _native.Rendered, columns: int):
        meta, camera = rendered.descriptions()
        super().__init__(rendered.arrays())
        self["meta"] = json.loads(meta)
        self["camera"] = json.loads(camera)
        self["id"] = self["meta"]["id"]
        if columns > 1:
            self["left_right"] = left_right(self["disparity"], self["meta"])
        self._rendered = rendered

    def write(self, folder: "str | os.PathLike[str]") -> None:
        """Writes the sample's files into a new folder: the bytes of `qpgen render`, or of `qpgen dataset` for a scene that was drawn.

        OSError where the disk fails, ValueError where the folder is there already or the sample went through another process.
        """
        if self._rendered is None:
            raise ValueError("write: the sample comes from another process; allowed: where it was rendered")
        self._rendered.write(os.fspath(folder))

    def __reduce__(self) -> Tuple[Any, ...]:
        return _unpickled, (dict(self),)


def _unpickled(items: Dict[str, Any]) -> Sample:
    sample = Sample.__new__(Sample)
    sample.update(items)
    sample._rendered = None
    return sample


class Renderer:
    """What renders recipes, and keeps the response tables that they share."""

    def __init__(self) -> None:
        self._responses = _native.Responses()

    def __reduce__(self) -> Tuple[Any, ...]:
        return Renderer, ()

    def render(self, recipe: Mapping[str, Any], index: int = 0, hash: Optional[str] = None, progress: Optional[Progress] = None) -> Sample:
        """The sample of a recipe (the ``scene.parameters`` of a ``meta.json``), as number ``index`` of a configuration of that hash."""
        return Sample(self._responses.render(json.dumps(recipe), index, hash, progress), _columns(recipe))

    def convert(self, recipe: Dict[str, Any], picture: Picture, level: str, progress: Optional[Progress] = None) -> Sample:
        """The sample of a picture with depth, by a recipe without one."""
        if picture.is_file:
            rgbd, width, height = picture.described()
            return self.render({**_sized(recipe, width, height), "rgbd": {**rgbd, "level": level}}, progress=progress)
        light, depth, scales = picture.arrays()
        recipe = _sized(recipe, light.shape[1], light.shape[0])
        meaning = json.dumps(picture.meaning)
        rendered = _native.convert(self._responses, json.dumps(recipe), (light, depth), scales, meaning, level, progress)
        return Sample(rendered, _columns(recipe))

    def kernels(
        self, recipe: Mapping[str, Any], depths_m: Sequence[float], fields: Tuple[int, int], rays: int, source: str
    ) -> Dict[str, Any]:
        """The bank of kernels of a recipe's camera."""
        depths = [float(depth) for depth in depths_m]
        bank = _native.kernels(self._responses, json.dumps(recipe), depths, (int(fields[0]), int(fields[1])), rays, source)
        bank["meta"] = json.loads(bank["meta"])
        return bank

    def truth(self, recipe: Mapping[str, Any], depth: Floats) -> Tuple[Floats, Floats, Floats]:
        """Traced and paraxial disparity, and circle of confusion, px."""
        return self._responses.truth(json.dumps(recipe), depth)


def _columns(recipe: Mapping[str, Any]) -> int:
    return int(str(recipe["sensor"]["subpixels"]).split("x")[0])


def _sized(recipe: Mapping[str, Any], width: int, height: int) -> Dict[str, Any]:
    return {**recipe, "sensor": {**recipe["sensor"], "width": width, "height": height}}
