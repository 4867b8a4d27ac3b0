"""Main lenses."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Dict, List, Optional

import numpy as np

from . import _native


class Svg(str):
    """A drawing as SVG text, which a notebook shows; ``write`` it to keep it."""

    def _repr_svg_(self) -> str:
        return str(self)

    def write(self, path: "str | os.PathLike[str]") -> None:
        """Writes the drawing to a file."""
        with open(path, "w", encoding="utf8") as file:
            file.write(self)


def readable(path: "str | os.PathLike[str]") -> str:
    """``path`` as text, if there is such a file; else the OSError that says why not."""
    with open(path, "rb"):
        return os.fspath(path)


@dataclass(frozen=True)
class Lens:
    """A main lens by its prescription: `Lens.builtin` or `Lens.open`.

    >>> lens = Lens.builtin("wide_US20120327520A1_emb3")
    >>> print(f"{lens.info()['efl_mm']:.2f} mm, f/{lens.info()['f_number']:.1f}")
    4.23 mm, f/2.5
    """

    #: name in the library, or path
    name: str

    @staticmethod
    def names() -> List[str]:
        """Names of the built-in lenses, as `qpgen lens list` has them.

        >>> "lib_dgauss_50mm" in Lens.names()
        True
        """
        return _native.lens_names()

    @classmethod
    def builtin(cls, name: str) -> "Lens":
        """A lens of the library. ValueError for a name that is not in it.

        >>> Lens.builtin("lib_dgauss_50mm").name
        'lib_dgauss_50mm'
        """
        _native.lens_info(name)
        return cls(name)

    @classmethod
    def open(cls, path: "str | os.PathLike[str]") -> "Lens":
        """A lens from a ``.json``, ``.zmx`` or ``.seq`` file. OSError for a file that cannot be read, ValueError for one that is no lens."""
        name = readable(path)
        _native.lens_info(name)
        return cls(name)

    def info(self, focus_mm: Optional[float] = None, f_number: Optional[float] = None) -> Dict[str, Any]:
        """Title, source, efl_mm, f_number, half_field_deg and sensor_z_mm at the d line.

        focus_mm  depth in focus, mm from the first vertex; None: infinity
        f_number  stops the lens down; None: wide open

        >>> print(f"{Lens.builtin('lib_dgauss_50mm').info(f_number=4.0)['f_number']:.3f}")
        4.000
        """
        info: Dict[str, Any] = json.loads(_native.lens_info(self.name, focus_mm, f_number))
        return info

    def spots(self, focus_mm: Optional[float] = None, f_number: Optional[float] = None) -> List[Dict[str, Any]]:
        """Spot diagrams over the field at the F, d and C lines: a list of dicts, with arguments as of `info`.

        field_deg, wavelength_nm, rays_sent, rms_um (None where no ray passes), and points_mm: (N, 2) float64, x and y on the sensor, mm,
        camera frame.

        >>> spot = Lens.builtin("wide_US20120327520A1_emb3").spots()[1]
        >>> spot["field_deg"], spot["points_mm"].shape[1]
        (0.0, 2)
        """
        spots: List[Dict[str, Any]] = json.loads(_native.lens_spots(self.name, focus_mm, f_number))
        for spot in spots:
            spot["points_mm"] = np.array(spot["points_mm"], dtype=np.float64).reshape(-1, 2)
        return spots

    def layout(self, focus_mm: Optional[float] = None, f_number: Optional[float] = None) -> Svg:
        """The section of the lens with fans of rays, with arguments as of `info`.

        >>> Lens.builtin("lib_dgauss_50mm").layout().startswith("<svg")
        True
        """
        return Svg(_native.lens_layout(self.name, focus_mm, f_number))
