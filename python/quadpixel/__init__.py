"""Cameras whose pixels see the pupil in parts: simulated, and their datasets read, in NumPy arrays.

`Camera` (of a `Lens` and a `Pixel`) renders a `Scene`, `Charts` or `Worlds`, converts a `Picture` with depth and gives its kernels; `Configuration` draws whole datasets; `Dataset` reads those of `qpgen`;
`views`, `disparity`, `dense_disparity`, `depth`, `calibrate`, `correct_aberrations`, `sharpness` and `refocus` are the algorithms of `qpalgo`.
`show` and `to_rerun` draw samples; `quadpixel.torch` renders inside a training loop.

All pictures have row 0 on top and are linear, 1 = the sensor's white in the sum of the sub-pixels. All maps have the size of a
view, H x W pixels (1 px = 1 microlens); NaN means: no truth there, and ``valid`` is False at the same pixels.
"""

from .algorithms import (
    VERDICTS,
    Matches,
    calibrate,
    correct_aberrations,
    dense_disparity,
    depth,
    disparity,
    refocus,
    set_threads,
    sharpness,
    views,
)
from .camera import Camera
from .configuration import Configuration
from .dataset import ITEMS, Dataset, decode
from .development import linear_from_codes
from .files import read_exr, read_jpeg, read_png
from .geometry import (
    LUMINANCE,
    channel_disparity,
    depth_from_disparity,
    depth_from_left_right,
    disparity_ratio,
    halves,
    left_right,
    mosaic_channels,
    side_members,
    subpixel_names,
)
from .lens import Lens, Svg
from .pictures import show, to_rerun
from .pixel import Pixel, Response
from .rendering import Sample
from .rgbd import Picture, Pictures
from .scene import Charts, DrawnScene, Scene, Worlds, card
from .shards import iterate_shard, iterate_shards

__all__ = [
    "ITEMS",
    "LUMINANCE",
    "VERDICTS",
    "Camera",
    "Charts",
    "Configuration",
    "Dataset",
    "DrawnScene",
    "Lens",
    "Matches",
    "Picture",
    "Pictures",
    "Pixel",
    "Response",
    "Sample",
    "Scene",
    "Svg",
    "Worlds",
    "calibrate",
    "card",
    "channel_disparity",
    "correct_aberrations",
    "decode",
    "dense_disparity",
    "depth",
    "depth_from_disparity",
    "depth_from_left_right",
    "disparity",
    "disparity_ratio",
    "halves",
    "iterate_shard",
    "iterate_shards",
    "left_right",
    "linear_from_codes",
    "mosaic_channels",
    "read_exr",
    "read_jpeg",
    "read_png",
    "refocus",
    "set_threads",
    "sharpness",
    "show",
    "side_members",
    "subpixel_names",
    "to_rerun",
    "views",
]
__version__ = "0.1.0"
