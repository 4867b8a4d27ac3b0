"""Configurations of `qpgen dataset`: distributions that samples are drawn from."""

from __future__ import annotations

import copy
import json
import os
from typing import Any, Dict, Mapping, Optional, Tuple

from . import _native
from .rendering import Progress, Renderer, Sample


class Configuration:
    """Distributions of lenses, pixels, focus and scenes, as in the TOML file of `qpgen dataset`: `Configuration.open`, or the default one.

    changes  words in the place of the default ones; a dict changes only what it names, and None takes a word away

    >>> config = Configuration(seed=3, rays_per_pixel=4, response={"model": "geometric", "pixels": None},
    ...                        sensor={"width": 12, "height": 8, "pitch_um": 8.0}, scene={"texture_px": 64})
    >>> config.render(0)["views"].shape
    (4, 8, 12, 3)
    """

    def __init__(self, **changes: Any):
        #: all words, as the file has them
        self.settings: Dict[str, Any] = json.loads(_native.default_configuration())
        _change(self.settings, changes)
        self.settings = json.loads(_native.listed(json.dumps(self.settings)))
        self._renderer = Renderer()
        self.recipe(0)

    @classmethod
    def open(cls, path: "str | os.PathLike[str]", **changes: Any) -> "Configuration":
        """Reads a configuration's TOML. OSError for a file that cannot be read, ValueError for one that is none."""
        with open(path, encoding="utf8") as file:
            text = file.read()
        config = cls.__new__(cls)
        config.settings = json.loads(_native.configuration(text, os.fspath(path)))
        _change(config.settings, changes)
        config.settings = json.loads(_native.listed(json.dumps(config.settings)))
        config._renderer = Renderer()
        config.recipe(0)
        return config

    @property
    def seed(self) -> int:
        """Seed of everything."""
        return int(self.settings["seed"])

    def __len__(self) -> int:
        return int(self.settings["count"])

    def with_seed(self, seed: int) -> "Configuration":
        """The same by another seed."""
        other = copy.copy(self)
        other.settings = {**self.settings, "seed": seed}
        return other

    def _drawn(self, index: int) -> Tuple[Dict[str, Any], str]:
        if index < 0:
            raise IndexError(f"{index}; allowed: from 0")
        recipe, hash = _native.draw(json.dumps(self.settings), index)
        return json.loads(recipe), hash

    def recipe(self, index: int) -> Dict[str, Any]:
        """Everything that makes sample ``index``, drawn: the ``scene.parameters`` of its ``meta.json``."""
        return self._drawn(index)[0]

    def render(self, index: int, progress: Optional[Progress] = None) -> Sample:
        """Sample ``index``, with the numbers of `qpgen dataset`; see `Camera.render`."""
        recipe, hash = self._drawn(index)
        return self._renderer.render(recipe, index, hash, progress)


def _change(settings: Dict[str, Any], changes: Mapping[str, Any]) -> None:
    for name, value in changes.items():
        if value is None:
            settings.pop(name, None)
        elif isinstance(value, dict) and isinstance(settings.get(name), dict):
            _change(settings[name], value)
        else:
            settings[name] = value
