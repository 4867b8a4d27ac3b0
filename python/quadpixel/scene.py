"""What stands before a camera: cards, scene files, and charts and worlds drawn by a seed."""

from __future__ import annotations

import copy
import json
import os
from dataclasses import dataclass, field
from typing import Any, Dict, Iterator, Mapping, Optional, Tuple, Union

from . import _native
from .lens import readable


@dataclass(frozen=True)
class Scene:
    """A scene as a recipe of `qpgen render` describes it: `Scene.cards` or `Scene.open`."""

    planes: Tuple[Mapping[str, Any], ...] = ()
    world: Optional[Mapping[str, Any]] = None
    environment: Tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def cards(cls, *cards: Mapping[str, Any], environment: Tuple[float, float, float] = (0.0, 0.0, 0.0)) -> "Scene":
        """Flat cards, each of `card`; the nearest one that a ray meets is seen.

        environment  linear RGB radiance beside them

        >>> scene = Scene.cards(card("noise", 900.0), card("alphabet", 400.0, extent={"of": "window", "x": 0.5, "y": 0.5, "size": 0.3}))
        >>> len(scene.planes)
        2
        """
        return cls(planes=tuple(dict(one) for one in cards), environment=environment)

    @classmethod
    def open(cls, path: "str | os.PathLike[str]", **placing: Any) -> "Scene":
        """A ``.gltf``, ``.glb`` or ``.obj`` file, by its first camera, or placed by the words of `qpgen render --scene`.

        placing  unit_mm, camera, distance_mm, size_mm, yaw_deg, pitch_deg, panorama, sky

        OSError for a file that cannot be read; ValueError, when it is rendered, for one that is no scene.
        """
        return cls(world={"source": {"file": {"path": readable(path), **placing}}})


def card(chart: Union[str, Mapping[str, Any]], distance_mm: float, **placing: Any) -> Dict[str, Any]:
    """A flat card of `Scene.cards`.

    chart        kind of chart ("alphabet", "dead-leaves", "resolution", "noise", "constant" ...), path of a picture, or a dict of its kind and
                 parameters
    distance_mm  depth of its middle, mm from the first lens vertex
    placing      other words of a recipe's plane: chart_seed, texture_px, extent, tilt_x_deg, tilt_y_deg, roll_deg, cutout

    >>> card("noise", 900.0, tilt_x_deg=10.0)["distance_mm"]
    900.0
    """
    return {"chart": chart, "distance_mm": float(distance_mm), **placing}


@dataclass(frozen=True)
class DrawnScene:
    """A scene that is drawn when it is put before a camera: its depths are multiples of the camera's focus."""

    seed: int
    index: int
    settings: Mapping[str, Any] = field(repr=False)


class _Drawn:
    """Scenes by number: the scene of a number does not depend on any other."""

    def __init__(self, seed: int, settings: Dict[str, Any]):
        #: seed of everything
        self.seed = seed
        #: the words of ``[scene]`` in a configuration of `qpgen dataset`
        self.settings = settings

    def __getitem__(self, index: int) -> DrawnScene:
        if index < 0:
            raise IndexError(f"{index}; allowed: from 0")
        return DrawnScene(self.seed, index, self.settings)

    def __iter__(self) -> Iterator[DrawnScene]:
        index = 0
        while True:
            yield self[index]
            index += 1

    def with_seed(self, seed: int) -> "_Drawn":
        """The same by another seed."""
        other = copy.copy(self)
        other.seed = seed
        return other


def _default_scene() -> Dict[str, Any]:
    scene: Dict[str, Any] = json.loads(_native.default_configuration())["scene"]
    scene.pop("world", None)
    return scene


class Charts(_Drawn):
    """Charts on tilted cards, one before another, drawn by a seed: ``charts[i]`` is the scene of sample i of `qpgen dataset`.

    settings  words of ``[scene]`` in a configuration, such as ``charts=["noise"]``, ``cards=2`` or ``cards={"min": 0, "max": 3}``; what is
              absent is as in the default one

    >>> Charts(seed=7, cards=1)[3].index
    3
    """

    def __init__(self, seed: int = 1, **settings: Any):
        super().__init__(seed, {**_default_scene(), **settings})


class Worlds(_Drawn):
    """Worlds of meshes, path-traced, drawn by a seed: rooms, table-tops, flying shapes in turn.

    settings  words of ``[scene.world]`` in a configuration, such as ``kinds=["room"]``, ``objects=20``; what is absent is as by default

    >>> Worlds(seed=7, kinds=["table-top"]).settings["world"]
    {'kinds': ['table-top']}
    """

    def __init__(self, seed: int = 1, **settings: Any):
        super().__init__(seed, {**_default_scene(), "world": settings})
