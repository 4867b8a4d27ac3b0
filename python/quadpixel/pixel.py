"""Pixels, and what they absorb of light from each direction."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from typing import Any, Dict, List, Optional

import numpy as np

from . import _native
from ._arrays import Floats
from .lens import readable

#: the words that name pixel models
MODELS = ("geometric", "wave", "fdtd", "corrected", "rcwa")


@dataclass(frozen=True)
class Pixel:
    """A pixel below a microlens: `Pixel.builtin`, `Pixel.open` or `Pixel.ideal`.

    >>> pixel = Pixel.builtin("2.8um")
    >>> pixel.pitch_um, pixel.subpixels
    (2.8, '2x2')
    """

    #: built-in name or path; None: the ideal box
    name: Optional[str]
    #: side of the pixel, µm
    pitch_um: float
    #: sub-pixels, columns x rows
    subpixels: str
    #: focal length of the ideal box's microlens, µm; None: as fits the F-number of the main lens
    focal_length_um: Optional[float] = None

    @staticmethod
    def names() -> List[str]:
        """Names of the built-in pixels.

        >>> "1.6um" in Pixel.names()
        True
        """
        return _native.pixel_names()

    @classmethod
    def builtin(cls, name: str, subpixels: Optional[str] = None) -> "Pixel":
        """A built-in pixel; ``subpixels``: columns x rows, such as "2x1"; None: its own. ValueError for another name.

        >>> Pixel.builtin("1.6um", subpixels="2x1").subpixels
        '2x1'
        """
        info = json.loads(_native.pixel_info(name))
        return cls(name, info["pitch_um"], subpixels or info["subpixels"])

    @classmethod
    def open(cls, path: "str | os.PathLike[str]", subpixels: Optional[str] = None) -> "Pixel":
        """A pixel from a ``.toml`` file. OSError for a file that cannot be read, ValueError for one that is no pixel."""
        return cls.builtin(readable(path), subpixels)

    @classmethod
    def ideal(cls, pitch_um: float, subpixels: str = "2x2", focal_length_um: Optional[float] = None) -> "Pixel":
        """The ideal box: each sub-pixel takes all the light from its part of the pupil.

        >>> Pixel.ideal(2.8).name is None
        True
        """
        return cls(None, float(pitch_um), subpixels, focal_length_um)

    def response(self, model: Optional[str] = None, preset: str = "standard", shifts: Optional[int] = None) -> "Response":
        """What the pixel absorbs, by a model.

        model   "wave" (the default), "fdtd", "rcwa" or "corrected"; of the ideal box "geometric"
        preset  how finely the model computes: "draft", "standard", "reference"
        shifts  lens shifts per pitch of a table of all of them; None: the table of the centred lens, moved along

        >>> Pixel.ideal(2.8, focal_length_um=7.0).response()(theta_deg=3.0, phi_deg=45.0)
        array([0., 0., 0., 1.], dtype=float32)
        """
        known = "geometric" if self.name is None else "wave"
        model = model or known
        if model not in MODELS:
            raise ValueError(f"model is {model!r}; allowed: {', '.join(MODELS)}")
        if (model == "geometric") != (self.name is None):
            raise ValueError(f"model is {model!r} of the pixel {self.name or 'ideal'!r}; allowed: geometric of the ideal one, others of others")
        return Response(self, model, preset, shifts)


@dataclass(frozen=True)
class Response:
    """A pixel's angular response P by a model, of `Pixel.response`: call it with angles, or give it to a `Camera`."""

    pixel: Pixel
    model: str
    preset: str = "standard"
    shifts: Optional[int] = None

    def recipe(self) -> Dict[str, Any]:
        """The words of a recipe's ``response``."""
        if self.pixel.name is None:
            return {"model": "geometric", "focal_length_um": self.pixel.focal_length_um}
        words: Dict[str, Any] = {"model": self.model, "pixel": self.pixel.name, "preset": self.preset}
        if self.shifts is not None:
            words["shifts"] = self.shifts
        return words

    def __call__(self, theta_deg: Any, phi_deg: Any = 0.0) -> Floats:
        """P of each sub-pixel for light of 550 nm under a centred microlens.

        theta_deg, phi_deg  angle to the axis and azimuth, deg, arrays or numbers that broadcast to shape S: at phi 0 light of positive
                            theta goes towards positive x of the sensor
        returns             S + (m*n,) float32, 0 to 1, sub-pixels in stored order

        A wave table is made on first use (seconds, once) and kept; a table of fdtd, rcwa or corrected is shipped or has been made by
        ``qpgen response``, else ValueError says how.
        """
        theta, phi = np.broadcast_arrays(np.asarray(theta_deg, dtype=np.float64), np.asarray(phi_deg, dtype=np.float64))
        if not (np.isfinite(theta).all() and np.isfinite(phi).all() and (np.abs(theta) < 90.0).all()):
            raise ValueError("theta_deg: allowed: above -90, below 90, and finite phi_deg")
        if self.model == "geometric" and self.pixel.focal_length_um is None:
            raise ValueError("focal_length_um is absent; the ideal pixel has one by its main lens only, or by Pixel.ideal")
        sensor = {"pitch_um": self.pixel.pitch_um, "subpixels": self.pixel.subpixels, "width": 1, "height": 1}
        recipe = {
            "lens": {"name": "wide_US20120327520A1_emb3"},
            "sensor": sensor,
            "response": self.recipe(),
            "render": {"rays_per_pixel": 1, "seed": 1},
        }
        weights = _native.Responses().weights(json.dumps(recipe), theta.ravel().tolist(), phi.ravel().tolist())
        return weights.reshape(theta.shape + (-1,))
