"""Cameras."""

from __future__ import annotations

import json
from typing import Any, Dict, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _native
from ._arrays import Floats, floats
from .geometry import left_right
from .lens import Lens
from .pixel import Pixel, Response
from .rendering import Progress, Renderer, Sample
from .rgbd import Picture
from .scene import DrawnScene, Scene

class Camera:
    """A lens, focused, before a sensor of pixels that see the pupil in parts.

    lens      a `Lens`, or the name of a built-in one
    pixel     a `Pixel` (by its usual model), or a `Response` of one
    focus_mm  depth in focus, mm from the first lens vertex; None: infinity
    f_number  stops the lens down; None: wide open

    width, height    microlenses in a row, and rows
    window           where on the sensor: None (around the axis), or as in a configuration ``{"at": "chief-ray-angle", "theta_deg": 10,
                     "phi_deg": 45}``
    microlens_shift  "chief-ray", "centred", or ``{"rule": "linear", "um_per_mm": 0.3}``
    settings         other words of a configuration: mosaic, readout, spectrum, effects, registration, tolerance, footprints, lens_tracing

    >>> camera = Camera("wide_US20120327520A1_emb3", Pixel.ideal(8.0), focus_mm=500.0, width=12, height=8)
    >>> sample = camera.render(Scene.cards(card("noise", 400.0, texture_px=64)), rays_per_pixel=4)
    >>> sample["views"].shape, sample["views"].dtype
    ((4, 8, 12, 3), dtype('float32'))
    """

    def __init__(
        self,
        lens: Union[Lens, str],
        pixel: Union[Pixel, Response],
        focus_mm: Optional[float] = None,
        f_number: Optional[float] = None,
        *,
        width: int = 256,
        height: int = 256,
        window: Optional[Mapping[str, Any]] = None,
        microlens_shift: Union[str, Mapping[str, Any]] = "chief-ray",
        **settings: Any,
    ):
        known = ("mosaic", "readout", "spectrum", "effects", "registration", "tolerance", "footprints", "lens_tracing")
        unknown = [name for name in settings if name not in known]
        if unknown:
            raise ValueError(f"settings: {unknown[0]!r}; allowed: {', '.join(known)}")
        self.lens = Lens.builtin(lens) if isinstance(lens, str) else lens
        self.response = pixel.response() if isinstance(pixel, Pixel) else pixel
        self.focus_mm = focus_mm
        self.f_number = f_number
        self.width, self.height = width, height
        self._window = dict(window) if window is not None else {"at": "centre"}
        self._shift = {"rule": microlens_shift} if isinstance(microlens_shift, str) else dict(microlens_shift)
        self._mosaic = settings.pop("mosaic", None)
        self._settings = {name: value for name, value in settings.items() if value is not None}
        self._renderer = Renderer()
        # What cannot be is said now, and not at the first picture.
        self.lens.info(focus_mm, f_number)

    @property
    def pixel(self) -> Pixel:
        """The pixel."""
        return self.response.pixel

    def _sensor(self) -> Dict[str, Any]:
        sensor: Dict[str, Any] = {
            "pitch_um": self.pixel.pitch_um,
            "subpixels": self.pixel.subpixels,
            "width": self.width,
            "height": self.height,
            "window": self._window,
            "microlens_shift": self._shift,
        }
        if self._mosaic is not None:
            sensor["mosaic"] = self._mosaic
        return sensor

    def _recipe(self, scene: Scene) -> Dict[str, Any]:
        lens: Dict[str, Any] = {"name": self.lens.name}
        if self.focus_mm is not None:
            lens["focus_mm"] = self.focus_mm
        if self.f_number is not None:
            lens["f_number"] = self.f_number
        recipe: Dict[str, Any] = {
            "lens": lens,
            "sensor": self._sensor(),
            "response": self.response.recipe(),
            "planes": list(scene.planes),
            "environment": list(scene.environment),
            "render": {"rays_per_pixel": 1, "seed": 1},
            **self._settings,
        }
        if scene.world is not None:
            recipe["world"] = scene.world
        return recipe

    def configuration(self, scene: DrawnScene, rays_per_pixel: Optional[int] = None, exposure_ev: float = 0.0) -> Dict[str, Any]:
        """The configuration of `qpgen dataset` whose sample ``scene.index`` is this camera's picture of the scene."""
        if self.focus_mm is None:
            raise ValueError("focus_mm is infinite; drawn scenes need a finite one, their depths are multiples of it")
        lens: Dict[str, Any] = {"names": [self.lens.name], "focus_mm": self.focus_mm}
        if self.f_number is not None:
            lens["f_number"] = self.f_number
        response = self.response.recipe()
        if self.pixel.name is not None:
            response["pixels"] = [response.pop("pixel")]
        elif response.pop("focal_length_um") is not None:
            raise ValueError("focal_length_um: drawn scenes have the ideal pixel that fits the lens; allowed: None")
        return {
            "count": scene.index + 1,
            "seed": scene.seed,
            "lens": lens,
            "sensor": self._sensor(),
            "response": response,
            "scene": scene.settings,
            "exposure_ev": exposure_ev,
            **({} if rays_per_pixel is None else {"rays_per_pixel": rays_per_pixel}),
            **self._settings,
        }

    def render(
        self,
        scene: Union[Scene, DrawnScene],
        *,
        rays_per_pixel: Optional[int] = None,
        exposure_ev: float = 0.0,
        seed: int = 1,
        progress: Optional[Progress] = None,
    ) -> Sample:
        """Renders a scene, with its truth: the same numbers as `qpgen render`, and for a drawn scene as `qpgen dataset`.

        rays_per_pixel  per microlens and colour channel; each is added to all sub-pixels; None: 48, and 96 of worlds
        exposure_ev     stops; at 0 a white wall gives a sum of 1 in the middle of the window
        seed            of the rays; a drawn scene has its own
        progress        called with rays done and rays of all, in this thread

        Returns a `Sample`. ValueError names the field that cannot be, with its value and what is allowed. Ctrl-C stops.

        >>> camera = Camera("wide_US20120327520A1_emb3", Pixel.ideal(8.0), focus_mm=500.0, width=12, height=8)
        >>> sample = camera.render(Charts(seed=7, texture_px=64)[0], rays_per_pixel=4)
        >>> sample["depth"].shape, sample["left_right"].shape
        ((8, 12), (8, 12))
        """
        if isinstance(scene, DrawnScene):
            config = self.configuration(scene, rays_per_pixel, exposure_ev)
            recipe, hash = _native.draw(json.dumps(config), scene.index)
            return self._renderer.render(json.loads(recipe), scene.index, hash, progress)
        described = self._recipe(scene)
        described["exposure_ev"] = exposure_ev
        if rays_per_pixel is None:
            rays_per_pixel = 48 if scene.world is None else 96
        described["render"] = {"rays_per_pixel": rays_per_pixel, "seed": seed}
        return self._renderer.render(described, progress=progress)

    def convert(
        self,
        image: Any,
        depth: Any = None,
        *,
        level: str = "psf",
        rays_per_pixel: int = 96,
        exposure_ev: float = 0.0,
        seed: int = 1,
        progress: Optional[Progress] = None,
        **meaning: Any,
    ) -> Sample:
        """What the camera makes of a picture with depth, with its truth, as `qpgen convert` does: each of its pixels is a microlens.

        image, depth, meaning  as of `Picture`; or a `Picture` alone
        level                  "psf": kernels of every sub-pixel, scattered from layers of depth; "rays": the picture as surfaces through the
                               renderer, exact and far slower
        rays_per_pixel, seed   of "rays"
        exposure_ev, progress  as of `render`

        Returns a `Sample` of the picture's size, whatever the camera's; ``valid`` is False where more than a twentieth of the light is made up.

        >>> camera = Camera("wide_US20120327520A1_emb3", Pixel.ideal(8.0), focus_mm=500.0)
        >>> near = camera.convert(np.ones((16, 24, 3), dtype=np.float32), np.full((16, 24), 0.4, dtype=np.float32))
        >>> near["views"].shape, bool(np.nanmedian(near["left_right"]) > 0)
        ((4, 16, 24, 3), True)
        """
        if isinstance(image, Picture) == (depth is not None) or (isinstance(image, Picture) and meaning):
            raise ValueError("convert: allowed: a Picture alone, or an image and its depth")
        picture = image if isinstance(image, Picture) else Picture(image, depth, **meaning)
        if level not in ("psf", "rays"):
            raise ValueError(f"level is {level!r}; allowed: psf, rays")
        recipe = self._recipe(Scene())
        recipe["exposure_ev"] = exposure_ev
        recipe["render"] = {"rays_per_pixel": rays_per_pixel, "seed": seed}
        return self._renderer.convert(recipe, picture, level, progress)

    def psf(
        self,
        depths_m: Sequence[float] = (),
        fields: Tuple[int, int] = (5, 5),
        *,
        rays: int = 16384,
        source: str = "point",
    ) -> Dict[str, Any]:
        """The kernels (point-spread functions) of every sub-pixel: the arrays of `qpgen psf`.

        depths_m  m from the first lens vertex, `math.inf` allowed; empty: nine, even in inverse depth, and the focus among them
        fields    field nodes over the window, columns and rows, its corners included
        rays      per field node and colour channel
        source    what shines: "point", "pixel" (a square) or "sample" (bilinear between pixels)

        Returns ``kernel`` float32 [depth, field row, field column, channel, sub-pixel, y, x], parts of its light, x right and y down;
        ``energy_sr`` [field row, field column, channel, sub-pixel], what a white wall of radiance 1 gives; ``centroid_px`` [.., 2], (x, y)
        from the point; ``beyond``, the part of the light that diffraction takes farther; ``origin``, row and column of the point's own pixel;
        ``depth_m``, ``field_mm``: the axes; ``meta``.

        >>> camera = Camera("wide_US20120327520A1_emb3", Pixel.ideal(8.0), focus_mm=500.0, width=24, height=16)
        >>> bank = camera.psf([0.4], fields=(1, 1), rays=256)
        >>> bank["kernel"].shape[:5], bool(abs(bank["kernel"][0, 0, 0, 0, 0].sum() + bank["beyond"][0, 0, 0, 0, 0] - 1.0) < 1e-3)
        ((1, 1, 1, 3, 4), True)
        """
        return self._renderer.kernels(self._recipe(Scene()), depths_m, fields, rays, source)

    def truth(self, depth: Any) -> Dict[str, Floats]:
        """What the camera does to points at the depths of a map, whatever they look like.

        depth  (H, W) float32, z in m from the first lens vertex, of the camera's size: above 0, +inf for the sky, NaN where there is none

        Returns, px, NaN where there is no depth or no light: disparity and paraxial (m*n, H, W, 2), dx right and dy down, as in a `Sample`;
        left_right (H, W), where the pixel has two columns; coc (H, W), the signed circle of confusion, positive behind the focus.

        >>> camera = Camera("wide_US20120327520A1_emb3", Pixel.ideal(8.0), focus_mm=500.0, width=12, height=8)
        >>> truth = camera.truth(np.full((8, 12), 0.4, dtype=np.float32))
        >>> bool((truth["left_right"] > 0).all() and (truth["coc"] < 0).all())
        True
        """
        depth = floats(depth, "depth", (2,), finite=False)
        if depth.shape != (self.height, self.width):
            raise ValueError(f"depth: shape is {depth.shape}; allowed: that of the camera, {(self.height, self.width)}")
        if (depth <= 0.0).any():
            place = tuple(map(int, np.argwhere(depth <= 0.0)[0]))
            raise ValueError(f"depth: element {place} is {depth[place]}; allowed: above 0, +inf or NaN")
        traced, paraxial, coc = self._renderer.truth(self._recipe(Scene()), depth)
        truth = {"disparity": traced, "paraxial": paraxial, "coc": coc}
        if int(self.pixel.subpixels.split("x")[0]) > 1:
            truth["left_right"] = left_right(traced, {"sensor": {"subpixels": self.pixel.subpixels}})
        return truth
